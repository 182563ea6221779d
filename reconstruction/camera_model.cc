#include "reconstruction/camera_model.h"

#include <algorithm>
#include <iterator>

#include "reconstruction/camera_projector.h"

namespace sherd {
namespace {

struct ModelInfo {
  std::string_view name;
  int parameters;
  int focal_lengths;  // 1: f, cx, cy ...; 2: fx, fy, cx, cy ...; 0: none
};

// Indexed by the number in cameras.bin (colmap/src/colmap/sensor/models.h, CameraModelId).
constexpr ModelInfo kModels[] = {
    {"SIMPLE_PINHOLE", 3, 1},
    {"PINHOLE", 4, 2},
    {"SIMPLE_RADIAL", 4, 1},
    {"RADIAL", 5, 1},
    {"OPENCV", 8, 2},
    {"OPENCV_FISHEYE", 8, 2},
    {"FULL_OPENCV", 12, 2},
    {"FOV", 5, 2},
    {"SIMPLE_RADIAL_FISHEYE", 4, 1},
    {"RADIAL_FISHEYE", 5, 1},
    {"THIN_PRISM_FISHEYE", 12, 2},
    {"RAD_TAN_THIN_PRISM_FISHEYE", 16, 2},
    {"SIMPLE_DIVISION", 4, 1},
    {"DIVISION", 5, 2},
    {"SIMPLE_FISHEYE", 3, 1},
    {"FISHEYE", 4, 2},
    {"EUCM", 6, 2},
    {"EQUIRECTANGULAR", 2, 0},
};
constexpr int kNumModels = static_cast<int>(std::size(kModels));

}  // namespace

std::optional<int> NumParameters(int model_id) {
  if (model_id < 0 || model_id >= kNumModels) return std::nullopt;
  return kModels[model_id].parameters;
}

std::string_view CameraModelName(int model_id) {
  if (model_id < 0 || model_id >= kNumModels) return {};
  return kModels[model_id].name;
}

std::optional<CameraModelId> CameraModelFromName(std::string_view name) {
  for (int id = 0; id < kNumModels; ++id) {
    if (kModels[id].name == name) return static_cast<CameraModelId>(id);
  }
  return std::nullopt;
}

void SurveyCamera::Pinhole(double* fx, double* fy, double* cx, double* cy) const {
  const int focal_lengths = kModels[static_cast<int>(model)].focal_lengths;
  if (focal_lengths == 0) {
    // A panorama: the pinhole that fills the picture's width with 90 degrees.
    *fx = *fy = 0.5 * static_cast<double>(width);
    *cx = 0.5 * static_cast<double>(width);
    *cy = 0.5 * static_cast<double>(height);
    return;
  }
  *fx = parameters[0];
  *fy = parameters[focal_lengths - 1];
  *cx = parameters[focal_lengths];
  *cy = parameters[focal_lengths + 1];
}

std::optional<std::pair<double, double>> SurveyCamera::Project(const Vec3d& point_in_camera) const {
  double x, y;
  if (!CameraProjector(*this).Project(point_in_camera, &x, &y)) return std::nullopt;
  return std::make_pair(x, y);
}

std::optional<Vec3d> SurveyCamera::Unproject(double x, double y) const {
  Vec3d direction;
  if (!CameraProjector(*this).Unproject(x, y, &direction)) return std::nullopt;
  return direction;
}

}  // namespace sherd
