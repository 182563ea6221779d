#include "app/project/survey_file.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/project/checked_file.h"
#include "metaball/error.h"

namespace sherd {
namespace {

static_assert(sizeof(Vec3d) == 24 && sizeof(Vec3f) == 12 && sizeof(Rgb8) == 3);

constexpr char kSurveyMagic[] = "SHERDSV\n";
constexpr char kOutlineMagic[] = "SHERDOL\n";
constexpr char kLevelMagic[] = "SHERDLV\n";
constexpr std::uint32_t kSurveyVersion = 2, kOutlineVersion = 1, kLevelVersion = 2;
constexpr const char* kSurveyHint = "import the survey again";
constexpr const char* kLevelHint = "build the level again";

enum Channel : std::uint32_t {
  kColor = 1,
  kNormal = 2,
  kError = 4,
  kPhotographs = 8,
  kDense = 16,
  kDepth = 32,
};

// begin (n + 1 offsets) as n counts.
template <class T>
std::vector<std::uint32_t> CountsOf(const std::vector<T>& begin) {
  std::vector<std::uint32_t> counts(begin.size() - 1);
  for (std::size_t i = 0; i < counts.size(); ++i) {
    counts[i] = static_cast<std::uint32_t>(begin[i + 1] - begin[i]);
  }
  return counts;
}

// Reads counts and indices below `photographs`.
template <class T, class Index>
void ReadPhotographs(CheckedReader* in, std::uint64_t n, std::uint64_t photographs,
                     std::vector<T>* begin, std::vector<Index>* idx, const Control& control) {
  const auto total = in->Value<std::uint64_t>();
  if (total > std::numeric_limits<T>::max()) in->Fail("has too many photographs of points");
  std::vector<std::uint32_t> counts;
  in->Array(n, &counts, control);
  begin->resize(static_cast<std::size_t>(n) + 1);
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    (*begin)[i] = static_cast<T>(sum);
    sum += counts[i];
    if (sum > total) break;
  }
  if (sum != total) in->Fail("contradicts itself about the photographs of its points");
  begin->back() = static_cast<T>(sum);
  in->Array(total, idx, control);
  for (const Index i : *idx) {
    if (i >= photographs) {
      in->Fail("names photograph " + std::to_string(i) + " of " + std::to_string(photographs));
    }
  }
}

void WriteRecords(const Survey& survey, CheckedWriter* out) {
  out->Value(static_cast<std::uint32_t>(survey.cameras.size()));
  for (const SurveyCamera& camera : survey.cameras) {
    out->Value(camera.camera_id);
    out->Value(static_cast<std::int32_t>(camera.model));
    out->Value(camera.width);
    out->Value(camera.height);
    out->Value(static_cast<std::uint32_t>(camera.parameters.size()));
    out->Array(camera.parameters);
  }
  out->Value(static_cast<std::uint32_t>(survey.photographs.size()));
  for (const Photograph& photograph : survey.photographs) {
    out->Value(photograph.image_id);
    out->Value(photograph.camera_idx);
    const Rigid3d& pose = photograph.cam_from_world;
    for (const double v : {pose.qw, pose.qx, pose.qy, pose.qz, pose.translation.x,
                           pose.translation.y, pose.translation.z}) {
      out->Value(v);
    }
    out->Text(photograph.name);
    out->Text(photograph.path);
    out->Text(photograph.original_path);
    out->Value(photograph.original_camera_idx);
    out->Text(photograph.mask_path);
  }
}

void ReadRecords(CheckedReader* in, Survey* survey) {
  const auto cameras = in->Value<std::uint32_t>();
  in->Expect(cameras, 28);
  survey->cameras.resize(cameras);
  for (SurveyCamera& camera : survey->cameras) {
    camera.camera_id = in->Value<std::uint32_t>();
    const auto model = in->Value<std::int32_t>();
    const std::optional<int> parameters = NumParameters(model);
    if (!parameters) in->Fail("has a camera of the unknown model " + std::to_string(model));
    camera.model = static_cast<CameraModelId>(model);
    camera.width = in->Value<std::uint64_t>();
    camera.height = in->Value<std::uint64_t>();
    const auto count = in->Value<std::uint32_t>();
    if (count != static_cast<std::uint32_t>(*parameters)) {
      in->Fail("has a camera with " + std::to_string(count) + " parameters instead of " +
               std::to_string(*parameters));
    }
    in->Array(count, &camera.parameters, {});
  }
  const auto photographs = in->Value<std::uint32_t>();
  in->Expect(photographs, 80);
  survey->photographs.resize(photographs);
  for (Photograph& photograph : survey->photographs) {
    photograph.image_id = in->Value<std::uint32_t>();
    photograph.camera_idx = in->Value<std::uint32_t>();
    if (photograph.camera_idx >= cameras) {
      in->Fail("has a photograph of camera " + std::to_string(photograph.camera_idx) + " of " +
               std::to_string(cameras));
    }
    Rigid3d& pose = photograph.cam_from_world;
    for (double* v : {&pose.qw, &pose.qx, &pose.qy, &pose.qz, &pose.translation.x,
                      &pose.translation.y, &pose.translation.z}) {
      *v = in->Value<double>();
    }
    photograph.name = in->Text();
    photograph.path = in->Text();
    photograph.original_path = in->Text();
    photograph.original_camera_idx = in->Value<std::uint32_t>();
    if (photograph.original_camera_idx >= cameras) {
      in->Fail("has an original photograph of camera " +
               std::to_string(photograph.original_camera_idx) + " of " + std::to_string(cameras));
    }
    if (in->version() >= 2) photograph.mask_path = in->Text();
  }
}

template <class T>
bool Complete(const std::vector<T>& channel, std::size_t n) {
  return !channel.empty() && channel.size() == n;
}

}  // namespace

