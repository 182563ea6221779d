// Real surveys, where they are: beside the checkout in shared/datasets.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <tuple>

#include "metaball/error.h"
#include "reconstruction/geometric_visibility.h"
#include "reconstruction/level.h"
#include "reconstruction/photographs.h"
#include "reconstruction/workspace.h"

namespace sherd {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

std::string Dataset(const std::string& name) {
  return std::string(SHERD_SOURCE_DIR) + "/../shared/datasets/" + name;
}

#define SKIP_WITHOUT(name)                                                \
  if (!std::filesystem::exists(Dataset(name))) {                          \
    GTEST_SKIP() << Dataset(name) << " is not there: this test needs it"; \
  }

std::size_t Found(const Survey& s) {
  return static_cast<std::size_t>(
      std::count_if(s.photographs.begin(), s.photographs.end(),
                    [](const Photograph& p) { return !p.path.empty(); }));
}

Survey Load(const std::string& name, PointSource source = PointSource::kAuto,
            const std::string& photos = "") {
  LoadOptions options;
  options.source = source;
  options.photo_folder = photos;
  return LoadSurvey(InspectWorkspace(Dataset(name)), options);
}

TEST(Datasets, AlexanderSparse) {
  SKIP_WITHOUT("alexander");
  const Survey s = Load("alexander", PointSource::kSparse);
  EXPECT_EQ(s.points.size(), 8727u);
  EXPECT_EQ(s.photographs.size(), 52u);
  EXPECT_EQ(Found(s), 26u);
  EXPECT_THAT(s.warnings, Contains(HasSubstr("26 of 52 photographs were not found")));
  EXPECT_EQ(s.dense_pixel_offset, 0);
  // The model says of itself: 1.18 px.
  double error = 0;
  for (const float e : s.points.error) error += e;
  EXPECT_NEAR(error / 8727, 1.18, 0.02);
  ASSERT_TRUE(s.up);
  EXPECT_LT(s.up->y, -0.95);
}

TEST(Datasets, AlexanderDense) {
  SKIP_WITHOUT("alexander");
  const Survey s = Load("alexander");
  EXPECT_TRUE(s.dense);
  EXPECT_EQ(s.points.size(), 440996u);
  EXPECT_EQ(s.points.normal.size(), 440996u);
  EXPECT_EQ(s.points.photo_begin.size(), 440997u);
  EXPECT_EQ(Found(s), 52u) << "the undistorted ones";
  const auto originals =
      std::count_if(s.photographs.begin(), s.photographs.end(),
                    [](const Photograph& p) { return !p.original_path.empty(); });
  EXPECT_EQ(originals, 26);
  for (const Photograph& p : s.photographs) {
    EXPECT_EQ(s.cameras[p.camera_idx].model, CameraModelId::kPinhole);
    if (p.original_path.empty()) continue;
    EXPECT_EQ(s.cameras[p.original_camera_idx].model, CameraModelId::kSimpleRadial);
    EXPECT_EQ(ReadPhotoSize(p.original_path).width, 3376);
  }
  EXPECT_EQ(s.dense_pixel_offset, 0.5);

  const PreparedPoints p = PreparePoints(s, true);
  // A tenth of the points hangs along outlines, in front of what other photographs see.
  EXPECT_GT(p.outliers, 35000u);
  EXPECT_LT(p.outliers, 50000u);
  LevelOptions options;
  options.target_count = 63000;
  const Level level = BuildLevel(p, s, options);
  EXPECT_EQ(level.cloud.size(), 63000u);
  EXPECT_LT(level.stats.open_share, 0.01);
  EXPECT_GT(level.photo_idx.size(), 2u * 63000);
}

TEST(Datasets, SceauxBinaryAndTextAreTheSame) {
  SKIP_WITHOUT("sceaux");
  const Survey b = Load("sceaux/sparse/0"), t = Load("sceaux/sparse_txt");
  EXPECT_EQ(b.points.size(), 5338u);
  EXPECT_EQ(b.photographs.size(), 11u);
  EXPECT_EQ(Found(b), 11u);
  // The text has the points in another order (that of a hash table).
  using Record = std::tuple<double, double, double, int, int, int, float, std::set<std::uint32_t>>;
  const auto records = [](const Survey& s) {
    std::multiset<Record> all;
    for (std::size_t i = 0; i < s.points.size(); ++i) {
      const Vec3d& p = s.points.position[i];
      const Rgb8 c = s.points.color[i];
      all.insert({p.x,
                  p.y,
                  p.z,
                  c.r,
                  c.g,
                  c.b,
                  s.points.error[i],
                  {s.points.photo_idx.begin() + s.points.photo_begin[i],
                   s.points.photo_idx.begin() + s.points.photo_begin[i + 1]}});
    }
    return all;
  };
  EXPECT_TRUE(records(b) == records(t));
  ASSERT_EQ(b.cameras.size(), t.cameras.size());
  EXPECT_EQ(b.cameras[0].parameters, t.cameras[0].parameters);
  for (std::size_t i = 0; i < 11; ++i) {
    EXPECT_EQ(b.photographs[i].name, t.photographs[i].name);
    EXPECT_EQ(b.photographs[i].cam_from_world.translation,
              t.photographs[i].cam_from_world.translation);
    EXPECT_EQ(b.photographs[i].path, t.photographs[i].path);
  }
}

TEST(Datasets, SceauxDense) {
  SKIP_WITHOUT("sceaux");
  const Survey s = Load("sceaux/dense");
  EXPECT_TRUE(s.dense);
  EXPECT_EQ(s.points.size(), 258724u);
  EXPECT_EQ(s.points.photo_begin.size(), 258725u);
  EXPECT_EQ(Found(s), 11u);
  EXPECT_TRUE(s.warnings.empty());
  const Survey mesh = Load("sceaux/dense/meshed-poisson.ply");
  EXPECT_EQ(mesh.points.size(), 161884u);
}

// Every projection of a point into a photograph that sees it lies where the model's own error says.
TEST(Datasets, PointsProjectIntoThePhotographsThatSeeThem) {
  SKIP_WITHOUT("sceaux");
  for (const char* name : {"sceaux/sparse/0", "alexander/sparse/0"}) {
    const Survey s = Load(name);
    std::uint64_t inside = 0, total = 0;
    for (std::size_t i = 0; i < s.points.size(); ++i) {
      for (std::uint64_t j = s.points.photo_begin[i]; j < s.points.photo_begin[i + 1]; ++j) {
        const Photograph& photo = s.photographs[s.points.photo_idx[j]];
        const SurveyCamera& camera = s.cameras[photo.camera_idx];
        const auto p = camera.Project(photo.cam_from_world.Apply(s.points.position[i]));
        ++total;
        inside += p && p->first > -5 && p->second > -5 && p->first < camera.width + 5.0 &&
                  p->second < camera.height + 5.0;
      }
    }
    EXPECT_EQ(inside, total) << name;
  }
}

// What hides what, found from the points alone, against what COLMAP's fusion noted. The fusion
// names the photographs whose depth maps agreed, a part of those that see a point.
TEST(Datasets, PhotographsFoundByGeometryAreThoseOfTheFusion) {
  SKIP_WITHOUT("alexander");
  for (const char* name : {"alexander", "sceaux"}) {
    const Survey known = Load(std::string(name) + "/dense/fused.ply");
    Survey found = known;
    found.points.photo_begin.clear();
    found.points.photo_idx.clear();
    VisibilityOptions options;
    options.most_photographs = 100;
    FindVisibility(options, &found);
    std::uint64_t listed = 0, again = 0, all = 0;
    for (std::size_t i = 0; i < known.points.size(); ++i) {
      const auto list = [&](const Survey& s) {
        return std::set<std::uint32_t>(s.points.photo_idx.begin() + s.points.photo_begin[i],
                                       s.points.photo_idx.begin() + s.points.photo_begin[i + 1]);
      };
      const auto a = list(known), b = list(found);
      listed += a.size();
      all += b.size();
      for (const std::uint32_t photo : a) again += b.contains(photo);
    }
    std::printf("%s: %.1f %% of the fusion's photographs found again, %.2f times as many found\n",
                name, 100.0 * static_cast<double>(again) / static_cast<double>(listed),
                static_cast<double>(all) / static_cast<double>(listed));
    EXPECT_GT(again, 0.9 * static_cast<double>(listed)) << name;
  }
}

// The only map of 52, and of 11: points of the fused cloud that this photograph is said to see have
// the depth the map's points have at their pixel.
TEST(Datasets, ADepthMapsPointsAreThoseOfTheFusedCloud) {
  SKIP_WITHOUT("alexander");
  for (const char* name : {"alexander", "sceaux"}) {
    const Survey fused = Load(std::string(name) + "/dense/fused.ply");
    const Survey maps = Load(name, PointSource::kDepthMaps);
    ASSERT_GT(maps.points.size(), 10000u) << name;
    const std::uint32_t photo = maps.points.photo_idx[0];
    const Photograph& p = maps.photographs[photo];
    const SurveyCamera& camera = maps.cameras[p.camera_idx];
    const auto pixel_of = [&](const Vec3d& q, double offset) -> std::int64_t {
      const auto at = camera.Project(q);
      if (!at) return -1;
      const double x = at->first + offset, y = at->second + offset;
      if (x < 0 || y < 0 || x >= double(camera.width) || y >= double(camera.height)) return -1;
      return std::int64_t(y) * std::int64_t(camera.width) + std::int64_t(x);
    };
    std::map<std::int64_t, double> depth;  // the maps are as large as the photographs
    for (const Vec3d& world : maps.points.position) {
      const Vec3d q = p.cam_from_world.Apply(world);
      depth[pixel_of(q, 0)] = q.z;
    }
    EXPECT_EQ(depth.size(), maps.points.size()) << "one point a pixel";
    std::size_t listed = 0, agree = 0;
    for (std::size_t i = 0; i < fused.points.size(); ++i) {
      const auto* begin = fused.points.photo_idx.data() + fused.points.photo_begin[i];
      const auto* end = fused.points.photo_idx.data() + fused.points.photo_begin[i + 1];
      if (std::find(begin, end, photo) == end) continue;
      ++listed;
      const Vec3d q = p.cam_from_world.Apply(fused.points.position[i]);
      const auto at = depth.find(pixel_of(q, fused.dense_pixel_offset));
      agree += at != depth.end() && std::abs(at->second - q.z) < 0.01 * q.z;
    }
    std::printf(
        "%s: %zu points of a map; %zu points of the fused cloud in it, %.1f %% within 1 %%\n", name,
        maps.points.size(), listed,
        100.0 * static_cast<double>(agree) / static_cast<double>(listed));
    EXPECT_GT(listed, 1000u) << name;
    EXPECT_GT(agree, 0.9 * static_cast<double>(listed)) << name;
  }
}

TEST(Datasets, ImportVariants) {
  SKIP_WITHOUT("sceaux_import_variants");
  const std::string base = "sceaux_import_variants/colmap_example_model_";
  const std::string photos = Dataset("sceaux/images");
  struct Variant {
    const char* name;
    std::size_t cameras, photographs, points;
  };
  for (const Variant& v : {Variant{"bin", 1, 11, 7862}, Variant{"not_shared_txt", 11, 11, 8024},
                           Variant{"txt_missing_cams_and_subfolders", 1, 9, 6319}}) {
    const Survey s = Load(base + v.name, PointSource::kAuto, photos);
    EXPECT_EQ(s.cameras.size(), v.cameras) << v.name;
    EXPECT_EQ(s.photographs.size(), v.photographs) << v.name;
    EXPECT_EQ(s.points.size(), v.points) << v.name;
    EXPECT_EQ(Found(s), v.photographs) << v.name;
    EXPECT_TRUE(s.warnings.empty()) << v.name << ": " << s.warnings.front();
    const Survey alone = Load(base + v.name);
    EXPECT_EQ(Found(alone), 0u);
    EXPECT_EQ(alone.warnings.size(), 1u);
    LevelOptions options;
    options.target_count = 5000;
    EXPECT_EQ(BuildLevel(PreparePoints(s, true), s, options).cloud.size(), 5000u);
  }
}

}  // namespace
}  // namespace sherd
