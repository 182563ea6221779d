// The options of the benchmark programs, and the report they write.
#include "bench_options.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "json_writer.h"

namespace sherd {
namespace {

BenchOptions Parse(std::vector<std::string> words) {
  words.insert(words.begin(), "program");
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  return ParseBenchOptions(static_cast<int>(argv.size()), argv.data());
}

TEST(BenchOptions, CountsHaveSuffixes) {
  EXPECT_EQ(Parse({"--counts", "500,63k,5M"}).counts,
            (std::vector<std::uint64_t>{500, 63'000, 5'000'000}));
  EXPECT_EQ(ParseCount("--counts", "1000M"), 1'000'000'000u);
  for (const char* wrong : {"", "k", "5m", "5 k", "1.5M", "-3", "0", "0k", "5Mk", "1001M",
                            "18446744073709551615", "18446744073709552M", "1e5"}) {
    EXPECT_THROW(ParseCount("--counts", wrong), std::invalid_argument) << wrong;
  }
}

TEST(BenchOptions, ListsAndSizes) {
  const BenchOptions options =
      Parse({"--sizes", "320x180,7x9", "--frames", "3", "--json", "a.json", "--warm-up", "0"});
  ASSERT_EQ(options.sizes.size(), 2u);
  EXPECT_EQ(options.sizes[0].width, 320);
  EXPECT_EQ(options.sizes[1].height, 9);
  EXPECT_EQ(options.frames, 3);
  EXPECT_EQ(options.warm_up, 0);
  EXPECT_EQ(options.json, "a.json");
  for (const char* wrong : {"", "320", "320x", "x180", "320x180x", "0x180", "320x-1", "320x180,",
                            ",320x180", "99999x1", "320 x 180"}) {
    EXPECT_THROW(Parse({"--sizes", wrong}), std::invalid_argument) << wrong;
  }
  EXPECT_THROW(Parse({"--frames", "0"}), std::invalid_argument);
  EXPECT_THROW(Parse({"--frames", "3x"}), std::invalid_argument);
  EXPECT_THROW(Parse({"--frames"}), std::invalid_argument);
  EXPECT_THROW(Parse({"--fames", "3"}), std::invalid_argument);
}

TEST(BenchOptions, AProgramsOwnComeFirst) {
  std::string words[] = {"program", "--fast", "--frames", "2", "--backend", "cpu"};
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  bool fast = false;
  std::string backend;
  const OwnOption own = [&](const std::string& name, const OptionValue& value) {
    if (name == "--fast") return fast = true;
    if (name != "--backend") return false;
    backend = value();
    return true;
  };
  EXPECT_EQ(ParseBenchOptions(6, argv.data(), own).frames, 2);
  EXPECT_TRUE(fast);
  EXPECT_EQ(backend, "cpu");
  EXPECT_THROW(ParseBenchOptions(5, argv.data(), own), std::invalid_argument);
}

TEST(BenchOptions, ASizedSceneKeepsItsHorizontalAngle) {
  const PeerScene peer = MakeHeightField(100, 1280, 720);
  const PeerScene sized = Sized(peer, {640, 480});
  EXPECT_EQ(sized.camera.width, 640);
  EXPECT_EQ(sized.camera.height, 480);
  EXPECT_DOUBLE_EQ(sized.camera.width / sized.camera.fx, peer.camera.width / peer.camera.fx);
  EXPECT_DOUBLE_EQ(sized.camera.fx, sized.camera.fy);
  EXPECT_DOUBLE_EQ(sized.camera.cy, 240);
}

TEST(JsonWriter, TakesInWhatAnotherWrote) {
  JsonWriter list, report;
  list.BeginArray();
  list.BeginObject().Field("name", "a\nb").Field("nothing", 0.0 / 0.0).EndObject();
  list.EndArray();
  report.BeginObject().Field("first", 1).Key("list").Value(list).Field("last", true).EndObject();
  EXPECT_EQ(report.text(), R"({
  "first": 1,
  "list": [
    {
      "name": "a\u000ab",
      "nothing": null
    }
  ],
  "last": true
}
)");
}

}  // namespace
}  // namespace sherd
