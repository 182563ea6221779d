#include "metaball/thesis_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>

#include "metaball/error.h"
#include "test_scenes.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class ThesisFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              (std::string("sherd_thesis_file_") +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    text_ = (folder_ / "cloud.mbt").string();
    binary_ = (folder_ / "cloud.mbb").string();
  }
  void TearDown() override { fs::remove_all(folder_); }

  static std::string Bytes(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static void WriteBytes(const std::string& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary)
        .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  // The place and message of the InputError that reading `bytes` must give.
  static void ExpectError(const std::string& path, const std::string& bytes,
                          const std::string& place, const std::string& what) {
    WriteBytes(path, bytes);
    try {
      ReadThesisFile(path);
      ADD_FAILURE() << "read without an error: " << what;
    } catch (const InputError& error) {
      EXPECT_EQ(error.place(), place) << error.what();
      EXPECT_THAT(error.what(), HasSubstr(what));
    }
  }

  fs::path folder_;
  std::string text_, binary_;
};

// A file with these flags and names whose numbers are all allowed: positive, at most 1.
ThesisFile FileOf(std::uint32_t flags, std::vector<std::string> names, std::uint32_t count = 7) {
  ThesisFile file;
  file.count = count;
  file.flags = flags;
  file.names = std::move(names);
  if (!(flags & kThesisRadius)) file.default_radius = 0.1f;
  if (!(flags & kThesisThreshold)) file.default_threshold = 0.3f;
  std::mt19937 random(flags + 1);
  std::uniform_real_distribution<float> uniform(0.001f, 1.0f);
  const int width = LayoutOf(file, "test").width;
  for (std::uint32_t k = 0; k < count * static_cast<std::uint32_t>(width); ++k) {
    file.values.push_back(uniform(random));
  }
  return file;
}

// Every way to fill in the names for these flags.
std::vector<std::vector<std::string>> NamesFor(std::uint32_t flags) {
  std::vector<std::vector<std::string>> all{{}};
  const auto extend =
      [&](const std::function<std::vector<std::string>(const std::vector<std::string>&)>& choices) {
        std::vector<std::vector<std::string>> next;
        for (const auto& names : all) {
          for (const std::string& choice : choices(names)) {
            next.push_back(names);
            if (!choice.empty()) next.back().push_back(choice);
          }
        }
        all = std::move(next);
      };
  if (flags & kThesisColor) {
    extend([](const auto&) { return std::vector<std::string>{"Color", "sheet of earth.png"}; });
  }
  if (flags & kThesisNormalMap) {
    extend([](const std::vector<std::string>& names) {
      std::vector<std::string> choices{"Normal", "UVnormals.png"};
      if (!names.empty() && names[0] != "Color") choices.push_back("normals.png");
      return choices;
    });
  }
  extend([](const auto&) {
    return std::vector<std::string>{"", "Channel 1 age", "Color", "UVdirt.png",
                                    "Origin 500000.25 4649776.5 -2"};
  });
  return all;
}

TEST_F(ThesisFileTest, EveryCombinationOfFieldsRoundTripsInBothEncodings) {
  int combinations = 0;
  for (std::uint32_t flags = 0; flags <= kThesisFlags; ++flags) {
    for (const auto& names : NamesFor(flags)) {
      const ThesisFile file = FileOf(flags, names);
      for (const std::string& path : {text_, binary_}) {
        WriteThesisFile(path, file);
        EXPECT_EQ(ReadThesisFile(path), file) << path << " flags " << flags;
        ++combinations;
      }
    }
  }
  // Flags without 16 and 32: 5 endings; with 16: 2 x 5; with 32: 2 x 5; with both: (2 + 3) x 5;
  // each for 16 combinations of the other flags and two encodings.
  EXPECT_EQ(combinations, 16 * 2 * 5 * (1 + 2 + 2 + 5));
}

