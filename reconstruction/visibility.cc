#include "reconstruction/visibility.h"

#include <algorithm>

#include "metaball/error.h"
#include "reconstruction/camera_projector.h"
#include "reconstruction/point_arrays.h"

namespace sherd {

VisibilityReader::VisibilityReader(const std::string& path, std::uint64_t num_points)
    : reader_(path) {
  const auto declared = reader_.Read<std::uint64_t>("the number of points");
  if (declared != num_points) {
    throw InputError(path, "byte 0",
                     "holds " + std::to_string(declared) + " points, but the cloud has " +
                         std::to_string(num_points),
                     "the two files are not of the same run of stereo_fusion");
  }
  reader_.CheckCount(declared, 4, "points");
}

void VisibilityReader::Read(std::vector<std::uint32_t>* image_idx) {
  const auto count = reader_.Read<std::uint32_t>("a point's photographs");
  reader_.CheckCount(count, 4, "photographs of a point");
  const std::size_t begin = image_idx->size();
  for (std::uint32_t i = 0; i < count; ++i) {
    image_idx->push_back(reader_.Read<std::uint32_t>("a point's photographs"));
  }
  std::sort(image_idx->begin() + begin, image_idx->end());
  image_idx->erase(std::unique(image_idx->begin() + begin, image_idx->end()), image_idx->end());
}

void VisibilityReader::Skip() {
  const auto count = reader_.Read<std::uint32_t>("a point's photographs");
  reader_.CheckCount(count, 4, "photographs of a point");
  reader_.Skip(std::uint64_t{count} * 4, "a point's photographs");
}

double ShareInside(const Survey& survey, const std::vector<std::uint32_t>& photo_of) {
  const SurveyPoints& points = survey.points;
  if (points.photo_begin.empty() || points.size() == 0) return 1.0;
  std::vector<CameraProjector> projectors;
  projectors.reserve(survey.cameras.size());
  for (const SurveyCamera& camera : survey.cameras) projectors.emplace_back(camera);
  constexpr std::size_t kSample = 4000;
  const std::size_t step = std::max<std::size_t>(1, points.size() / kSample);
  std::uint64_t listed = 0, inside = 0;
  for (std::size_t i = 0; i < points.size(); i += step) {
    for (std::uint64_t j = points.photo_begin[i]; j < points.photo_begin[i + 1]; ++j) {
      ++listed;
      const std::uint32_t idx = points.photo_idx[j];
      if (idx >= photo_of.size() || photo_of[idx] == kNoPhoto) continue;
      const Photograph& photo = survey.photographs[photo_of[idx]];
      const SurveyCamera& camera = survey.cameras[photo.camera_idx];
      double x, y;
      if (!projectors[photo.camera_idx].Project(photo.cam_from_world.Apply(points.position[i]), &x,
                                                &y)) {
        continue;
      }
      // A pixel of tolerance: points were fused from whole pixels.
      if (x >= -1 && y >= -1 && x <= static_cast<double>(camera.width) + 1 &&
          y <= static_cast<double>(camera.height) + 1) {
        ++inside;
      }
    }
  }
  return listed == 0 ? 1.0 : static_cast<double>(inside) / static_cast<double>(listed);
}

}  // namespace sherd
