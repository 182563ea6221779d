// cameras.bin, images.bin, points3D.bin (colmap_formats 2.1 - 2.3).
#include <algorithm>
#include <limits>

#include "metaball/error.h"
#include "reconstruction/binary_reader.h"
#include "reconstruction/colmap_model.h"

namespace sherd {
namespace {

constexpr std::uint64_t kMaxName = 4096;  // PATH_MAX
constexpr std::uint64_t kCancelInterval = 1 << 14;

std::string At(std::uint64_t byte) { return "byte " + std::to_string(byte); }

}  // namespace

void ReadCamerasBinary(const std::string& path, ColmapModel* model) {
  BinaryReader reader(path);
  const auto count = reader.Read<std::uint64_t>("the number of cameras");
  reader.CheckCount(count, 4 + 4 + 8 + 8 + 2 * 8, "cameras");
  model->cameras.reserve(static_cast<std::size_t>(count));
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t start = reader.position();
    SurveyCamera camera;
    camera.camera_id = reader.Read<std::uint32_t>("a camera");
    const auto model_id = reader.Read<std::int32_t>("a camera");
    const std::optional<int> parameters = NumParameters(model_id);
    if (!parameters) {
      // The record's length depends on the model: nothing after it can be found.
      reader.FailAt(start,
                    "camera " + std::to_string(camera.camera_id) + " has the unknown model id " +
                        std::to_string(model_id),
                    "written by a newer COLMAP? Convert it there: colmap model_converter "
                    "--output_type TXT");
    }
    camera.model = static_cast<CameraModelId>(model_id);
    camera.width = reader.Read<std::uint64_t>("a camera");
    camera.height = reader.Read<std::uint64_t>("a camera");
    camera.parameters.resize(static_cast<std::size_t>(*parameters));
    for (double& p : camera.parameters) p = reader.Read<double>("a camera's parameters");
    CheckCamera(path, At(start), camera);
    model->cameras.push_back(std::move(camera));
  }
  reader.ExpectEnd("cameras");
}

void ReadImagesBinary(const std::string& path, ColmapModel* model, const Control& control) {
  BinaryReader reader(path);
  const auto count = reader.Read<std::uint64_t>("the number of images");
  reader.CheckCount(count, 4 + 7 * 8 + 4 + 1 + 8, "images");
  model->images.reserve(static_cast<std::size_t>(count));
  for (std::uint64_t i = 0; i < count; ++i) {
    control.ThrowIfStopped();
    const std::uint64_t start = reader.position();
    ColmapImage image;
    image.image_id = reader.Read<std::uint32_t>("an image");
    Rigid3d& pose = image.cam_from_world;
    pose.qw = reader.Read<double>("an image's pose");
    pose.qx = reader.Read<double>("an image's pose");
    pose.qy = reader.Read<double>("an image's pose");
    pose.qz = reader.Read<double>("an image's pose");
    pose.translation.x = reader.Read<double>("an image's pose");
    pose.translation.y = reader.Read<double>("an image's pose");
    pose.translation.z = reader.Read<double>("an image's pose");
    CheckPose(path, At(start), &pose);
    image.camera_id = reader.Read<std::uint32_t>("an image");
    image.name = reader.ReadName(kMaxName, "an image's name");
    // The observations: which photographs see a point is in points3D.bin.
    const auto observations = reader.Read<std::uint64_t>("the number of an image's observations");
    reader.CheckCount(observations, 24, "observations");
    reader.Skip(observations * 24, "an image's observations");
    model->images.push_back(std::move(image));
  }
  reader.ExpectEnd("images");
}

void ReadPointsBinary(const std::string& path, const ColmapReadOptions& options, ColmapModel* model,
                      const Control& control) {
  BinaryReader reader(path);
  const auto count = reader.Read<std::uint64_t>("the number of points");
  constexpr std::uint64_t kFixedBytes = 8 + 3 * 8 + 3 + 8 + 8;
  reader.CheckCount(count, kFixedBytes, "points");
  Thinning thinning(count, options.decimate_to);
  const auto kept =
      static_cast<std::size_t>(thinning.all() ? count : std::min(count, options.decimate_to));
  SurveyPoints& points = model->points;
  points.position.reserve(kept);
  points.color.reserve(kept);
  points.error.reserve(kept);
  points.photo_begin.reserve(kept + 1);
  points.photo_begin.push_back(0);
  for (std::uint64_t i = 0; i < count; ++i) {
    if (i % kCancelInterval == 0) {
      control.ThrowIfStopped();
      control.Report("reading points", static_cast<double>(reader.position()) / reader.size());
    }
    reader.Read<std::uint64_t>("a point");  // its id
    Vec3d p;
    p.x = reader.Read<double>("a point");
    p.y = reader.Read<double>("a point");
    p.z = reader.Read<double>("a point");
    Rgb8 color;
    color.r = reader.Read<std::uint8_t>("a point");
    color.g = reader.Read<std::uint8_t>("a point");
    color.b = reader.Read<std::uint8_t>("a point");
    const auto error = reader.Read<double>("a point");
    const auto track = reader.Read<std::uint64_t>("the length of a point's track");
    reader.CheckCount(track, 8, "observations of a point");
    if (!thinning.Keep(i) || !IsFinite(p)) {
      if (!IsFinite(p)) ++model->points_not_finite;
      reader.Skip(track * 8, "a point's track");
      continue;
    }
    const std::size_t begin = points.photo_idx.size();
    for (std::uint64_t j = 0; j < track; ++j) {
      points.photo_idx.push_back(reader.Read<std::uint32_t>("a point's track"));
      reader.Read<std::uint32_t>("a point's track");  // which of the image's observations
    }
    // An image may see a point twice.
    std::sort(points.photo_idx.begin() + begin, points.photo_idx.end());
    points.photo_idx.erase(std::unique(points.photo_idx.begin() + begin, points.photo_idx.end()),
                           points.photo_idx.end());
    points.position.push_back(p);
    points.color.push_back(color);
    points.error.push_back(error >= 0 ? static_cast<float>(error) : -1.0f);
    points.photo_begin.push_back(points.photo_idx.size());
  }
  reader.ExpectEnd("points");
}

}  // namespace sherd
