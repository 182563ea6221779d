// What a reconstruction would find on the true surface: the sparse model's points with their
// tracks, the dense cloud, depth and normal maps.
#pragma once

#include <cstdint>
#include <vector>

#include "datasets_synthetic/colmap_files.h"
#include "datasets_synthetic/excavation.h"
#include "datasets_synthetic/scene.h"
#include "datasets_synthetic/shots.h"
#include "metaball/control.h"

namespace sherd::synthetic {

// Points of the true surface that at least three photographs see, observed with noise; sorted
// images (ascending ids) with all their keypoints, some of which belong to no point.
SparseModel MakeSparseModel(const TrenchScene& scene, const ShotPlan& plan,
                            const ExcavationOptions& options, const Control& control);

// The same model after undistortion, its images in the order `image_order` (indices into
// plan.shots).
SparseModel UndistortModel(const SparseModel& model, const ShotPlan& plan,
                           const std::vector<Lens>& pinholes,
                           const std::vector<std::size_t>& image_order);

// The dense cloud: as many points as asked for, on the part of the surface in the survey area that
// at least three photographs see, as dense everywhere as the photograph that shows it best.
// `pinholes`: the cameras of the undistorted photographs, one a lens.
std::vector<FusedPoint> MakeDenseCloud(const TrenchScene& scene, const ShotPlan& plan,
                                       const std::vector<Lens>& pinholes,
                                       const std::vector<std::size_t>& image_order,
                                       const ExcavationOptions& options, const Control& control);

// Depth along the camera's axis (0: nothing) and normals in the camera's frame (planar) at the
// pixel centres of `camera`.
struct DepthMap {
  int width = 0, height = 0;
  std::vector<float> depth, normal;
};
DepthMap MakeDepthMap(const TrenchScene& scene, const Shot& shot, const Lens& camera, int threads,
                      const Control& control);

// The camera of a depth map no larger than `max_side` (as COLMAP's patch_match max_image_size).
Lens DepthMapCamera(const Lens& pinhole, int max_side);

}  // namespace sherd::synthetic
