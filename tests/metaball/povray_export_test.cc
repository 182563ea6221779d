#include "metaball/povray_export.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "datasets_synthetic/peer_scenes.h"
#include "metaball/error.h"
#include "metaball/renderer.h"
#include "test_scenes.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class PovRayTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              (std::string("sherd_povray_") +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    path_ = (folder_ / "scene.pov").string();
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string Text() const {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  // POV-Ray's picture of path_, linear 8-bit RGB.
  std::vector<unsigned char> PovRayPicture(int width, int height) {
    const std::string picture = (folder_ / "picture.ppm").string();
    const std::string command = "povray '+I" + path_ + "' '+O" + picture + "' +W" +
                                std::to_string(width) + " +H" + std::to_string(height) +
                                " +WT2 -A -D +FP File_Gamma=1.0 >/dev/null 2>'" +
                                (folder_ / "log").string() + "'";
    if (std::system(command.c_str()) != 0) {
      std::ifstream log(folder_ / "log");
      ADD_FAILURE() << std::string(std::istreambuf_iterator<char>(log), {});
      return {};
    }
    std::ifstream in(picture, std::ios::binary);
    std::string magic;
    int w = 0, h = 0, maximum = 0;
    in >> magic >> std::ws;
    while (in.peek() == '#') {
      std::getline(in, magic);
      in >> std::ws;
    }
    in >> w >> h >> maximum;
    in.get();
    EXPECT_EQ(w, width);
    EXPECT_EQ(h, height);
    std::vector<unsigned char> rgb(static_cast<std::size_t>(width) * height * 3);
    in.read(reinterpret_cast<char*>(rgb.data()), static_cast<std::streamsize>(rgb.size()));
    EXPECT_TRUE(in);
    return rgb;
  }

  // Exports, renders with both programs and compares: `most_off` of the pixels may differ by more
  // than 3 of 255.
  void ExpectTheSamePicture(const Scene& scene, const Camera& camera, std::size_t most_off) {
    WritePovRay(path_, scene, camera);
    const auto theirs = PovRayPicture(camera.width, camera.height);
    ASSERT_FALSE(theirs.empty());
    const Frame ours = MakeCpuRenderer()->Render(scene, camera, {});
    // There is something to see, and something beside it.
    EXPECT_GT(ours.stats.hits, ours.color.size() / 10);
    EXPECT_LT(ours.stats.hits, ours.color.size());
    std::size_t off = 0;
    for (std::size_t i = 0; i < ours.color.size(); ++i) {
      const float expected[3] = {ours.color[i].r, ours.color[i].g, ours.color[i].b};
      bool differs = false;
      for (int c = 0; c < 3; ++c) {
        differs |= std::abs(theirs[3 * i + c] - 255 * std::min(1.0f, expected[c])) > 3.5f;
      }
      off += differs;
    }
    EXPECT_LE(off, most_off) << "of " << ours.color.size();
  }

  static bool HasPovRay() { return std::system("command -v povray >/dev/null 2>&1") == 0; }

  fs::path folder_;
  std::string path_;
};

Scene BallOfBalls(const Vec3d& center = {}) {
  CloudInput input = testing::RandomBall(300, 0.35, 3, 11);
  for (Vec3d& p : input.center) p += center;
  Scene scene = testing::SceneOf(input, 0.5);
  scene.lighting.headlight = false;
  return scene;
}

constexpr const char* kNoPovRay = "povray is not installed";

TEST_F(PovRayTest, ThePeerScenesAreTheSamePicture) {
  if (!HasPovRay()) GTEST_SKIP() << kNoPovRay;
  for (const PeerScene& peer : {MakeShell(2000, 160, 90), MakeHeightField(2000, 160, 90)}) {
    ExpectTheSamePicture(peer.scene, peer.camera, 5);
  }
}

