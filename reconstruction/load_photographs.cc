#include "reconstruction/load_photographs.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <unordered_map>

#include "metaball/error.h"
#include "reconstruction/colmap_model.h"
#include "reconstruction/photographs.h"

namespace sherd {
namespace {

enum class Fit { kNone, kStretched, kResized, kExact };

// Whether a picture of this size can be the camera's: the same; the same shape within 0.5 %, or
// within the rounding of its sides to whole pixels; or, stretched by up to 5 %, one that somebody's
// tool has resized carelessly. Beyond that it is another picture, or a turned one.
Fit FitOf(const PhotoSize& size, const SurveyCamera& camera) {
  const double w = static_cast<double>(camera.width), h = static_cast<double>(camera.height);
  if (size.width == w && size.height == h) return Fit::kExact;
  const double off = std::abs((size.width * h) / (size.height * w) - 1);
  const double rounding = 1.0 / std::min(size.width, size.height);
  if (off <= std::max(0.005, std::min(rounding, 0.02))) return Fit::kResized;
  return off <= 0.05 ? Fit::kStretched : Fit::kNone;
}

bool SamePose(const Rigid3d& a, const Rigid3d& b) {
  const double cosine = std::abs(a.qw * b.qw + a.qx * b.qx + a.qy * b.qy + a.qz * b.qz);
  return cosine > 1 - 1e-10 &&
         Length(a.translation - b.translation) <= 1e-6 * (1 + Length(a.translation));
}

// The cameras of the originals: those of a sparse model with the same photographs at the same
// poses. Appends them to the survey and sets original_camera_idx; false where there is no such
// model. has_original[i] tells for which photographs.
bool FindOriginalCameras(const Workspace& workspace, const Control& control, Survey* survey,
                         std::vector<bool>* has_original) {
  has_original->assign(survey->photographs.size(), false);
  for (Photograph& photo : survey->photographs) photo.original_camera_idx = photo.camera_idx;
  for (const SparseModelFiles& files : workspace.models) {
    if (files.dense_workspace || !files.problem.empty()) continue;
    ColmapModel model;
    try {
      ColmapReadOptions read;
      read.points = false;
      model = ReadColmapModel(files.folder, files.binary, read, control);
    } catch (const InputError&) {
      continue;  // not the model that was asked for
    }
    std::unordered_map<std::string, const ColmapImage*> by_name;
    for (const ColmapImage& image : model.images) by_name[image.name] = &image;
    std::unordered_map<std::uint32_t, std::uint32_t> camera_of;
    for (std::size_t i = 0; i < model.cameras.size(); ++i) {
      camera_of[model.cameras[i].camera_id] =
          static_cast<std::uint32_t>(survey->cameras.size() + i);
    }
    std::size_t found = 0;
    for (std::size_t i = 0; i < survey->photographs.size(); ++i) {
      Photograph& photo = survey->photographs[i];
      const auto image = by_name.find(photo.name);
      if (image == by_name.end() ||
          !SamePose(image->second->cam_from_world, photo.cam_from_world)) {
        continue;
      }
      const auto camera = camera_of.find(image->second->camera_id);
      if (camera == camera_of.end()) continue;
      photo.original_camera_idx = camera->second;
      (*has_original)[i] = true;
      ++found;
    }
    if (found > 0) {
      survey->cameras.insert(survey->cameras.end(), model.cameras.begin(), model.cameras.end());
      return true;
    }
  }
  return false;
}

// What was looked at and did not fit, for one warning.
struct Rejected {
  std::size_t count = 0;
  std::string example;

