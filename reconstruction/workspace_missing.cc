#include "reconstruction/workspace_missing.h"

#include <algorithm>

namespace sherd {

std::vector<std::string> WhatIsMissing(const Workspace& workspace) {
  std::vector<std::string> missing;
  const auto readable = [](const auto& item) { return item.problem.empty(); };
  const auto model = std::find_if(workspace.models.begin(), workspace.models.end(), readable);
  const auto cloud = std::find_if(workspace.clouds.begin(), workspace.clouds.end(), readable);
  if (workspace.models.empty()) {
    missing.push_back(
        "No sparse model (cameras, images, points3D): where the photographs were taken is not "
        "known, so no view through a photograph and no colours from photographs.");
  }
  for (const SparseModelFiles& m : workspace.models) {
    if (!m.problem.empty()) missing.push_back(m.problem);
  }
  const auto maps =
      std::find_if(workspace.map_sets.begin(), workspace.map_sets.end(),
                   [&](const DepthMapSet& set) { return CoverModel(workspace, set); });
  if (workspace.clouds.empty() && maps != workspace.map_sets.end()) {
    missing.push_back("No dense cloud (dense/fused.ply): the points are made from the " +
                      std::to_string(maps->depth_maps) + " depth maps.");
  } else if (workspace.clouds.empty()) {
    missing.push_back(
        "No dense cloud (dense/fused.ply): the surface is made from the sparse model's few points. "
        "For a detailed one run COLMAP's image_undistorter, patch_match_stereo and stereo_fusion.");
  }
  for (const DenseCloudFile& c : workspace.clouds) {
    if (!c.problem.empty()) missing.push_back(c.problem);
  }
  if (cloud != workspace.clouds.end()) {
    if (model != workspace.models.end() && cloud->visibility_path.empty()) {
      missing.push_back("No " + cloud->path +
                        ".vis: which photographs see a point is found by what hides what.");
    }
    if (model != workspace.models.end() && !cloud->model_idx) {
      missing.push_back(cloud->path +
                        ": no model of the same workspace (sparse/ beside the cloud): its "
                        "photographs are not known.");
    }
    if (!cloud->colors && !cloud->mesh) {
      missing.push_back(cloud->path + ": the points have no colours; the surface will be grey.");
    }
  }
  if (model != workspace.models.end()) {
    // The photographs of the undistorted model are copies: they count only for that.
    std::uint64_t files = 0, undistorted = 0;
    for (const PhotoFolder& folder : workspace.photo_folders) {
      const bool copy = std::any_of(
          workspace.models.begin(), workspace.models.end(), [&](const SparseModelFiles& m) {
            // dense/sparse and dense/images
            return m.dense_workspace &&
                   folder.path.starts_with(m.folder.substr(0, m.folder.rfind("/sparse")) + "/");
          });
      (copy ? undistorted : files) += folder.files;
    }
    if (model->dense_workspace) std::swap(files, undistorted);
    if (files == 0 && undistorted == 0) {
      missing.push_back("No photographs were found for the " + std::to_string(model->images) +
                        " that are registered: only the points' own colours can be shown. Name "
                        "their folder if they lie elsewhere.");
    } else if (files < model->images) {
      missing.push_back(
          (files == 0 ? std::string("None") : "Only " + std::to_string(files)) + " of the " +
          std::to_string(model->images) + (model->dense_workspace ? " undistorted" : " original") +
          " photographs can be there (" + std::to_string(files) + " image files found)" +
          (undistorted > 0
               ? std::string("; the others can be taken from the ") +
                     (model->dense_workspace ? "original" : "smaller undistorted") + " ones."
               : ". Name the folder of the others if they lie elsewhere."));
    }
    if (workspace.depth_maps > 0 && workspace.depth_maps < model->images) {
      missing.push_back("stereo/depth_maps holds " + std::to_string(workspace.depth_maps) + " of " +
                        std::to_string(model->images) + " depth maps" +
                        (cloud != workspace.clouds.end()
                             ? "; nothing is lost, the fused cloud is there."
                             : ": the cloud that is made of them (--depth-maps) is not complete."));
    }
  }
  return missing;
}

}  // namespace sherd
