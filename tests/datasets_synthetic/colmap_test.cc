// COLMAP itself on photographs of the generator: it finds features, matches them, and finds the
// cameras; Sherd imports what it wrote, and the truth is there to compare with.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

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
  // What COLMAP makes goes beside the truth, as in a surveyor's folder.
  fs::rename(folder + "/sparse", folder + "/sparse_truth");
  fs::create_directories(folder + "/sparse");
  fs::remove_all(folder + "/sparse_txt");

  const std::string log = folder + "/colmap.log";
  const auto colmap = [&](const std::string& arguments) {
    const std::string command = "cd " + folder + " && QT_QPA_PLATFORM=offscreen colmap " +
                                arguments + " >> colmap.log 2>&1";
    ASSERT_EQ(std::system(command.c_str()), 0) << command << "\n" << test::ReadAll(log);
  };
  ASSERT_NO_FATAL_FAILURE(
      colmap("feature_extractor --database_path database.db --image_path images "
             "--ImageReader.camera_model OPENCV --SiftExtraction.use_gpu 0 "
             "--SiftExtraction.num_threads 2 --SiftExtraction.max_num_features 3000"));
  ASSERT_NO_FATAL_FAILURE(
      colmap("exhaustive_matcher --database_path database.db --SiftMatching.use_gpu 0 "
             "--SiftMatching.num_threads 2"));
  ASSERT_NO_FATAL_FAILURE(
      colmap("mapper --database_path database.db --image_path images --output_path sparse "
             "--Mapper.num_threads 2 --Mapper.multiple_models 0 --Mapper.min_model_size 3 "
             "--Mapper.ba_global_max_num_iterations 25"));
  ASSERT_TRUE(fs::exists(folder + "/sparse/0/images.bin")) << test::ReadAll(log);

  // The import, as the program does it.
  const Workspace workspace = InspectWorkspace(folder + "/sparse/0");
  ASSERT_FALSE(workspace.models.empty());
  const Survey survey = LoadSurvey(workspace, {});
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