TEST_F(ThesisFileTest, EveryCombinationBecomesACloudAndComesBack) {
  for (std::uint32_t flags = 0; flags <= kThesisFlags; ++flags) {
    for (const auto& names : NamesFor(flags)) {
      const ThesisFile file = FileOf(flags, names);
      if (!(flags & kThesisCenter)) {
        EXPECT_THROW(SceneOfThesis(file, "test"), InputError);
        continue;
      }
      const ThesisLayout layout = LayoutOf(file, "test");
      const ThesisScene scene = SceneOfThesis(file, "test");
      const Cloud& cloud = scene.cloud;
      ASSERT_EQ(cloud.size(), file.count);
      EXPECT_EQ(cloud.radius.empty(), !(flags & kThesisRadius));
      EXPECT_EQ(cloud.threshold.empty(), !(flags & kThesisThreshold));
      EXPECT_EQ(cloud.FindChannel("normal") != nullptr, (flags & kThesisNormal) != 0);
      EXPECT_EQ(cloud.FindChannel("uv") != nullptr, layout.main_uv() >= 0);
      EXPECT_EQ(cloud.FindChannel("normal_map") != nullptr, layout.normal_map >= 0);
      EXPECT_EQ(cloud.FindChannel("normal_map_uv") != nullptr,
                layout.uv >= 0 && layout.normal_map_uv >= 0);
      EXPECT_EQ(scene.color_texture, layout.color_texture);
      EXPECT_EQ(scene.normal_map_texture, layout.normal_map_texture);
      EXPECT_EQ(scene.surface.mode,
                flags & kThesisThreshold ? ThresholdMode::kBlended : ThresholdMode::kUniform);

      // Written and read again it is the same cloud, but for the last bit of positions.
      WriteThesisFile(binary_, ThesisOf(scene));
      const ThesisScene again = SceneOfThesis(ReadThesisFile(binary_), binary_);
      ASSERT_EQ(again.cloud.size(), cloud.size());
      EXPECT_EQ(again.cloud.threshold, cloud.threshold);
      EXPECT_EQ(again.cloud.color, cloud.color);
      EXPECT_EQ(again.color_texture, scene.color_texture);
      EXPECT_EQ(again.normal_map_texture, scene.normal_map_texture);
      EXPECT_EQ(again.surface.threshold, scene.surface.threshold);
      for (std::size_t i = 0; i < cloud.size(); ++i) {
        EXPECT_LE(Length(again.cloud.frame.WorldFromLocal(again.cloud.center[i]) -
                         cloud.frame.WorldFromLocal(cloud.center[i])),
                  2e-6 * cloud.RadiusOf(i) * cloud.frame.unit);
        EXPECT_NEAR(again.cloud.RadiusOf(i) * again.cloud.frame.unit,
                    cloud.RadiusOf(i) * cloud.frame.unit, 1e-6);
      }
      for (const Channel& channel : cloud.channels) {
        // A texture's further channel has no name of a file any more: all its values are there.
        const Channel* other = again.cloud.FindChannel(channel.name());
        ASSERT_NE(other, nullptr) << channel.name();
        for (std::size_t i = 0; i < cloud.size(); ++i) {
          for (int k = 0; k < 4; ++k) {
            EXPECT_NEAR(other->Get(i).v[k], channel.Get(i).v[k], 1e-4) << channel.name();
          }
        }
      }
    }
  }
}

TEST_F(ThesisFileTest, ValuesGoWhereTheyBelong) {
  WriteBytes(text_,
             "# one metaball with everything\n1\n63\n3\nsheet.png\nUVnormals.png\n"
             "Channel 2 find\n\n1 2 3  0.5 0.25  0 0 2  0.1 0.2  0.3 0.4  7 8\n# the end\n");
  const ThesisScene scene = SceneOfThesis(ReadThesisFile(text_), text_);
  const Cloud& cloud = scene.cloud;
  ASSERT_EQ(cloud.size(), 1u);
  EXPECT_EQ(cloud.frame.WorldFromLocal(cloud.center[0]), (Vec3d{1, 2, 3}));
  EXPECT_EQ(cloud.RadiusOf(0) * cloud.frame.unit, 0.5);
  EXPECT_EQ(cloud.threshold, std::vector<float>{0.25f});
  EXPECT_EQ(cloud.FindChannel("normal")->Get(0).v[2], 1.0f);
  EXPECT_EQ(cloud.FindChannel("uv")->Get(0).v[1], 0.2f);
  EXPECT_EQ(cloud.FindChannel("normal_map_uv")->Get(0).v[0], 0.3f);
  EXPECT_EQ(cloud.FindChannel("find")->Get(0).v[1], 8.0f);
  EXPECT_EQ(scene.color_texture, "sheet.png");
  EXPECT_EQ(scene.normal_map_texture, "normals.png");
}

