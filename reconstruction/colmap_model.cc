#include "reconstruction/colmap_model.h"

#include <cmath>
#include <limits>
#include <unordered_set>

#include "metaball/error.h"

namespace sherd {
namespace {

std::string Joined(const std::string& folder, const char* name) {
  return folder.empty() || folder.back() == '/' ? folder + name : folder + "/" + name;
}

// Two records of one id leave open which of them a reference means.
template <class Records, class Id>
void CheckUnique(const std::string& path, const Records& records, Id id, const char* what) {
  std::unordered_set<std::uint32_t> seen;
  seen.reserve(records.size());
  for (const auto& record : records) {
    if (!seen.insert(record.*id).second) {
      throw InputError(path, std::string(what) + " " + std::to_string(record.*id),
                       "the same id appears twice");
    }
  }
}

std::uint64_t Mixed(std::uint64_t x) {  // splitmix64
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

}  // namespace

ColmapModel ReadColmapModel(const std::string& folder, bool binary,
                            const ColmapReadOptions& options, const Control& control) {
  ColmapModel model;
  model.folder = folder;
  const char* extension = binary ? ".bin" : ".txt";
  const std::string cameras = Joined(folder, (std::string("cameras") + extension).c_str());
  const std::string images = Joined(folder, (std::string("images") + extension).c_str());
  const std::string points = Joined(folder, (std::string("points3D") + extension).c_str());
  if (binary) {
    ReadCamerasBinary(cameras, &model);
    ReadImagesBinary(images, &model, control);
  } else {
    ReadCamerasText(cameras, &model);
    ReadImagesText(images, &model, control);
  }
  CheckUnique(cameras, model.cameras, &SurveyCamera::camera_id, "camera");
  CheckUnique(images, model.images, &ColmapImage::image_id, "image");
  ReadFrames(folder, binary, &model);
  if (options.points) {
    if (binary) {
      ReadPointsBinary(points, options, &model, control);
    } else {
      ReadPointsText(points, options, &model, control);
    }
  }
  return model;
}

void CheckCamera(const std::string& path, const std::string& place, const SurveyCamera& camera) {
  const std::string name = "camera " + std::to_string(camera.camera_id);
  constexpr std::uint64_t kMaxSide = 1u << 24;
  if (camera.width == 0 || camera.height == 0 || camera.width > kMaxSide ||
      camera.height > kMaxSide) {
    throw InputError(path, place,
                     name + " has an impossible size of " + std::to_string(camera.width) + " x " +
                         std::to_string(camera.height) + " pixels",
                     "the file is damaged or of another kind");
  }
  for (const double p : camera.parameters) {
    if (!std::isfinite(p)) {
      throw InputError(path, place, name + " has a parameter that is not finite");
    }
  }
  double fx, fy, cx, cy;
  camera.Pinhole(&fx, &fy, &cx, &cy);
  if (!(fx > 0) || !(fy > 0)) {
    throw InputError(path, place, name + " has a focal length that is not positive");
  }
  if (camera.model == CameraModelId::kEquirectangular &&
      !(camera.parameters[0] > 0 && camera.parameters[1] > 0)) {
    throw InputError(path, place, name + " has a panorama size that is not positive");
  }
}

void CheckPose(const std::string& path, const std::string& place, Rigid3d* pose) {
  const double norm = std::sqrt(pose->qw * pose->qw + pose->qx * pose->qx + pose->qy * pose->qy +
                                pose->qz * pose->qz);
  if (!std::isfinite(norm) || !(norm > 1e-9)) {
    throw InputError(path, place, "the rotation is no quaternion (its length is 0 or not finite)",
                     "the file is damaged or of another kind");
  }
  if (!IsFinite(pose->translation)) {
    throw InputError(path, place, "the translation is not finite",
                     "the file is damaged or of another kind");
  }
  pose->qw /= norm;
  pose->qx /= norm;
  pose->qy /= norm;
  pose->qz /= norm;
}

Thinning::Thinning(std::uint64_t total, std::uint64_t kept)
    : total_(total), kept_(kept >= total ? 0 : kept) {
  if (kept_ > 0) NextStratum();
}

void Thinning::NextStratum() {
  if (stratum_ >= kept_) {
    chosen_ = std::numeric_limits<std::uint64_t>::max();
    return;
  }
  // 128-bit products: both counts may be large.
  const auto begin =
      static_cast<std::uint64_t>(static_cast<unsigned __int128>(stratum_) * total_ / kept_);
  const auto end =
      static_cast<std::uint64_t>(static_cast<unsigned __int128>(stratum_ + 1) * total_ / kept_);
  chosen_ = begin + Mixed(stratum_) % (end - begin);
  ++stratum_;
}

bool Thinning::Keep(std::uint64_t i) {
  if (kept_ == 0) return true;
  if (i != chosen_) return false;
  NextStratum();
  return true;
}

}  // namespace sherd