TEST_F(PovRayTest, EveryCameraAndLightIsTheSamePicture) {
  if (!HasPovRay()) GTEST_SKIP() << kNoPovRay;
  Scene scene = BallOfBalls();
  const Camera front = testing::FrontCamera(160, 90);
  ExpectTheSamePicture(scene, front, 5);
  // A principal point off the middle and pixels that are not square.
  Camera skewed = front;
  skewed.cx += 25;
  skewed.cy -= 8;
  skewed.fy *= 1.3;
  ExpectTheSamePicture(scene, skewed, 5);
  ExpectTheSamePicture(scene, front.Cropped(30, 10, 100, 60), 5);
  const Camera orthographic =
      Camera::LookAtOrthographic({1, 2, -4}, {0.2, 0, 0}, {0, 1, 0}, 3.5, 160, 90);
  ExpectTheSamePicture(scene, orthographic, 5);
  scene.lighting.headlight = true;
  ExpectTheSamePicture(scene, front, 5);
  ExpectTheSamePicture(scene, orthographic, 5);
  scene.lighting.unlit = true;
  ExpectTheSamePicture(scene, front, 5);
  scene.surface.radius_scale = 0.8;
  ExpectTheSamePicture(scene, front, 5);
}

TEST_F(PovRayTest, ASurveyFarAwayIsTheSamePicture) {
  if (!HasPovRay()) GTEST_SKIP() << kNoPovRay;
  const Vec3d far{500000, 4649776, 120};
  Camera camera = testing::FrontCamera(160, 90);
  camera.eye += far;
  ExpectTheSamePicture(BallOfBalls(far), camera, 5);
  EXPECT_THAT(Text(), HasSubstr("relative to <"));
}

TEST_F(PovRayTest, OtherNamesOfMurakamiAreWritten) {
  Scene scene = BallOfBalls();
  const Camera camera = testing::FrontCamera();
  WritePovRay(path_, scene, camera);
  const std::string murakami = Text();
  EXPECT_THAT(murakami, HasSubstr("blob { threshold 0.5\n"));
  EXPECT_THAT(murakami, HasSubstr("sphere { <"));
  for (const char* same : {"power:2", "ramp:4"}) {
    scene.surface.density = ParseDensity(same);
    WritePovRay(path_, scene, camera);
    EXPECT_EQ(Text(), murakami) << same;
  }
  // Equal thresholds blended are one threshold.
  auto cloud = std::make_shared<Cloud>(*scene.cloud);
  cloud->threshold.assign(cloud->size(), 0.5f);
  scene.cloud = cloud;
  scene.surface.threshold = 0.1;
  scene.surface.mode = ThresholdMode::kBlended;
  WritePovRay(path_, scene, camera);
  EXPECT_EQ(Text(), murakami);
}

TEST_F(PovRayTest, WhatNoBlobHasIsRefusedWithAWayOut) {
  Scene scene = BallOfBalls();
  const Camera camera = testing::FrontCamera();
  const auto expect_refused = [&](const std::string& what) {
    try {
      WritePovRay(path_, scene, camera);
      ADD_FAILURE() << what;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr(what));
      EXPECT_THAT(error.what(), HasSubstr(".ply"));
    }
    EXPECT_TRUE(fs::is_empty(folder_));
  };
  scene.surface.density = ParseDensity("wyvill");
  expect_refused("wyvill");
  scene.surface.density = ParseDensity("power:3");
  expect_refused("power:3");
  scene.surface.density = {};
  scene.surface.mode = ThresholdMode::kGated;
  expect_refused("thresholds");
  scene.surface.mode = ThresholdMode::kSummed;
  expect_refused("thresholds");
  auto cloud = std::make_shared<Cloud>(*scene.cloud);
  cloud->threshold.assign(cloud->size(), 0.5f);
  cloud->threshold[7] = 0.6f;
  scene.cloud = cloud;
  scene.surface.mode = ThresholdMode::kBlended;
  expect_refused("thresholds");
}

TEST_F(PovRayTest, AnEmptyCloudIsASceneWithoutABlob) {
  Scene scene;
  scene.cloud = std::make_shared<Cloud>();
  WritePovRay(path_, scene, testing::FrontCamera());
  EXPECT_THAT(Text(), Not(HasSubstr("blob")));
  if (HasPovRay()) {
    const auto picture = PovRayPicture(32, 18);
    EXPECT_EQ(std::count(picture.begin(), picture.end(), 0), 32 * 18 * 3);
  }
}

}  // namespace
}  // namespace sherd
