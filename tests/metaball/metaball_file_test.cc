#include "metaball/metaball_file.h"

#include <gtest/gtest.h>

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