  void Add(const std::string& what) {
    if (count++ == 0) example = what;
  }
};

void CheckFit(const Photograph& photo, const SurveyCamera& camera, std::string* path,
              Rejected* rejected, Rejected* stretched) {
  if (path->empty()) return;
  try {
    const PhotoSize size = ReadPhotoSize(*path);
    const Fit fit = FitOf(size, camera);
    if (fit == Fit::kExact || fit == Fit::kResized) return;
    const std::string sizes = photo.name + " is " + std::to_string(size.width) + " x " +
                              std::to_string(size.height) + " pixels, its camera " +
                              std::to_string(camera.width) + " x " + std::to_string(camera.height);
    if (fit == Fit::kStretched) {
      stretched->Add(sizes);
      return;
    }
    rejected->Add(sizes);
  } catch (const InputError& error) {
    rejected->Add(error.what());
  }
  path->clear();
}

// A folder outside the dense workspace may hold originals or undistorted copies: the size tells
// which, where it is exactly one's. A resize is taken for one of an original only where
// `resized_originals` says that nothing else is to be expected there.
void TakeIfItFits(const Survey& survey, const std::string& path, bool has_original,
                  bool resized_originals, Photograph* photo, Rejected* rejected) {
  const SurveyCamera& camera = survey.cameras[photo->camera_idx];
  try {
    const PhotoSize size = ReadPhotoSize(path);
    const Fit fit = FitOf(size, camera);
    const Fit original_fit =
        has_original ? FitOf(size, survey.cameras[photo->original_camera_idx]) : Fit::kNone;
    if (original_fit == Fit::kExact ||
        (original_fit == Fit::kResized && fit != Fit::kExact && resized_originals)) {
      photo->original_path = path;
    } else if (photo->path.empty() &&
               (fit == Fit::kExact || (fit == Fit::kResized && !survey.dense))) {
      photo->path = path;
    }
  } catch (const InputError& error) {
    rejected->Add(error.what());
  }
}

bool FileIsThere(const std::string& path) {
  std::error_code ignored;
  return !path.empty() && std::filesystem::exists(path, ignored);
}

}  // namespace

std::size_t RelocatePhotographs(const std::vector<std::string>& folders, Survey* survey) {
  std::vector<Photograph> search = survey->photographs;
  FindPhotographs(folders, &search);
  Rejected rejected;
  std::size_t found = 0;
  for (std::size_t i = 0; i < search.size(); ++i) {
    Photograph& photo = survey->photographs[i];
    // A camera of its own for the original is only there when an import found one.
    const bool has_original = photo.original_camera_idx != photo.camera_idx &&
                              photo.original_camera_idx < survey->cameras.size();
    const bool path_there = FileIsThere(photo.path);
    const bool original_there = FileIsThere(photo.original_path);
    if (!path_there) photo.path.clear();
    if (!original_there) photo.original_path.clear();
    if (!search[i].path.empty() && (!path_there || (has_original && !original_there))) {
      TakeIfItFits(*survey, search[i].path, has_original && !original_there, false, &photo,
                   &rejected);
    }
    found += !photo.path.empty() || !photo.original_path.empty();
  }
  return found;
}

void LocatePhotographs(const Workspace& workspace, const std::string& photo_folder,
                       const std::string& dense_root, const Control& control, Survey* survey) {
  std::vector<Photograph>& photos = survey->photographs;
  if (photos.empty()) return;
  // Undistorted copies lie in images/ of a dense workspace and fit its cameras; all other folders
  // hold originals.
  std::vector<std::string> undistorted, originals;
  if (!photo_folder.empty()) originals.push_back(photo_folder);
  for (const PhotoFolder& folder : workspace.photo_folders) {
    if (!dense_root.empty() && folder.path.starts_with(dense_root + "/")) {
      undistorted.push_back(folder.path);
      continue;
    }
    const bool of_dense = std::any_of(
        workspace.models.begin(), workspace.models.end(), [&](const SparseModelFiles& m) {
          return m.dense_workspace &&
                 folder.path.starts_with(m.folder.substr(0, m.folder.rfind("/sparse")) + "/");
        });
    if (!of_dense) originals.push_back(folder.path);
  }
  Rejected rejected, stretched;
  if (dense_root.empty()) {
    FindPhotographs(originals, &photos);
    for (Photograph& photo : photos) {
      control.ThrowIfStopped();
      CheckFit(photo, survey->cameras[photo.camera_idx], &photo.path, &rejected, &stretched);
    }
  } else {
    std::vector<bool> has_original;
    FindOriginalCameras(workspace, control, survey, &has_original);
    std::vector<Photograph> search = photos;
    FindPhotographs(originals, &search);
    FindPhotographs(undistorted, &photos);
    for (std::size_t i = 0; i < photos.size(); ++i) {
      control.ThrowIfStopped();
      Photograph& photo = photos[i];
      const SurveyCamera& camera = survey->cameras[photo.camera_idx];
      CheckFit(photo, camera, &photo.path, &rejected, &stretched);
      if (search[i].path.empty()) continue;
      TakeIfItFits(*survey, search[i].path, has_original[i], true, &photo, &rejected);
    }
  }
  if (rejected.count > 0) {
    survey->warnings.push_back(std::to_string(rejected.count) +
                               (rejected.count == 1 ? " photograph is" : " photographs are") +
                               " left out because the file does not fit the camera: " +
                               rejected.example + (rejected.count > 1 ? " (and others)" : ""));
  }
  if (stretched.count > 0) {
    survey->warnings.push_back(
        std::to_string(stretched.count) + " of " + std::to_string(photos.size()) +
        " photographs have another shape than their camera (by more than 0.5 %) and are scaled by "
        "width and height: " +
        stretched.example + (stretched.count > 1 ? " (and others)" : ""));
  }
  const auto missing = static_cast<std::size_t>(std::count_if(
      photos.begin(), photos.end(),
      [](const Photograph& photo) { return photo.path.empty() && photo.original_path.empty(); }));
  if (missing > 0) {
    const auto first = std::find_if(photos.begin(), photos.end(), [](const Photograph& photo) {
      return photo.path.empty() && photo.original_path.empty();
    });
    survey->warnings.push_back(std::to_string(missing) + " of " + std::to_string(photos.size()) +
                               " photographs were not found (" + first->name +
                               (missing > 1 ? " and others" : "") +
                               "); name the folder they lie in");
  }
}

}  // namespace sherd
