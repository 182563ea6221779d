#include "reconstruction/photo_view.h"

#include "metaball/error.h"
#include "reconstruction/camera_projector.h"
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

PhotoView::PhotoView(const Survey& survey, std::size_t idx) {
  const Photograph& photo = survey.photographs[idx];
  const Source source = SourceOf(survey, photo);
  const SurveyCamera& camera = survey.cameras[source.camera_idx];
  const SurveyCamera& original = survey.cameras[photo.original_camera_idx];
  const Rigid3d& pose = photo.cam_from_world;
  path_ = source.path;
  PhotoCamera& c = camera_;
  c.usable = true;
  c.qw = pose.qw;
  c.qx = pose.qx;
  c.qy = pose.qy;
  c.qz = pose.qz;
  c.translation = pose.translation;
  c.center = pose.Center();
  c.lens = CameraProjector(camera).lens();
  c.width = source.size.width;
  c.height = source.size.height;
  c.scale_x = static_cast<double>(c.width) / static_cast<double>(camera.width);
  c.scale_y = static_cast<double>(c.height) / static_cast<double>(camera.height);
  c.original = CameraProjector(original).lens();
  c.original_width = static_cast<double>(original.width);
  c.original_height = static_cast<double>(original.height);
  double fx, fy, cx, cy;
  camera.Pinhole(&fx, &fy, &cx, &cy);
  c.original_px_per_px = 1 / (fx * c.scale_x);
  original.Pinhole(&fx, &fy, &cx, &cy);
  c.original_px_per_px *= fx;
  if (survey.dense_pixel_offset != 0) {
    // The offset is one of the dense stage's camera; as an angle it is the original's as well.
    survey.cameras[photo.camera_idx].Pinhole(&fx, &fy, &cx, &cy);
    c.offset_u = survey.dense_pixel_offset / fx;
    c.offset_v = survey.dense_pixel_offset / fy;
  }
}

}  // namespace sherd