void WriteSurveyFile(const std::string& path, const Survey& survey, const Control& control) {
  const SurveyPoints& points = survey.points;
  const std::size_t n = points.size();
  CheckedWriter out(path, kSurveyMagic, kSurveyVersion);
  WriteRecords(survey, &out);
  std::uint32_t channels = 0;
  if (survey.dense) channels |= kDense;
  if (Complete(points.color, n)) channels |= kColor;
  if (Complete(points.normal, n)) channels |= kNormal;
  if (Complete(points.error, n)) channels |= kError;
  if (n > 0 && points.photo_begin.size() == n + 1) channels |= kPhotographs;
  out.Value(static_cast<std::uint64_t>(n));
  out.Value(channels);
  out.Value(survey.dense_pixel_offset);
  out.Array(points.position);
  control.ThrowIfStopped();
  if (channels & kColor) out.Array(points.color);
  if (channels & kNormal) out.Array(points.normal);
  control.ThrowIfStopped();
  if (channels & kError) out.Array(points.error);
  if (channels & kPhotographs) {
    out.Value(static_cast<std::uint64_t>(points.photo_idx.size()));
    out.Array(CountsOf(points.photo_begin));
    control.ThrowIfStopped();
    out.Array(points.photo_idx);
  }
  control.ThrowIfStopped();
  out.Commit();
}

Survey ReadSurveyFile(const std::string& path, const Control& control) {
  CheckedReader in(path, kSurveyMagic, kSurveyVersion, kSurveyHint);
  Survey survey;
  ReadRecords(&in, &survey);
  SurveyPoints& points = survey.points;
  const auto n = in.Value<std::uint64_t>();
  const auto channels = in.Value<std::uint32_t>();
  survey.dense = channels & kDense;
  survey.dense_pixel_offset = in.Value<double>();
  if (!std::isfinite(survey.dense_pixel_offset)) in.Fail("has a pixel offset that is not finite");
  in.Array(n, &points.position, control);
  if (channels & kColor) in.Array(n, &points.color, control);
  if (channels & kNormal) in.Array(n, &points.normal, control);
  if (channels & kError) in.Array(n, &points.error, control);
  if (channels & kPhotographs) {
    ReadPhotographs(&in, n, survey.photographs.size(), &points.photo_begin, &points.photo_idx,
                    control);
  }
  in.Finish();
  return survey;
}

void WriteOutlineFile(const std::string& path, const std::vector<Vec3d>& points) {
  CheckedWriter out(path, kOutlineMagic, kOutlineVersion);
  out.Value(static_cast<std::uint64_t>(points.size()));
  out.Array(points);
  out.Commit();
}

std::vector<Vec3d> ReadOutlineFile(const std::string& path) {
  CheckedReader in(path, kOutlineMagic, kOutlineVersion, kSurveyHint);
  std::vector<Vec3d> points;
  const auto n = in.Value<std::uint64_t>();
  in.Array(n, &points, {});
  in.Finish();
  return points;
}

void WriteLevelAttributes(const std::string& path, const Level& level) {
  const std::size_t n = level.cloud.size();
  CheckedWriter out(path, kLevelMagic, kLevelVersion);
  out.Text(level.name);
  std::uint32_t channels = 0;
  if (Complete(level.normal, n)) channels |= kNormal;
  if (n > 0 && level.photo_begin.size() == n + 1) channels |= kPhotographs;
  if (Complete(level.depth, n)) channels |= kDepth;
  out.Value(static_cast<std::uint64_t>(n));
  out.Value(channels);
  if (channels & kNormal) out.Array(level.normal);
  if (channels & kPhotographs) {
    out.Value(static_cast<std::uint64_t>(level.photo_idx.size()));
    out.Array(CountsOf(level.photo_begin));
    out.Array(level.photo_idx);
  }
  if (channels & kDepth) out.Array(level.depth);
  out.Commit();
}

void ReadLevelAttributes(const std::string& path, std::uint64_t photographs, Level* level,
                         const Control& control) {
  CheckedReader in(path, kLevelMagic, kLevelVersion, kLevelHint);
  level->name = in.Text();
  const auto n = in.Value<std::uint64_t>();
  if (n != level->cloud.size()) {
    in.Fail("belongs to " + std::to_string(n) + " metaballs, but the level has " +
            std::to_string(level->cloud.size()));
  }
  const auto channels = in.Value<std::uint32_t>();
  if (channels & kNormal) in.Array(n, &level->normal, control);
  if (channels & kPhotographs) {
    ReadPhotographs(&in, n, photographs, &level->photo_begin, &level->photo_idx, control);
  }
  if (channels & kDepth) {
    in.Array(n, &level->depth, control);
    if (!std::all_of(level->depth.begin(), level->depth.end(),
                     [](float d) { return std::isfinite(d); })) {
      in.Fail("holds a depth that is no number");
    }
  }
  in.Finish();
}

}  // namespace sherd
