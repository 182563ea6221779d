// How WriteExcavation behaves: options, folders, cancelling, threads; and the dense cloud's noise.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <stop_token>

#include "datasets_synthetic/excavation.h"
#include "datasets_synthetic/survey_points.h"
#include "metaball/error.h"
#include "tests/datasets_synthetic/colmap_reader.h"

namespace sherd {
namespace {
namespace fs = std::filesystem;

ExcavationOptions Small() {
  ExcavationOptions o;
  o.photographs = 4;
  o.photo_width = 160;
  o.photo_height = 112;
  o.dense_points = 3000;
  o.noise_m = 0.002;
  o.outlier_share = 0.02;
  o.sparse_points = 300;
  o.depth_map_max_side = 64;
  return o;
}

std::string Folder(const std::string& name) {
  const std::string folder = testing::TempDir() + "sherd_excavation_writing/" + name;
  fs::remove_all(folder);
  fs::create_directories(fs::path(folder).parent_path());
  return folder;
}

std::map<std::string, std::string> Files(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      files[fs::relative(entry.path(), folder).string()] = test::ReadAll(entry.path().string());
    }
  }
  return files;
}

// Entries beside the folder whose names begin with its name.
int Siblings(const std::string& folder) {
  int count = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(folder).parent_path())) {
    count += entry.path().filename().string().starts_with(fs::path(folder).filename().string());
  }
  return count;
}

std::string MessageOf(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Writing, TheSameBytesForAnyNumberOfThreadsAndInPlaceOfAnOlderOne) {
  ExcavationOptions o = Small();
  const std::string one = Folder("one"), two = Folder("two");
  o.threads = 1;
  WriteExcavation(one, o);
  o.threads = 2;
  WriteExcavation(two, o);
  const auto a = Files(one), b = Files(two);
  ASSERT_GT(a.size(), 25u);
  ASSERT_EQ(a.size(), b.size());
  for (const auto& [name, bytes] : a) {
    ASSERT_TRUE(b.contains(name)) << name;
    EXPECT_TRUE(bytes == b.at(name)) << name << " differs";
  }
  // Another seed in the same place: replaced as a whole, nothing beside it.
  o.seed = 9;
  o.write_dense = false;
  WriteExcavation(two, o);
  EXPECT_FALSE(fs::exists(two + "/dense"));
  EXPECT_NE(Files(two).at("sparse/0/points3D.bin"), a.at("sparse/0/points3D.bin"));
  EXPECT_EQ(Siblings(two), 1);
  fs::remove_all(one);
  fs::remove_all(two);
}

TEST(Writing, RefusesAFolderOfSomethingElse) {
  const std::string folder = Folder("mine");
  fs::create_directories(folder);
  std::ofstream(folder + "/thesis.txt") << "years of work";
  EXPECT_THROW(WriteExcavation(folder, Small()), OutputError);
  EXPECT_EQ(test::ReadAll(folder + "/thesis.txt"), "years of work");
  EXPECT_EQ(Siblings(folder), 1);
  // A file in the place of the folder.
  EXPECT_THROW(WriteExcavation(folder + "/thesis.txt", Small()), OutputError);
  fs::remove_all(folder);
}

TEST(Writing, UnwritablePlaceIsNamed) {
  const std::string message = MessageOf([] { WriteExcavation("/proc/sherd_excavation", Small()); });
  EXPECT_NE(message.find("/proc/sherd_excavation"), std::string::npos) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos);
}

TEST(Writing, OptionsOutOfRangeAreNamed) {
  const auto message = [](const std::function<void(ExcavationOptions*)>& change) {
    ExcavationOptions o = Small();
    change(&o);
    return MessageOf([&] { WriteExcavation(Folder("options"), o); });
  };
  using Options = ExcavationOptions;
  EXPECT_NE(message([](Options* o) { o->photographs = 2; }).find("photographs"), std::string::npos);
  EXPECT_NE(message([](Options* o) { o->photo_width = 0; }).find("pixels"), std::string::npos);
  EXPECT_NE(message([](Options* o) { o->noise_m = NAN; }).find("noise"), std::string::npos);
  EXPECT_NE(message([](Options* o) { o->noise_m = -1; }).find("noise"), std::string::npos);
  EXPECT_NE(message([](Options* o) { o->outlier_share = 1; }).find("outliers"), std::string::npos);
  EXPECT_NE(message([](Options* o) { o->dense_points = ~0ull; }).find("dense points"),
            std::string::npos);
  EXPECT_NE(message([](Options* o) { o->keypoint_noise_px = INFINITY; }).find("keypoints"),
            std::string::npos);
  EXPECT_EQ(Siblings(Folder("options")), 0);
}