TEST_F(ThesisFileTest, TheBinaryLayoutIsTheOneOfTheSpecification) {
  ThesisFile file = FileOf(kThesisCenter | kThesisThreshold | kThesisColor, {"a.png"}, 1);
  file.default_radius = 2.0f;
  file.values = {1, 2, 3, 0.5f, 0.25f, 0.75f};
  WriteThesisFile(binary_, file);
  std::string expected;
  const auto put = [&](auto value) {
    expected.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  for (const std::uint32_t v : {1u, 21u, 1u, 5u}) put(v);
  expected += "a.png";
  for (const float v : {2.0f, 1.0f, 2.0f, 3.0f, 0.5f, 0.25f, 0.75f}) put(v);
  EXPECT_EQ(Bytes(binary_), expected);
}

TEST_F(ThesisFileTest, ASurveyFarAwayKeepsItsDigits) {
  CloudInput input = testing::RandomBall(50, 0.02, 3, 3);
  for (Vec3d& p : input.center) p += Vec3d{500000.0, 4649776.0, 120.0};
  ThesisScene scene;
  scene.cloud = BuildCloud(input);
  for (const std::string& path : {text_, binary_}) {
    WriteThesisFile(path, ThesisOf(scene));
    const ThesisScene again = SceneOfThesis(ReadThesisFile(path), path);
    ASSERT_EQ(again.cloud.size(), scene.cloud.size());
    for (std::size_t i = 0; i < again.cloud.size(); ++i) {
      EXPECT_LE(Length(again.cloud.frame.WorldFromLocal(again.cloud.center[i]) -
                       scene.cloud.frame.WorldFromLocal(scene.cloud.center[i])),
                1e-6);
    }
  }
}

TEST_F(ThesisFileTest, NamesThatLookLikeWordsAreEscaped) {
  CloudInput input = testing::OneMetaball();
  ThesisScene scene;
  scene.cloud = BuildCloud(input);
  scene.cloud.channels.emplace_back("uv", ChannelType::kFloat32, 2, 1);
  for (const char* name : {"Color", "Normal", "UVmap.png", "Channel 3 x", "Origin 1 2 3"}) {
    scene.color_texture = name;
    scene.normal_map_texture = name;
    WriteThesisFile(text_, ThesisOf(scene));
    const ThesisScene again = SceneOfThesis(ReadThesisFile(text_), text_);
    EXPECT_EQ(fs::path(again.color_texture).lexically_normal(), fs::path(name));
    EXPECT_EQ(fs::path(again.normal_map_texture).lexically_normal(), fs::path(name));
    EXPECT_NE(again.cloud.FindChannel("uv"), nullptr);
    EXPECT_EQ(again.cloud.FindChannel("normal_map"), nullptr);
  }
}

TEST_F(ThesisFileTest, TruncationAtEveryByteIsAnInputError) {
  const ThesisFile file =
      FileOf(kThesisFlags & ~kThesisRadius, {"sheet.png", "UVnormals.png", "Channel 2 a"}, 3);
  WriteThesisFile(binary_, file);
  const std::string whole = Bytes(binary_);
  for (std::size_t n = 0; n < whole.size(); ++n) {
    WriteBytes(binary_, whole.substr(0, n));
    EXPECT_THROW(ReadThesisFile(binary_), InputError) << n;
  }
  WriteBytes(binary_, whole + "x");
  EXPECT_THROW(ReadThesisFile(binary_), InputError);

  WriteThesisFile(text_, file);
  const std::string lines = Bytes(text_);
  // A cut inside the last number can leave a number.
  const std::size_t last = lines.find_last_of(' ');
  for (std::size_t n = 0; n <= last; ++n) {
    WriteBytes(text_, lines.substr(0, n));
    EXPECT_THROW(ReadThesisFile(text_), InputError) << n;
  }
}

TEST_F(ThesisFileTest, AnyByteMayBeWrongWithoutACrash) {
  const ThesisFile file = FileOf(kThesisFlags, {"s.png", "UVn.png", "Origin 1 2 3"}, 2);
  for (const std::string& path : {text_, binary_}) {
    WriteThesisFile(path, file);
    const std::string whole = Bytes(path);
    int refused = 0;
    for (std::size_t n = 0; n < whole.size(); ++n) {
      for (const char flip : {'\x01', '\x10', '\x80', '\xff'}) {
        std::string bytes = whole;
        bytes[n] = static_cast<char>(bytes[n] ^ flip);
        WriteBytes(path, bytes);
        try {
          SceneOfThesis(ReadThesisFile(path), path).cloud.Validate("flipped");
        } catch (const InputError&) {
          ++refused;
        }
      }
    }
    EXPECT_GT(refused, 100);
  }
}

TEST_F(ThesisFileTest, MalformedTextIsNamedWithItsLine) {
  const std::string good = "1\n1\n0\n0.5\n0.7\n0 0 0\n";
  WriteBytes(text_, good);
  EXPECT_EQ(ReadThesisFile(text_).count, 1u);
  ExpectError(text_, "", "line 1", "ends before the number of metaballs");
  ExpectError(text_, "many\n", "line 1", "'many' is not the number of metaballs");
  ExpectError(text_, "-1\n", "line 1", "'-1'");
  ExpectError(text_, "4000000000\n1\n0\n", "line 1", "at most 2147483647");
  ExpectError(text_, "1\n64\n0\n", "line 2", "beyond 63");
  ExpectError(text_, "1\n1\n1000\n", "line 3", "do not fit");
  ExpectError(text_, "1\n17\n1\n", "line 4", "ends before name 1");
  ExpectError(text_, "1\n17\n0\n0.5\n0.7\n", "name 1", "its name is missing");
  ExpectError(text_, "1\n33\n1\nmap.png\n", "name 1", "shares texture coordinates");
  ExpectError(text_, "1\n33\n1\nUV\n", "name 1", "no file name after UV");
  ExpectError(text_, "1\n1\n1\nChannel 5 x\n", "name 1", "does not describe a channel");
  ExpectError(text_, "1\n1\n1\nChannel \n", "name 1", "does not describe a channel");
  ExpectError(text_, "1\n1\n1\nOrigin 1 2\n", "name 1", "no origin");
  ExpectError(text_, "1\n1\n1\nOrigin 1 2 nan\n", "name 1", "no origin");
  ExpectError(text_, "1\n1\n2\nOrigin 1 2 3\nOrigin 1 2 3\n", "name 2", "second one");
  ExpectError(text_, "1\n17\n1\n\n", "name 1", "is empty");
  ExpectError(text_, "1\n17\n1\na\tb\n", "name 1", "control character");
  ExpectError(text_, "1\n1\n0\n0\n0.7\n0 0 0\n", "line 4", "no default radius");
  ExpectError(text_, "1\n1\n0\n0.5\nnan\n0 0 0\n", "line 5", "no default threshold");
  ExpectError(text_, "9999\n1\n0\n0.5\n0.7\n0 0 0\n", "line 1", "do not fit");
  ExpectError(text_, "2\n1\n0\n0.5\n0.7\n0 0 0\n", "line 7", "after 1 of 2");
  ExpectError(text_, "1\n1\n0\n0.5\n0.7\n0 0\n", "line 6", "has 2 numbers, 3 are needed");
  ExpectError(text_, "1\n1\n0\n0.5\n0.7\n0 0 0 0\n", "line 6", "more numbers");
  ExpectError(text_, "1\n1\n0\n0.5\n0.7\n0 0 nan\n", "line 6", "'nan' is not finite");
  ExpectError(text_, "1\n1\n0\n0.5\n0.7\n0 0 1e99\n", "line 6", "no number a float holds");
  ExpectError(text_, "1\n1\n0\n0.5\n0.7\n0 0x 0\n", "line 6", "'0x'");
  ExpectError(text_, "1\n3\n0\n0.7\n0 0 0 -1\n", "line 5", "is no radius");
  ExpectError(text_, "1\n5\n0\n0.7\n0 0 0 0\n", "line 5", "is no threshold");
  ExpectError(text_, "1\n17\n1\nColor\n1\n1\n0 0 0 0 0 2\n", "line 7", "is no colour");
  ExpectError(text_, good + "1 1 1\n", "line 7", "more lines than metaballs");
}

TEST_F(ThesisFileTest, MalformedBinaryIsNamedWithItsByte) {
  const auto bytes = [](std::vector<std::uint32_t> words) {
    return std::string(reinterpret_cast<const char*>(words.data()), words.size() * 4);
  };
  const auto f = [](float v) { return std::bit_cast<std::uint32_t>(v); };
  WriteBytes(binary_, bytes({1, 7, 0, 0, 0, 0, f(1), f(1)}));
  EXPECT_EQ(ReadThesisFile(binary_).count, 1u);
  ExpectError(binary_, bytes({0xf0000000u, 7, 0}), "byte 0", "at most 2147483647");
  ExpectError(binary_, bytes({0x7fffffffu, 7, 0}), "byte 0", "do not fit");
  ExpectError(binary_, bytes({1, 71, 0, 0}), "byte 4", "beyond 63");
  ExpectError(binary_, bytes({1, 23, 0xffffffffu, 0}), "byte 8", "names do not fit");
  ExpectError(binary_, bytes({1, 23, 1, 0xffffffffu, 0}), "byte 12", "a name of 4294967295 bytes");
  ExpectError(binary_, bytes({1, 7, 0, 0, f(NAN), 0, f(1), f(1)}), "byte 16", "not finite");
  ExpectError(binary_, bytes({1, 7, 0, 0, 0, 0, f(-1), f(1)}), "byte 24", "is no radius");
  ExpectError(binary_, bytes({1, 7, 0, 0, 0, 0, f(1), f(0)}), "byte 28", "is no threshold");
  ExpectError(binary_, bytes({1, 5, 0, f(INFINITY), 0, 0, 0, f(1)}), "byte 12", "the default");
  ExpectError(binary_, bytes({1, 7, 0}), "byte 0", "do not fit");
}

TEST_F(ThesisFileTest, WhatNoReaderWouldTakeIsNotWritten) {
  const ThesisFile good = FileOf(kThesisCenter | kThesisRadius, {});
  for (const std::string& path : {text_, binary_}) {
    ThesisFile file = good;
    file.values[3] = -1.0f;
    EXPECT_THROW(WriteThesisFile(path, file), InputError);
    file = good;
    file.values[4] = NAN;
    EXPECT_THROW(WriteThesisFile(path, file), InputError);
    file = good;
    file.values.pop_back();
    EXPECT_THROW(WriteThesisFile(path, file), InputError);
    file = good;
    file.default_threshold = 0;
    EXPECT_THROW(WriteThesisFile(path, file), InputError);
    file = good;
    file.names = {"Channel 1 a\nb"};
    EXPECT_THROW(WriteThesisFile(path, file), InputError);
    EXPECT_FALSE(fs::exists(path));
  }
  EXPECT_THROW(WriteThesisFile((folder_ / "cloud.txt").string(), good), InputError);
  EXPECT_THROW(ReadThesisFile((folder_ / "cloud.txt").string()), InputError);
  EXPECT_THROW(ReadThesisFile(text_), InputError);
  EXPECT_THROW(WriteThesisFile((folder_ / "no" / "cloud.mbb").string(), good), OutputError);
  EXPECT_TRUE(fs::is_empty(folder_));
}

}  // namespace
}  // namespace sherd
