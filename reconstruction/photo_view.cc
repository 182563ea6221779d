#include "reconstruction/photo_view.h"

#include "metaball/error.h"
#include "reconstruction/photographs.h"

namespace sherd {
namespace {

struct Source {
  std::string path;
  PhotoSize size;
  std::uint32_t camera_idx = 0;
};

Source SourceOf(const Survey& survey, const Photograph& photo) {
  std::string problem = photo.name + ": no file was found for the photograph";
  if (!photo.original_path.empty() && photo.original_camera_idx < survey.cameras.size()) {
    try {
      return {photo.original_path, ReadPhotoSize(photo.original_path), photo.original_camera_idx};
    } catch (const InputError& error) {
      problem = error.what();
    }
  }
  if (photo.path.empty()) throw InputError("", "", problem);
  return {photo.path, ReadPhotoSize(photo.path), photo.camera_idx};
}

}  // namespace

PhotoView::PhotoView(const Survey& survey, std::size_t idx)
    : projector_(survey.cameras[survey.photographs[idx].camera_idx]),
      original_projector_(projector_) {
  const Photograph& photo = survey.photographs[idx];
  const Source source = SourceOf(survey, photo);
  const SurveyCamera& camera = survey.cameras[source.camera_idx];
  projector_ = CameraProjector(camera);
  path_ = source.path;
  width_ = source.size.width;
  height_ = source.size.height;
  cam_from_world_ = photo.cam_from_world;
  center_ = cam_from_world_.Center();
  scale_x_ = static_cast<double>(width_) / static_cast<double>(camera.width);
  scale_y_ = static_cast<double>(height_) / static_cast<double>(camera.height);
  double fx, fy, cx, cy;
  const SurveyCamera& original = survey.cameras[photo.original_camera_idx];
  original_projector_ = CameraProjector(original);
  original_width_ = static_cast<double>(original.width);
  original_height_ = static_cast<double>(original.height);
  camera.Pinhole(&fx, &fy, &cx, &cy);
  original_px_per_px_ = 1 / (fx * scale_x_);
  original.Pinhole(&fx, &fy, &cx, &cy);
  original_px_per_px_ *= fx;
  if (survey.dense_pixel_offset != 0) {
    // The offset is one of the dense stage's camera; as an angle it is the original's as well.
    survey.cameras[photo.camera_idx].Pinhole(&fx, &fy, &cx, &cy);
    offset_u_ = survey.dense_pixel_offset / fx;
    offset_v_ = survey.dense_pixel_offset / fy;
  }
}

Vec3d PhotoView::InCamera(const Vec3d& point_in_world) const {
  Vec3d p = cam_from_world_.Apply(point_in_world);
  p.x += offset_u_ * p.z;
  p.y += offset_v_ * p.z;
  return p;
}

bool PhotoView::ProjectIntoOriginal(const Vec3d& point_in_world, double* x, double* y) const {
  return original_projector_.Project(InCamera(point_in_world), x, y) && *x >= 0 && *y >= 0 &&
         *x <= original_width_ && *y <= original_height_;
}

bool PhotoView::Project(const Vec3d& point_in_world, double* x, double* y) const {
  if (!projector_.Project(InCamera(point_in_world), x, y)) return false;
  *x *= scale_x_;
  *y *= scale_y_;
  return *x >= 0 && *y >= 0 && *x <= width_ && *y <= height_;
}

}  // namespace sherd
