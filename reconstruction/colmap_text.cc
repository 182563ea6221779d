// cameras.txt, images.txt, points3D.txt (colmap_formats 2.6).
#include <algorithm>

#include "metaball/error.h"
#include "reconstruction/colmap_model.h"
#include "reconstruction/text_reader.h"

namespace sherd {
namespace {

constexpr std::uint64_t kCancelInterval = 1 << 12;

std::string At(const TextReader& reader) { return "line " + std::to_string(reader.line_number()); }

// The next line that is neither blank nor a comment, trimmed.
bool ReadRecord(TextReader* reader, std::string_view* line) {
  while (reader->ReadLine(line)) {
    if (reader->line_number() == 1 && line->starts_with("\xef\xbb\xbf")) {
      line->remove_prefix(3);  // the mark an editor put there
    }
    *line = Trimmed(*line);
    if (!line->empty() && line->front() != '#') return true;
  }
  return false;
}

// The line of an image's observations is not needed, but it must be one: a file without these
// lines would otherwise lose every second image in silence.
void CheckObservationLine(const TextReader& reader, std::string_view line) {
  if (!line.empty() && line.front() == '#') return;
  std::uint64_t tokens = 0;
  bool in_token = false;
  for (const char c : line) {
    const bool blank = c == ' ' || c == '\t';
    if (!blank && !in_token) ++tokens;
    in_token = !blank;
    const bool number =
        (c >= '0' && c <= '9') || c == '.' || c == '-' || c == '+' || c == 'e' || c == 'E' || blank;
    if (number || c == 'n' || c == 'a' || c == 'i' || c == 'f') continue;
    reader.Fail("the line after an image's must hold its observations, X Y POINT3D_ID each",
                c == ',' ? "a decimal comma: write the model again with decimal points (COLMAP "
                           "4.0.3 or newer, or LC_NUMERIC=C), or as .bin"
                         : "an image without observations needs an empty line there");
  }
  if (tokens % 3 != 0) {
    reader.Fail("an image's observations must be triples, X Y POINT3D_ID (" +
                    std::to_string(tokens) + " values found)",
                "an image without observations needs an empty line there");
  }
}

}  // namespace

void ReadCamerasText(const std::string& path, ColmapModel* model) {
  TextReader reader(path);
  std::string_view line;
  while (ReadRecord(&reader, &line)) {
    TokenReader tokens(reader, line);
    SurveyCamera camera;
    camera.camera_id = tokens.Number<std::uint32_t>("CAMERA_ID");
    const std::string_view name = tokens.Token("MODEL");
    const std::optional<CameraModelId> id = CameraModelFromName(name);
    if (!id) {
      // Here the record's end is known: only this camera is lost.
      ++model->cameras_of_unknown_model;
      model->unknown_model_name = std::string(name.substr(0, 60));
      continue;
    }
    camera.model = *id;
    camera.width = tokens.Number<std::uint64_t>("WIDTH");
    camera.height = tokens.Number<std::uint64_t>("HEIGHT");
    const int expected = *NumParameters(static_cast<int>(*id));
    for (int i = 0; i < expected; ++i) {
      camera.parameters.push_back(tokens.Number<double>("a camera parameter"));
    }
    if (!tokens.AtEnd()) {
      reader.Fail(std::string(name) + " has " + std::to_string(expected) +
                  " parameters, but more follow");
    }
    CheckCamera(path, At(reader), camera);
    model->cameras.push_back(std::move(camera));
  }
}

void ReadImagesText(const std::string& path, ColmapModel* model, const Control& control) {
  TextReader reader(path);
  std::string_view line;
  while (ReadRecord(&reader, &line)) {
    control.ThrowIfStopped();
    TokenReader tokens(reader, line);
    ColmapImage image;
    image.image_id = tokens.Number<std::uint32_t>("IMAGE_ID");
    Rigid3d& pose = image.cam_from_world;
    pose.qw = tokens.Number<double>("QW");
    pose.qx = tokens.Number<double>("QX");
    pose.qy = tokens.Number<double>("QY");
    pose.qz = tokens.Number<double>("QZ");
    pose.translation.x = tokens.Number<double>("TX");
    pose.translation.y = tokens.Number<double>("TY");
    pose.translation.z = tokens.Number<double>("TZ");
    CheckPose(path, At(reader), &pose);
    image.camera_id = tokens.Number<std::uint32_t>("CAMERA_ID");
    // To the end of the line: names may hold blanks, which COLMAP writes as they are.
    image.name = std::string(tokens.Rest());
    if (image.name.empty()) reader.Fail("the line ends before NAME");
    model->images.push_back(std::move(image));
    // The very next line, empty or not, is the image's; at the end of the file it may be missing.
    if (!reader.ReadLine(&line)) break;
    CheckObservationLine(reader, Trimmed(line));
  }
}

void ReadPointsText(const std::string& path, const ColmapReadOptions& options, ColmapModel* model,
                    const Control& control) {
  std::uint64_t count = 0;
  if (options.decimate_to > 0) {
    TextReader counter(path);
    std::string_view line;
    while (ReadRecord(&counter, &line)) {
      if (++count % kCancelInterval == 0) control.ThrowIfStopped();
    }
  }
  Thinning thinning(count, options.decimate_to);
  TextReader reader(path);
  SurveyPoints& points = model->points;
  points.photo_begin.push_back(0);
  std::string_view line;
  for (std::uint64_t i = 0; ReadRecord(&reader, &line); ++i) {
    if (i % kCancelInterval == 0) {
      control.ThrowIfStopped();
      control.Report("reading points", static_cast<double>(reader.position()) / reader.size());
    }
    TokenReader tokens(reader, line);
    tokens.Number<std::uint64_t>("POINT3D_ID");
    Vec3d p;
    p.x = tokens.Number<double>("X");
    p.y = tokens.Number<double>("Y");
    p.z = tokens.Number<double>("Z");
    Rgb8 color;
    color.r = tokens.Number<std::uint8_t>("R");
    color.g = tokens.Number<std::uint8_t>("G");
    color.b = tokens.Number<std::uint8_t>("B");
    const auto error = tokens.Number<double>("ERROR");
    const bool keep = thinning.Keep(i);
    if (!IsFinite(p)) ++model->points_not_finite;
    const std::size_t begin = points.photo_idx.size();
    while (!tokens.AtEnd()) {
      const auto image_id = tokens.Number<std::uint32_t>("IMAGE_ID of a track");
      tokens.Number<std::uint32_t>("POINT2D_IDX of a track");
      if (keep) points.photo_idx.push_back(image_id);
    }
    if (!keep) continue;
    if (!IsFinite(p)) {
      points.photo_idx.resize(begin);
      continue;
    }
    std::sort(points.photo_idx.begin() + begin, points.photo_idx.end());
    points.photo_idx.erase(std::unique(points.photo_idx.begin() + begin, points.photo_idx.end()),
                           points.photo_idx.end());
    points.position.push_back(p);
    points.color.push_back(color);
    points.error.push_back(error >= 0 ? static_cast<float>(error) : -1.0f);
    points.photo_begin.push_back(points.photo_idx.size());
  }
}

}  // namespace sherd
