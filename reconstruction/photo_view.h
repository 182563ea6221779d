// A photograph made ready for projecting surface points into its file. Internal to reconstruction/.
#pragma once

#include <string>

#include "metaball/vec.h"
#include "reconstruction/camera_projector.h"
#include "reconstruction/survey.h"

namespace sherd {

// Which file of photograph `idx` the surface's colours come from, and how to get there: the
// original where there is one, else the (undistorted) file of its own camera. The file may be a
// resize of what the camera describes.
class PhotoView {
 public:
  // Throws InputError when neither file can be read.
  PhotoView(const Survey& survey, std::size_t idx);

  const std::string& path() const { return path_; }
  int width() const { return width_; }  // of the file
  int height() const { return height_; }
  const Vec3d& center() const { return center_; }

  // Pixel coordinates in the file, centre of the first pixel at (0.5, 0.5); false where the
  // photograph does not show the point.
  bool Project(const Vec3d& point_in_world, double* x, double* y) const;

  // The same in the original's pixels (those of its camera), which masks refer to, also where the
  // file is an undistorted copy.
  bool ProjectIntoOriginal(const Vec3d& point_in_world, double* x, double* y) const;
  // Pixels of the original that one of the file is wide, in the middle of the picture.
  double original_px_per_px() const { return original_px_per_px_; }

 private:
  Vec3d InCamera(const Vec3d& point_in_world) const;

  std::string path_;
  int width_ = 0, height_ = 0;
  Rigid3d cam_from_world_;
  Vec3d center_{};
  CameraProjector projector_, original_projector_;
  double scale_x_ = 1, scale_y_ = 1;  // file pixels per camera pixel
  double original_width_ = 0, original_height_ = 0, original_px_per_px_ = 1;
  double offset_u_ = 0, offset_v_ = 0;  // Survey::dense_pixel_offset as a tangent
};

}  // namespace sherd
