#include "reconstruction/photo_mask.h"

#include <algorithm>
#include <filesystem>
#include <memory>

#include "metaball/error.h"
#include "reconstruction/camera_projector.h"
#include "reconstruction/photo_file.h"
#include "reconstruction/take_photographs.h"

namespace sherd {

PhotoMask::PhotoMask(const std::string& path) {
  PhotoFile file(path);
  width_ = file.width();
  height_ = file.height();
  ignored_.reserve(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  file.ReadRows([&](const Vec3f* row, const std::uint8_t*) {
    for (int x = 0; x < width_; ++x) {
      ignored_.push_back(!(row[x].x > 0 || row[x].y > 0 || row[x].z > 0));
    }
  });
}

bool PhotoMask::Ignores(double u, double v) const {
  if (!(u >= 0 && v >= 0 && u < 1 && v < 1)) return true;
  return IgnoresPixel(static_cast<int>(u * width_), static_cast<int>(v * height_));
}

std::string MasksLeftOut(std::size_t count, const std::string& example) {
  return Counted(count, "mask cannot be read, and its photograph is used",
                 "masks cannot be read, and their photographs are used") +
         " whole: " + example + (count > 1 ? " (and others)" : "");
}

std::size_t FindMasks(const std::string& folder, Survey* survey) {
  std::size_t found = 0;
  std::error_code error;
  for (Photograph& photo : survey->photographs) {
    const std::string path = folder + "/" + photo.name + ".png";
    if (!std::filesystem::is_regular_file(path, error)) continue;
    photo.mask_path = path;
    ++found;
  }
  return found;
}

std::uint64_t ApplyMasks(Survey* survey, const Control& control) {
  SurveyPoints& points = survey->points;
  if (points.photo_begin.empty()) return 0;
  // For each photograph the entries that name it, one mask at a time in memory.
  std::vector<std::vector<std::uint64_t>> entries(survey->photographs.size());
  std::vector<std::uint32_t> point_of(points.photo_idx.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::uint64_t k = points.photo_begin[i]; k < points.photo_begin[i + 1]; ++k) {
      point_of[k] = static_cast<std::uint32_t>(i);
      if (!survey->photographs[points.photo_idx[k]].mask_path.empty()) {
        entries[points.photo_idx[k]].push_back(k);
      }
    }
  }
  std::vector<bool> removed(points.photo_idx.size());
  std::uint64_t count = 0, unreadable = 0;
  std::string example;
  for (std::size_t j = 0; j < entries.size(); ++j) {
    control.ThrowIfStopped();
    if (entries[j].empty()) continue;
    const Photograph& photo = survey->photographs[j];
    std::unique_ptr<PhotoMask> mask;
    try {
      mask = std::make_unique<PhotoMask>(photo.mask_path);
    } catch (const InputError& error) {
      if (unreadable++ == 0) example = error.what();
      continue;
    }
    const SurveyCamera& camera = survey->cameras[photo.original_camera_idx];
    const CameraProjector projector(camera);
    for (const std::uint64_t k : entries[j]) {
      double x, y;
      const Vec3d p = photo.cam_from_world.Apply(points.position[point_of[k]]);
      if (projector.Project(p, &x, &y) && !mask->Ignores(x / static_cast<double>(camera.width),
                                                         y / static_cast<double>(camera.height))) {
        continue;
      }
      removed[k] = true;
      ++count;
    }
  }
  std::uint64_t write = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint64_t begin = points.photo_begin[i], end = points.photo_begin[i + 1];
    points.photo_begin[i] = write;
    for (std::uint64_t k = begin; k < end; ++k) {
      if (!removed[k]) points.photo_idx[write++] = points.photo_idx[k];
    }
  }
  points.photo_begin.back() = write;
  points.photo_idx.resize(write);
  if (unreadable > 0) survey->warnings.push_back(MasksLeftOut(unreadable, example));
  return count;
}

}  // namespace sherd
