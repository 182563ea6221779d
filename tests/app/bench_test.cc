// The parts that measurements are made of: fronts, tables, contenders, plots.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "app/bench/bench_files.h"
#include "app/bench/contenders.h"
#include "app/bench/error_plot.h"
#include "app/bench/features.h"
#include "app/bench/figure_table.h"
#include "app/bench/measure.h"
#include "app/bench/pareto.h"
#include "datasets_synthetic/peer_scenes.h"
#include "metaball/error.h"
#include "tests/app/test_workspace.h"

namespace sherd {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(ParetoFront, KeepsWhatNothingBeats) {
  // 1 is beaten by 0, 3 by 2; 4 costs more time than all and is the most exact.
  const std::vector<CostPair> points = {{1, 5}, {2, 6}, {3, 2}, {3, 4}, {9, 0}};
  EXPECT_THAT(ParetoFront(points), ElementsAre(0, 2, 4));
}

TEST(ParetoFront, OfEqualPointsTheFirst) {
  const std::vector<CostPair> points = {{2, 1}, {1, 1}, {1, 1}};
  EXPECT_THAT(ParetoFront(points), ElementsAre(1));
  EXPECT_TRUE(ParetoFront({}).empty());
}

TEST(FigureTable, CsvQuotesWhatNeedsIt) {
  const FigureTable table{{"a", "b"},
                          {{Figure{"x, \"y\""}, Figure{0.25}}, {Figure{}, Figure{true}}}};
  EXPECT_EQ(CsvOf(table), "a,b\n\"x, \"\"y\"\"\",0.25\n,true\n");
}

TEST(FigureTable, JsonHasHeaderAndRows) {
  const FigureTable table{{"n", "none"}, {{Figure{3.0}, Figure{1.0 / 0.0}}}};
  const std::string text = JsonOf({{"scene", Figure{"field"}}}, table);
  EXPECT_THAT(text, HasSubstr("\"scene\": \"field\""));
  EXPECT_THAT(text, HasSubstr("\"n\": 3,"));
  EXPECT_THAT(text, HasSubstr("\"none\": null"));
}

TEST(Contenders, EverySeriesHasItsPlaceInThePlot) {
  const PeerScene peer = MakeHeightField(100, 8, 8);
  const std::set<std::string> known(AllSeries().begin(), AllSeries().end());
  EXPECT_EQ(known.size(), AllSeries().size());
  std::set<std::string> methods;
  for (const Contender& contender : MakeContenders(std::vector<Method>{}, peer.scene)) {
    EXPECT_TRUE(known.contains(contender.series)) << contender.series;
    methods.insert(contender.method);
  }
  EXPECT_EQ(methods.size(), AllMethods().size());
}

TEST(Contenders, OursSaysWhenItWorksInDoubles) {
  PeerScene peer = MakeHeightField(100, 8, 8);
  EXPECT_EQ(MakeContenders(Method::kOurs, peer.scene)[0].precision, "float");
  peer.scene.surface.threshold = 0.9999;  // the density's peak is 1
  EXPECT_EQ(MakeContenders(Method::kOurs, peer.scene)[0].precision, "double");
}

// A field of 400 metaballs at 32 x 18.
class MeasureTest : public ::testing::Test {
 protected:
  std::vector<Measurement> MeasureAll(Method method) {
    const ReferenceFrame reference = ReferenceRender(peer_.scene, peer_.camera);
    std::vector<Measurement> all;
    for (const Contender& contender : MakeContenders(method, peer_.scene)) {
      all.push_back(Measure(contender, peer_.scene, peer_.camera, reference, 1, 1, {}));
    }
    return all;
  }
  PeerScene peer_ = MakeHeightField(400, 32, 18);
};

TEST_F(MeasureTest, OursIsExactAndFineStepsAreBetterThanCoarse) {
  for (const Measurement& m : MeasureAll(Method::kOurs)) {
    EXPECT_TRUE(m.drawn()) << m.error;
    EXPECT_EQ(m.difference.WrongShare(), 0) << m.series;
    EXPECT_LT(m.difference.depth_max, 1e-4) << m.series;
    EXPECT_GT(m.bytes, 0u);
    EXPECT_NEAR(m.rays_per_second * m.seconds.wall, 32 * 18, 1e-6);
    EXPECT_LE(m.seconds.wall_min, m.seconds.wall);
  }
  const std::vector<Measurement> spheres = MeasureAll(Method::kSphereTracing);
  EXPECT_LT(spheres.back().difference.depth_p99, spheres.front().difference.depth_p99);
}

TEST_F(MeasureTest, WhatCannotBeDrawnSaysWhy) {
  peer_.scene.surface.density = ParseDensity("blinn:16,5");
  const std::vector<Measurement> all = MeasureAll(Method::kPolynomial);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_FALSE(all[0].drawn());
  EXPECT_THAT(ErrorsOf(all), StartsWith("polynomial: "));
  EXPECT_EQ(ScreenTable(all).size(), 1u);  // the names of the columns alone
  const FigureTable table = FiguresOf(all);
  EXPECT_EQ(table.rows[0].size(), table.columns.size());
  EXPECT_THROW(WriteErrorPlot({}, all, testing::FreshFolder("plot") + "/p"), Error);
}

TEST_F(MeasureTest, PlotIsWrittenAsBothKindsOrNotAtAll) {
  const std::vector<Measurement> all = MeasureAll(Method::kOurs);
  const std::string folder = testing::FreshFolder("plot");
  WriteErrorPlot({.name = "field #1"}, all, folder + "/p");
  EXPECT_THAT(testing::Listing(folder), ElementsAre("p.png", "p.svg"));
  EXPECT_THAT(testing::ReadText(folder + "/p.png"), StartsWith("\x89PNG"));
  EXPECT_THAT(testing::ReadText(folder + "/p.svg"), HasSubstr("</svg>"));
  EXPECT_THROW(WriteErrorPlot({}, all, folder + "/none/p"), OutputError);
  EXPECT_THAT(testing::Listing(folder), ElementsAre("p.png", "p.svg"));
}

TEST(MeasureBytes, ChannelsTakeWhatTheirTypesSay) {
  FeatureOptions options;
  options.metaballs = 900;
  options.width = options.height = 16;
  const std::vector<BytesRow> rows = MeasureBytes(options, {});
  const auto bytes = [&](const std::string& what) {
    for (const BytesRow& row : rows) {
      if (row.what == what) return row.bytes;
    }
    ADD_FAILURE() << what;
    return -1.0;
  };
  EXPECT_NEAR(bytes("centre"), 12, 0.01);
  EXPECT_NEAR(bytes("+ colour, sRGB"), 3, 0.01);
  EXPECT_NEAR(bytes("+ normal, octahedral"), 4, 0.01);
  EXPECT_NEAR(bytes("centre, radius, threshold, normal, texture coordinates"), 28, 0.01);
}

TEST(MeasureFeatures, EveryFeatureIsDrawnAndTimed) {
  FeatureOptions options;
  options.metaballs = 400;
  options.width = options.height = 24;
  options.repeat = 1;
  const std::vector<FeatureRow> rows = MeasureFeatures(options, {});
  ASSERT_FALSE(rows.empty());
  for (const FeatureRow& row : rows) {
    EXPECT_EQ(row.error, "") << row.feature;
    EXPECT_GT(row.ratio(), 0) << row.feature;
  }
}

}  // namespace
}  // namespace sherd
