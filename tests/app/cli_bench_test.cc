// sherd bench: the files it leaves, and what it refuses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/app/run_sherd.h"
#include "tests/app/test_workspace.h"

namespace sherd {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using testing::ExpectFailure;
using ::testing::HasSubstr;
using testing::RunResult;
using testing::RunSherd;
using ::testing::StartsWith;

class CliBench : public ::testing::Test {
 protected:
  void SetUp() override { folder_ = testing::FreshFolder("bench"); }
  std::string Out() const { return " --out '" + folder_ + "/out'"; }
  std::string folder_;
};

TEST_F(CliBench, TwoMethodsAsTablesAndPlots) {
  const RunResult run = RunSherd(
      "bench --scene shell --metaballs 300 --size 32x18 --methods ours,polynomial --repeat 1" +
      Out());
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("ours, vectors"));
  EXPECT_THAT(
      testing::Listing(folder_ + "/out"),
      ElementsAre("bench.csv", "bench.json", "error_against_time.png", "error_against_time.svg"));
  EXPECT_THAT(testing::ReadText(folder_ + "/out/bench.csv"),
              StartsWith("method,parameter,precision,backend,error,device,wall_seconds,"));
  const json figures = json::parse(testing::ReadText(folder_ + "/out/bench.json"));
  EXPECT_EQ(figures["scene"], "shell");
  EXPECT_EQ(figures["metaballs"], 300);
  EXPECT_EQ(figures["rows"][0]["method"], "ours");
  EXPECT_EQ(figures["rows"][0]["missed"], 0);
  EXPECT_EQ(figures["rows"].back()["method"], "polynomial");
}

TEST_F(CliBench, ThresholdsOfEveryMetaballAreMeasuredToo) {
  const RunResult run = RunSherd(
      "bench --metaballs 300 --size 32x18 --thresholds blended --repeat 1 "
      "--methods ours,interval,polynomial" +
      Out());
  ASSERT_EQ(run.code, 0) << run.err;
  const json figures = json::parse(testing::ReadText(folder_ + "/out/bench.json"));
  EXPECT_EQ(figures["thresholds"], "blended");
  for (const json& row : figures["rows"]) {
    EXPECT_EQ(row["error"], "") << row["method"];
    EXPECT_EQ(row["missed"], 0) << row["method"];
  }
}

TEST_F(CliBench, AFileIsMeasuredToo) {
  testing::WritePly(folder_ + "/cloud.ply", 200);
  const RunResult run =
      RunSherd("bench '" + folder_ + "/cloud.ply' --size 24x16 --methods ours --repeat 1" + Out());
  ASSERT_EQ(run.code, 0) << run.err;
  const json figures = json::parse(testing::ReadText(folder_ + "/out/bench.json"));
  EXPECT_EQ(figures["scene"], "cloud.ply");
  EXPECT_EQ(figures["rows"][0]["missed"], 0);
}

TEST_F(CliBench, WhatCannotBeDrawnIsListed) {
  const RunResult run = RunSherd(
      "bench --metaballs 100 --size 16x9 --density blinn:16,5 --methods polynomial --repeat 1" +
      Out());
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.out, StartsWith("polynomial: "));
  EXPECT_THAT(testing::Listing(folder_ + "/out"), ElementsAre("bench.csv", "bench.json"));
}

TEST_F(CliBench, BadArgumentsAreOneLine) {
  ExpectFailure(RunSherd("bench --methods guessing" + Out()), 2, "guessing");
  ExpectFailure(RunSherd("bench --scene moon" + Out()), 2, "--scene");
  ExpectFailure(RunSherd("bench --thresholds soft" + Out()), 2, "--thresholds");
  ExpectFailure(RunSherd("bench --metaballs many" + Out()), 2, "many");
  ExpectFailure(RunSherd("bench --metaballs 1k,2k" + Out()), 2, "--metaballs");
  ExpectFailure(RunSherd("bench --density soup" + Out()), 2, "soup");
  ExpectFailure(RunSherd("bench --repeat 0" + Out()), 2, "--repeat");
  ExpectFailure(RunSherd("bench --level 63k" + Out()), 2, "SOURCE");
  ExpectFailure(RunSherd("bench --stability --features" + Out()), 2, "excludes");
  ExpectFailure(RunSherd("bench cloud.ply --scene shell" + Out()), 2, "excludes");
  ExpectFailure(RunSherd("bench none.ply" + Out()), 2, "none.ply");
  testing::WriteText(folder_ + "/file", "x");
  ExpectFailure(RunSherd("bench --out '" + folder_ + "/file/out'"), 3, "file");
}

}  // namespace
}  // namespace sherd
