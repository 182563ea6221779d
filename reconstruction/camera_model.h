// COLMAP's camera models (colmap/src/colmap/sensor/models.h). Image coordinates: the upper-left
// corner of the image is (0, 0), the centre of the first pixel (0.5, 0.5).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "metaball/photo/lens.h"
#include "metaball/vec.h"

namespace sherd {

// Number of parameters of a model; nullopt for an id this program does not know.
std::optional<int> NumParameters(int model_id);
// "PINHOLE" and so on, as cameras.txt spells it; empty for an unknown id.
std::string_view CameraModelName(int model_id);
std::optional<CameraModelId> CameraModelFromName(std::string_view name);

struct SurveyCamera {
  std::uint32_t camera_id = 0;
  CameraModelId model = CameraModelId::kPinhole;
  std::uint64_t width = 0, height = 0;  // pixels
  std::vector<double> parameters;       // in COLMAP's order

  bool IsPinhole() const {
    return model == CameraModelId::kSimplePinhole || model == CameraModelId::kPinhole;
  }
  // Focal lengths and principal point in pixels (distortion left out; for EQUIRECTANGULAR the
  // pinhole that shows the middle 90 degrees).
  void Pinhole(double* fx, double* fy, double* cx, double* cy) const;
  // Image coordinates of a point in the camera's frame, distortion included; nullopt where the
  // model has no image of it (behind the camera, outside the model's domain).
  std::optional<std::pair<double, double>> Project(const Vec3d& point_in_camera) const;
  // The inverse: the unit direction, in the camera's frame, of what is seen at image coordinates
  // (x, y); nullopt where nothing is (outside the model's domain, where a polynomial has folded,
  // outside a panorama).
  std::optional<Vec3d> Unproject(double x, double y) const;
};

}  // namespace sherd
