// A photograph made ready for projecting surface points into its file. Internal to reconstruction/.
#pragma once

#include <string>

#include "metaball/photo/photo_camera.h"
#include "metaball/vec.h"
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
  const PhotoCamera& camera() const { return camera_; }
  int width() const { return camera_.width; }  // of the file
  int height() const { return camera_.height; }
  const Vec3d& center() const { return camera_.center; }

  // Pixel coordinates in the file, centre of the first pixel at (0.5, 0.5); false where the
  // photograph does not show the point.
  bool Project(const Vec3d& point_in_world, double* x, double* y) const {
    return camera_.Project(point_in_world, x, y);
  }

 private:
  std::string path_;
  PhotoCamera camera_;
};

}  // namespace sherd
