#include "metaball/metaball_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "metaball/error.h"
#include "test_scenes.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;

class MetaballFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    // A folder for each test: ctest runs them side by side.
    folder_ = fs::path(::testing::TempDir()) /
              (std::string("sherd_metaball_file_") +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    path_ = (folder_ / "cloud.metaballs").string();
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string Bytes() const {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void WriteBytes(const std::string& bytes) const {
    std::ofstream(path_, std::ios::binary)
        .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }

  fs::path folder_;
  std::string path_;
};

TEST_F(MetaballFileTest, EveryCombinationOfChannelsRoundTrips) {
  for (int mask = 0; mask < 4; ++mask) {
    CloudInput input = testing::RandomBall(100, 0.2, 5, 7);
    if (!(mask & 1)) {
      input.radius.clear();
      input.uniform_radius = 0.125;
    }
    if (!(mask & 2)) input.color.clear();
    Cloud cloud = BuildCloud(input);
    cloud.uniform_color = {1, 2, 3};
    WriteMetaballFile(path_, cloud, 0.42);
    EXPECT_TRUE(IsMetaballFile(path_));
    const MetaballFile read = ReadMetaballFile(path_);
    EXPECT_EQ(read.threshold, 0.42);
    EXPECT_EQ(read.cloud.center, cloud.center);
    EXPECT_EQ(read.cloud.radius, cloud.radius);
    EXPECT_EQ(read.cloud.color, cloud.color);
    EXPECT_EQ(read.cloud.uniform_radius, cloud.uniform_radius);
    EXPECT_EQ(read.cloud.uniform_color, cloud.uniform_color);
    EXPECT_EQ(read.cloud.frame.origin, cloud.frame.origin);
    EXPECT_EQ(read.cloud.frame.unit, cloud.frame.unit);
  }
}

// A cloud and a surface that use everything version 2 can say.
struct Full {
  Cloud cloud;
  Surface surface;
};
Full EverythingAtOnce(int n = 40) {
  CloudInput input = testing::RandomBall(n, 0.2, 5, 7);
  for (std::size_t i = 0; i < input.center.size(); ++i) {
    input.threshold.push_back(0.2 + 0.01 * static_cast<double>(i));
  }
  input.channels.emplace_back("uv", ChannelType::kFloat32, 2, input.center.size());
  input.channels.emplace_back("normal", ChannelType::kOctahedral, 3, input.center.size());
  input.channels.emplace_back("age", ChannelType::kUnorm16, 1, input.center.size(), -5.0f, 20.0f);
  input.channels.emplace_back("layer \xc3\xa4", ChannelType::kUnorm8, 4, input.center.size());
  for (Channel& channel : input.channels) {
    for (std::size_t i = 0; i < channel.size(); ++i) {
      const float v = static_cast<float>(i) / static_cast<float>(channel.size());
      channel.Set(i, {{v, 1 - v, v * v, 0.5f}});
    }
  }
  Full full;
  full.cloud = BuildCloud(input);
  full.surface.threshold = 0.42;
  full.surface.radius_scale = 1.25;
  full.surface.density = ParseDensity("blinn:7.3,1.7");
  full.surface.mode = ThresholdMode::kBlended;
  return full;
}

TEST_F(MetaballFileTest, VersionTwoKeepsSurfaceThresholdsAndChannels) {
  const Full full = EverythingAtOnce();
  WriteMetaballFile(path_, full.cloud, full.surface);
  EXPECT_EQ(Bytes()[8], 2);
  const MetaballFile read = ReadMetaballFile(path_);
  const Surface surface = read.SurfaceOf();
  EXPECT_EQ(surface.threshold, 0.42);
  EXPECT_EQ(surface.radius_scale, 1.25);
  EXPECT_EQ(TextOf(surface.density), "blinn:7.3,1.7");
  EXPECT_EQ(surface.mode, ThresholdMode::kBlended);
  EXPECT_EQ(read.cloud.center, full.cloud.center);
  EXPECT_EQ(read.cloud.radius, full.cloud.radius);
  EXPECT_EQ(read.cloud.threshold, full.cloud.threshold);
  EXPECT_EQ(read.cloud.color, full.cloud.color);
  ASSERT_EQ(read.cloud.channels.size(), full.cloud.channels.size());
  for (std::size_t k = 0; k < full.cloud.channels.size(); ++k) {
    const Channel& a = read.cloud.channels[k];
    const Channel& b = full.cloud.channels[k];
    EXPECT_EQ(a.name(), b.name());
    EXPECT_EQ(a.type(), b.type());
    EXPECT_EQ(a.components(), b.components());
    EXPECT_EQ(a.lo(), b.lo());
    EXPECT_EQ(a.hi(), b.hi());
    EXPECT_EQ(a.bytes(), b.bytes());
  }
}

TEST_F(MetaballFileTest, EveryNewThingByItselfRoundTripsAsVersionTwo) {
  const Cloud plain = BuildCloud(testing::RandomBall(10, 0.2, 5, 7));
  const auto written = [&](const Cloud& cloud, const Surface& surface) {
    WriteMetaballFile(path_, cloud, surface);
    EXPECT_EQ(Bytes()[8], 2);
    return ReadMetaballFile(path_);
  };
  Surface surface;
  for (const ThresholdMode mode :
       {ThresholdMode::kBlended, ThresholdMode::kSummed, ThresholdMode::kGated}) {
    surface.mode = mode;
    EXPECT_EQ(written(plain, surface).mode, mode);
  }
  surface = {};
  for (const DensityModel& density : AllDensities()) {
    if (TextOf(density) == "murakami") continue;
    surface.density = density;
    EXPECT_EQ(TextOf(written(plain, surface).density), TextOf(density));
  }
  surface = {};
  surface.radius_scale = 0.5;
  EXPECT_EQ(written(plain, surface).radius_scale, 0.5);
  Cloud cloud = plain;
  cloud.threshold.assign(cloud.size(), 0.25f);
  EXPECT_EQ(written(cloud, {}).cloud.threshold, cloud.threshold);
  cloud = plain;
  cloud.channels.emplace_back("age", ChannelType::kFloat32, 1, cloud.size());
  EXPECT_EQ(written(cloud, {}).cloud.channels.size(), 1u);
}

TEST_F(MetaballFileTest, WithoutAnythingNewTheBytesAreVersionOne) {
  CloudInput input = testing::OneMetaball({1, 2, 3}, 0.5);
  input.color = {{10, 20, 30}};
  const Cloud cloud = BuildCloud(input);
  // The bytes as the first version of the program wrote them.
  std::string expected = "SHERDMB\n";
  const auto put = [&](auto value) {
    expected.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  put(std::uint32_t{1});
  put(std::uint32_t{18});
  put(std::uint64_t{1});
  for (const double v : {1.0, 2.0, 3.0, 1.0, 0.25}) put(v);
  put(0.0f);
  for (const std::uint8_t v : {200, 200, 200, 0}) put(v);
  for (const float v : {0.0f, 0.0f, 0.0f, 0.5f}) put(v);
  for (const std::uint8_t v : {10, 20, 30}) put(v);
  WriteMetaballFile(path_, cloud, 0.25);
  EXPECT_EQ(Bytes(), expected);
  Surface surface;
  surface.threshold = 0.25;
  surface.density.degree = 7;  // of no meaning for Murakami's density
  WriteMetaballFile(path_, cloud, surface);
  EXPECT_EQ(Bytes(), expected);
}

TEST_F(MetaballFileTest, VersionTwoTruncatedOrDamagedIsAnInputError) {
  const Full full = EverythingAtOnce(3);
  WriteMetaballFile(path_, full.cloud, full.surface);
  const std::string whole = Bytes();
  for (std::size_t n = 0; n < whole.size(); ++n) {
    WriteBytes(whole.substr(0, n));
    EXPECT_THROW(ReadMetaballFile(path_), InputError) << n;
  }
  WriteBytes(whole + "x");
  EXPECT_THROW(ReadMetaballFile(path_), InputError);
  int refused = 0;
  for (std::size_t n = 0; n < whole.size(); ++n) {
    for (const char flip : {'\x01', '\x10', '\x80', '\xff'}) {
      std::string bytes = whole;
      bytes[n] = static_cast<char>(bytes[n] ^ flip);
      WriteBytes(bytes);
      try {
        ReadMetaballFile(path_).cloud.Validate("flipped");
      } catch (const InputError&) {
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, 100);
}

TEST_F(MetaballFileTest, DamageInVersionTwoIsNamedWithItsByte) {
  const Full full = EverythingAtOnce(3);
  WriteMetaballFile(path_, full.cloud, full.surface);
  const std::string whole = Bytes();
  const auto expect_place = [&](std::size_t at, auto value, const std::string& place) {
    std::string bytes = whole;
    bytes.replace(at, sizeof value, reinterpret_cast<const char*>(&value), sizeof value);
    WriteBytes(bytes);
    try {
      ReadMetaballFile(path_);
      ADD_FAILURE() << place;
    } catch (const InputError& error) {
      EXPECT_EQ(error.place(), place) << error.what();
    }
  };
  expect_place(8, std::uint32_t{3}, "byte 8");
  expect_place(12, std::uint32_t{1}, "byte 12");
  expect_place(16, std::uint64_t{1} << 60, "byte 16");
  expect_place(72, -1.0, "byte 72");
  expect_place(80, std::uint32_t{4}, "byte 80");
  expect_place(84, std::uint32_t{0xffffffff}, "byte 84");
  expect_place(88, std::uint32_t{0x7fffffff}, "byte 88");
  expect_place(92, 'x', "byte 92");
  const std::size_t first = 92 + TextOf(full.surface.density).size();
  expect_place(first, std::uint32_t{0xffffffff}, "byte " + std::to_string(first));
  expect_place(first, std::uint32_t{0}, "byte " + std::to_string(first + 4));  // a type of letters
  expect_place(first + 6, std::uint32_t{9}, "byte " + std::to_string(first + 6));
  expect_place(first + 10, std::uint32_t{5}, "byte " + std::to_string(first));
  const std::size_t values = whole.size() - 3 * (8 + 4 + 2 + 4);
  expect_place(values + 8, NAN, "byte " + std::to_string(values + 8));
  // Version 1 has no thresholds.
  expect_place(8, std::uint32_t{1}, "byte 12");
}

TEST_F(MetaballFileTest, WhatNoReaderWouldTakeIsNotWritten) {
  const Full good = EverythingAtOnce(3);
  Full bad = good;
  bad.cloud.channels[0].Set(1, {{NAN, 0, 0, 0}});
  EXPECT_THROW(WriteMetaballFile(path_, bad.cloud, bad.surface), InputError);
  bad = good;
  bad.cloud.threshold[1] = 0;
  EXPECT_THROW(WriteMetaballFile(path_, bad.cloud, bad.surface), InputError);
  bad = good;
  bad.surface.radius_scale = 0;
  EXPECT_THROW(WriteMetaballFile(path_, bad.cloud, bad.surface), InputError);
  bad = good;
  bad.surface.density.rate = -1;
  EXPECT_THROW(WriteMetaballFile(path_, bad.cloud, bad.surface), Error);
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(MetaballFileTest, AnEmptyCloudRoundTrips) {
  WriteMetaballFile(path_, Cloud{}, 0.7);
  EXPECT_TRUE(ReadMetaballFile(path_).cloud.empty());
}

TEST_F(MetaballFileTest, TruncationAtEveryByteIsAnInputError) {
  WriteMetaballFile(path_, BuildCloud(testing::RandomBall(5, 0.2, 5, 7)), 0.7);
  const std::string whole = Bytes();
  for (std::size_t n = 0; n < whole.size(); ++n) {
    WriteBytes(whole.substr(0, n));
    EXPECT_THROW(ReadMetaballFile(path_), InputError) << n;
  }
  WriteBytes(whole + "x");
  EXPECT_THROW(ReadMetaballFile(path_), InputError);
}

TEST_F(MetaballFileTest, AnyByteMayBeWrongWithoutACrash) {
  WriteMetaballFile(path_, BuildCloud(testing::RandomBall(5, 0.2, 5, 7)), 0.7);
  const std::string whole = Bytes();
  for (std::size_t n = 0; n < whole.size(); ++n) {
    for (const char flip : {'\x01', '\x80', '\xff'}) {
      std::string bytes = whole;
      bytes[n] = static_cast<char>(bytes[n] ^ flip);
      WriteBytes(bytes);
      try {
        ReadMetaballFile(path_).cloud.Validate("flipped");
      } catch (const InputError&) {
      }
    }
  }
}

TEST_F(MetaballFileTest, ACountThatLiesIsFoundBeforeAllocation) {
  WriteMetaballFile(path_, BuildCloud(testing::RandomBall(5, 0.2, 5, 7)), 0.7);
  std::string bytes = Bytes();
  const std::uint64_t lie = 0x7fffffffffffffffull;
  bytes.replace(16, 8, reinterpret_cast<const char*>(&lie), 8);
  WriteBytes(bytes);
  try {
    ReadMetaballFile(path_);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.place(), "byte 16");
  }
}

TEST_F(MetaballFileTest, FailingToWriteLeavesTheOldFile) {
  WriteMetaballFile(path_, Cloud{}, 0.7);
  const std::string nowhere = (folder_ / "no" / "such" / "folder.metaballs").string();
  EXPECT_THROW(WriteMetaballFile(nowhere, Cloud{}, 0.7), OutputError);
  EXPECT_FALSE(fs::exists(nowhere));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);  // no temporary file is left
  // A name that is a folder cannot be replaced.
  fs::create_directories(folder_ / "taken.metaballs" / "x");
  EXPECT_THROW(WriteMetaballFile((folder_ / "taken.metaballs").string(), Cloud{}, 0.7),
               OutputError);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 2);
}

TEST_F(MetaballFileTest, OtherFilesAreNamedAsSuch) {
  WriteBytes(
      "ply\nformat ascii 1.0\nand so on, long enough to hold the header of a metaball file..");
  EXPECT_FALSE(IsMetaballFile(path_));
  EXPECT_THROW(ReadMetaballFile(path_), InputError);
  EXPECT_THROW(ReadMetaballFile((folder_ / "absent").string()), InputError);
}

}  // namespace
}  // namespace sherd
