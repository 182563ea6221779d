#include "reconstruction/take_photographs.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <numeric>
#include <tuple>
#include <unordered_map>

#include "reconstruction/point_arrays.h"

namespace sherd {

std::vector<std::uint32_t> TakePhotographs(ColmapModel* model, Survey* survey) {
  std::unordered_map<std::uint32_t, std::uint32_t> camera_of;
  for (const SurveyCamera& camera : model->cameras) {
    camera_of[camera.camera_id] = static_cast<std::uint32_t>(camera_of.size());
  }
  survey->cameras = std::move(model->cameras);
  std::vector<std::uint32_t> photo_of(model->images.size(), kNoPhoto);
  std::uint64_t without_camera = 0;
  std::string example;
  std::vector<std::size_t> by_name(model->images.size());
  std::iota(by_name.begin(), by_name.end(), std::size_t{0});
  std::sort(by_name.begin(), by_name.end(), [&](std::size_t a, std::size_t b) {
    const ColmapImage &x = model->images[a], &y = model->images[b];
    return std::tie(x.name, x.image_id) < std::tie(y.name, y.image_id);
  });
  for (const std::size_t i : by_name) {
    const ColmapImage& image = model->images[i];
    const auto camera = camera_of.find(image.camera_id);
    if (camera == camera_of.end()) {
      if (without_camera++ == 0) example = image.name;
      continue;
    }
    photo_of[i] = static_cast<std::uint32_t>(survey->photographs.size());
    Photograph photo;
    photo.image_id = image.image_id;
    photo.name = image.name;
    photo.camera_idx = photo.original_camera_idx = camera->second;
    photo.cam_from_world = image.cam_from_world;
    survey->photographs.push_back(std::move(photo));
  }
  if (model->cameras_of_unknown_model > 0) {
    survey->warnings.push_back(
        model->folder + ": " +
        Counted(model->cameras_of_unknown_model, "camera is", "cameras are") +
        " of the unknown model " + model->unknown_model_name +
        " (written by a newer COLMAP?) and left out");
  }
  if (without_camera > 0) {
    survey->warnings.push_back(model->folder + ": " +
                               Counted(without_camera, "photograph was", "photographs were") +
                               " dropped because the camera is not in the model (" + example +
                               (without_camera > 1 ? " and others)" : ")"));
  }
  survey->warnings.insert(survey->warnings.end(), model->warnings.begin(), model->warnings.end());
  return photo_of;
}

void WarnNotFinite(const std::string& path, std::uint64_t count, Survey* survey) {
  if (count == 0) return;
  survey->warnings.push_back(path + ": " + Counted(count, "point was", "points were") +
                             " dropped because a coordinate is not finite");
}

std::string Counted(std::uint64_t count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

void WarnOfFloats(const std::string& path, double largest, const std::string& what_to_do,
                  Survey* survey) {
  if (!(largest > 1e4)) return;
  // The distance of two floats there, against what the cloud resolves.
  char step[32];
  std::snprintf(step, sizeof(step), "%.2g", largest * 0x1p-24 * 2);
  survey->warnings.push_back(path +
                             ": the coordinates are large 32-bit numbers, rounded to steps of "
                             "about " +
                             step + " before Sherd read them; " + what_to_do);
}

std::uint64_t FileBytes(const std::string& path) {
  std::error_code error;
  const std::uint64_t bytes = std::filesystem::file_size(path, error);
  return error ? 0 : bytes;
}

}  // namespace sherd
