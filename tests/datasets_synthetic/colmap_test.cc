// COLMAP itself on photographs of the generator: it finds features, matches them, and finds the
// cameras; Sherd imports what it wrote, and the truth is there to compare with.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/project/colmap_run.h"
#include "datasets_synthetic/excavation.h"
#include "reconstruction/workspace.h"
#include "tests/datasets_synthetic/colmap_reader.h"

namespace sherd {
namespace {
namespace fs = std::filesystem;

constexpr int kPhotographs = 9;

TEST(Colmap, ReconstructsTheSyntheticExcavation) {
  if (!test::HaveColmap()) GTEST_SKIP() << "colmap is not installed";
  const std::string folder = testing::TempDir() + "sherd_excavation_colmap";
  fs::remove_all(folder);
  ExcavationOptions o;
  o.photographs = kPhotographs;
  o.photo_width = 800;
  o.photo_height = 600;
  o.write_dense = false;
  WriteExcavation(folder, o);

  ReconstructOptions reconstruct;
  reconstruct.photos = folder + "/images";
  reconstruct.workspace = folder + "/ws";
  reconstruct.camera_model = "OPENCV";
  reconstruct.single_camera = true;
  reconstruct.threads = 2;
  reconstruct.dense = false;
  Control control;
  double furthest = 0;
  int reports = 0;
  control.progress = [&](std::string_view, double fraction) {
    EXPECT_GE(fraction, furthest - 1e-12) << "progress goes on";
    furthest = std::max(furthest, fraction);
    ++reports;
  };
  const ReconstructResult result = Reconstruct(reconstruct, control);
  EXPECT_EQ(furthest, 1);
  EXPECT_GT(reports, 3 * kPhotographs) << "COLMAP's lines are understood";
  ASSERT_TRUE(fs::exists(folder + "/ws/sparse/0/images.bin")) << test::ReadAll(result.log);
  EXPECT_TRUE(fs::exists(folder + "/ws/dense/sparse/images.bin"));
  for (const ReconstructStage& stage : Reconstruct(reconstruct).stages) {
    EXPECT_TRUE(stage.skipped) << stage.name;
  }

  // The import, as the program does it.
  const Workspace workspace = InspectWorkspace(folder + "/ws");
  ASSERT_FALSE(workspace.models.empty());
  LoadOptions load;
  load.photo_folder = reconstruct.photos;
  const Survey survey = LoadSurvey(workspace, load);
  EXPECT_GE(survey.photographs.size(), kPhotographs * 8u / 10);
  EXPECT_GT(survey.points.size(), 500u);
  for (const Photograph& p : survey.photographs) EXPECT_FALSE(p.path.empty()) << p.name;

  // The cameras' positions are the true ones but for a similarity: distances between them are all
  // scaled alike.
  const nlohmann::json truth = nlohmann::json::parse(test::ReadAll(folder + "/truth/poses.json"));
  std::map<std::string, Vec3d> centers;
  for (const auto& p : truth["photographs"]) {
    centers[p["name"]] = {p["center"][0], p["center"][1], p["center"][2]};
  }
  std::vector<double> ratios;
  for (const Photograph& a : survey.photographs) {
    for (const Photograph& b : survey.photographs) {
      if (a.name >= b.name) continue;
      ratios.push_back(Length(centers.at(a.name) - centers.at(b.name)) /
                       Length(a.cam_from_world.Center() - b.cam_from_world.Center()));
    }
  }
  double mean = 0, spread = 0;
  for (const double r : ratios) mean += r / static_cast<double>(ratios.size());
  for (const double r : ratios) spread = std::max(spread, std::abs(r / mean - 1));
  EXPECT_LT(spread, 0.05);
  std::printf("%zu of %d photographs registered, %zu points, distances within %.2f %%\n",
              survey.photographs.size(), kPhotographs, survey.points.size(), 100 * spread);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace sherd