TEST(Writing, CancelledLeavesNothing) {
  const std::string folder = Folder("cancelled");
  // In the light, and among the photographs.
  for (const std::string stage : {"light", "photographs"}) {
    std::stop_source stop;
    Control control;
    control.stop = stop.get_token();
    bool reached = false;
    control.progress = [&](std::string_view what, double fraction) {
      EXPECT_GE(fraction, 0);
      EXPECT_LE(fraction, 1);
      if (what == stage) {
        reached = true;
        stop.request_stop();
      }
    };
    EXPECT_THROW(WriteExcavation(folder, Small(), control), Cancelled);
    EXPECT_TRUE(reached);
    EXPECT_EQ(Siblings(folder), 0);
  }
}

TEST(DenseCloud, NoiseOutliersAndHalfPixelAreAsAsked) {
  const synthetic::TrenchScene scene(1);
  ExcavationOptions o;
  o.photographs = 6;
  o.photo_width = 400;
  o.photo_height = 300;
  o.depth_map_max_side = 100;
  o.dense_points = 8000;
  o.noise_m = 0.003;
  o.outlier_share = 0.1;
  const synthetic::ShotPlan plan = synthetic::PlanShots(o);
  std::vector<synthetic::Lens> pinholes;
  for (const synthetic::Lens& lens : plan.lenses) pinholes.push_back(UndistortedLens(lens));
  const std::vector<std::size_t> order{3, 0, 5, 1, 4, 2};
  const auto cloud = [&] { return MakeDenseCloud(scene, plan, pinholes, order, o, {}); };
  const auto distance = [&](const synthetic::FusedPoint& p) {
    return scene.bvh().Distance(p.position.cast<double>());
  };

  // About 800 of 8000 lie far off; the others at about the noise (|N(0, s)| has the mean 0.8 s;
  // rough ground is a little nearer).
  std::size_t far = 0;
  double sum = 0;
  const auto noisy = cloud();
  ASSERT_EQ(noisy.size(), 8000u);
  for (const auto& p : noisy) {
    const double d = distance(p);
    if (d > 6 * o.noise_m) {
      ++far;
    } else {
      sum += d;
    }
  }
  EXPECT_GT(far, 720u);
  EXPECT_LE(far, 800u);
  EXPECT_NEAR(sum / static_cast<double>(noisy.size() - far), 0.8 * o.noise_m, 0.2 * o.noise_m);

  // Without noise: on the surface; with COLMAP's half pixel: beside it, by the same vector in the
  // depth map of the photograph each point comes from.
  o.noise_m = 0;
  o.outlier_share = 0;
  const auto clean = cloud();
  o.colmap_half_pixel = true;
  const auto shifted = cloud();
  ASSERT_EQ(clean.size(), shifted.size());
  for (std::size_t i = 0; i < clean.size(); ++i) {
    EXPECT_LT(distance(clean[i]), 5e-7);
    ASSERT_EQ(clean[i].image_idx, shifted[i].image_idx);
    // Half a depth-map pixel in one of the photographs that see it.
    bool explained = false;
    for (const std::uint32_t idx : clean[i].image_idx) {
      const synthetic::Shot& shot = plan.shots[order[idx]];
      const synthetic::Lens map = synthetic::DepthMapCamera(pinholes[shot.lens_idx], 100);
      const Vec3d a = shot.ToCamera(clean[i].position.cast<double>());
      const Vec3d b = shot.ToCamera(shifted[i].position.cast<double>());
      const double dx = map.fx * (b.x / b.z - a.x / a.z), dy = map.fy * (b.y / b.z - a.y / a.z);
      explained |=
          std::abs(dx + 0.5) < 1e-3 && std::abs(dy + 0.5) < 1e-3 && std::abs(a.z - b.z) < 1e-5;
    }
    EXPECT_TRUE(explained) << "point " << i;
  }
}

}  // namespace
}  // namespace sherd
