// COLMAP's files, as written by COLMAP 3.8 (doc/format.rst; scene/reconstruction_io_*.cc; mvs/).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "datasets_synthetic/lens.h"
#include "metaball/color.h"
#include "metaball/vec.h"

namespace sherd::synthetic {

inline constexpr std::uint64_t kNoPoint = ~std::uint64_t{0};

struct ModelKeypoint {
  double x = 0, y = 0;  // image coordinates
  std::uint64_t point3d_id = kNoPoint;
};

struct ModelImage {
  std::uint32_t image_id = 0;
  std::array<double, 4> q{1, 0, 0, 0};  // cam_from_world: w, x, y, z
  Vec3d t{};
  std::uint32_t camera_id = 0;
  std::string name;
  std::vector<ModelKeypoint> keypoints;
};

struct ModelObservation {
  std::uint32_t image_id = 0;
  std::uint32_t keypoint_idx = 0;
};

struct ModelPoint {
  std::uint64_t point3d_id = 0;
  Vec3d position{};
  Rgb8 color;
  double error = -1;  // mean reprojection error, px
  std::vector<ModelObservation> track;
};

struct SparseModel {
  std::vector<Lens> cameras;       // OPENCV when distorted, else PINHOLE
  std::vector<ModelImage> images;  // in the order of the file
  std::vector<ModelPoint> points;  // ascending ids
};

// cameras, images and points3D .bin or .txt (17 digits) in an existing folder.
void WriteModelBinary(const std::string& folder, const SparseModel& model);
void WriteModelText(const std::string& folder, const SparseModel& model);

// A depth map (channels 1) or normal map (channels 3), planar: all of a channel's pixels, row by
// row, then the next channel.
void WriteMap(const std::string& path, int width, int height, int channels,
              const std::vector<float>& values);

struct FusedPoint {
  Vec3f position{};
  Vec3f normal{};  // unit, world axes
  Rgb8 color;
  // The photographs that see it: indices into the images of dense/sparse, in that file's order.
  std::vector<std::uint32_t> image_idx;
};

// fused.ply (27 bytes a vertex) and fused.ply.vis beside it.
void WriteFused(const std::string& ply_path, const std::vector<FusedPoint>& points);

}  // namespace sherd::synthetic
