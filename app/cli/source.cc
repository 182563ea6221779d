#include "app/cli/source.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "app/project/format.h"
#include "app/project/progress_range.h"
#include "metaball/error.h"
#include "metaball/metaball_file.h"
#include "reconstruction/level.h"
#include "reconstruction/ply.h"

namespace sherd::cli {
namespace {

namespace fs = std::filesystem;

Source OpenPly(const std::string& path, const SourceOptions& options, const Control& control) {
  Source source;
  PlyCloud ply = ReadPly(path, PartOf(control, 0, 0.5));
  control.ThrowIfStopped();
  CloudInput input;
  input.center = std::move(ply.position);
  input.color = std::move(ply.color);
  input.radius = std::move(ply.radius);
  if (input.radius.empty() && !input.center.empty()) {
    control.Report("radii from the spacing of the points", 0.5);
    // A point that is nowhere has no neighbours: it is left out before the spacing is measured.
    std::size_t kept = 0;
    for (std::size_t i = 0; i < input.center.size(); ++i) {
      if (!IsFinite(input.center[i])) continue;
      input.center[kept] = input.center[i];
      if (!input.color.empty()) input.color[kept] = input.color[i];
      ++kept;
    }
    source.dropped = input.center.size() - kept;
    input.center.resize(kept);
    if (!input.color.empty()) input.color.resize(kept);
    input.radius = RadiiFromSpacing(input.center, options.radius_factor.value_or(0.0));
  }
  control.ThrowIfStopped();
  CloudReport report;
  source.cloud = std::make_shared<const Cloud>(BuildCloud(input, &report));
  source.dropped += report.dropped_not_finite + report.dropped_radius;
  if (source.dropped > 0) {
    source.warnings.push_back(path + ": " + FormatGrouped(source.dropped) +
                              " metaballs cannot be drawn and were left out (no finite position, "
                              "or no positive radius)");
  }
  if (ply.float_positions && !source.cloud->empty()) {
    const Vec3d& o = source.cloud->frame.origin;
    const double far = std::max({std::abs(o.x), std::abs(o.y), std::abs(o.z)});
    if (far > 1e4) {
      source.warnings.push_back(path + ": coordinates near " + FormatNumber(far) +
                                " are stored as 32-bit numbers, in steps of about " +
                                FormatNumber(far * 0x1p-24, 2) +
                                " units: precision was lost before this program read them");
    }
  }
  return source;
}

Source OpenProject(const std::string& path, const SourceOptions& options, const Control& control) {
  Source source;
  source.project = Project::Open(path);
  const std::string name =
      options.level.empty() ? source.project->LargestLevel().name : options.level;
  source.level = source.project->LoadLevel(name, PartOf(control, 0, 0.5));
  source.cloud = std::shared_ptr<const Cloud>(source.level, &source.level->cloud);
  source.threshold = source.level->stats.threshold;
  if (options.survey) {
    source.survey =
        LoadSurveyWithPhotos(*source.project, options.photo_folder, PartOf(control, 0.5, 1));
  }
  source.view = source.project->MakeViewContext(source.survey.get());
  return source;
}

}  // namespace

SourceKind KindOf(const std::string& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) {
    throw InputError(path, "", "is a folder",
                     "import it first: sherd import " + path + " --project NAME.sherd");
  }
  std::ifstream in(path, std::ios::binary);
  char begin[4] = {};
  if (!in) {
    throw InputError(path, "", fs::exists(path, error) ? "cannot be opened" : "does not exist",
                     "give a project (.sherd), a metaball file or a .ply file");
  }
  in.read(begin, 4);
  if (IsMetaballFile(path)) return SourceKind::kMetaballFile;
  if (begin[0] == 'p' && begin[1] == 'l' && begin[2] == 'y' &&
      (begin[3] == '\n' || begin[3] == '\r' || begin[3] == ' ')) {
    return SourceKind::kPly;
  }
  // A damaged project is still one by its name: its own reader says where the damage is.
  if (Project::IsProjectFile(path) || path.ends_with(".sherd")) return SourceKind::kProject;
  throw InputError(path, "", "is neither a project, a metaball file nor a .ply file",
                   "a COLMAP workspace is imported first: sherd import");
}

Source OpenSource(const std::string& path, const SourceOptions& options, const Control& control) {
  control.Report("reading", 0);
  const SourceKind kind = KindOf(path);
  if (kind != SourceKind::kProject && !options.level.empty()) {
    throw InputError(path, "", "has no levels", "leave --level out, or give a project");
  }
  if (kind != SourceKind::kProject && options.survey) {
    throw InputError(path, "", "has no photographs",
                     "--photo and --color photo need a project; import the workspace first");
  }
  Source source;
  if (kind == SourceKind::kProject) {
    source = OpenProject(path, options, control);
  } else if (kind == SourceKind::kPly) {
    source = OpenPly(path, options, control);
    source.view = ViewOf(*source.cloud);
  } else {
    MetaballFile file = ReadMetaballFile(path);
    source.threshold = file.threshold;
    source.cloud = std::make_shared<const Cloud>(std::move(file.cloud));
    source.view = ViewOf(*source.cloud);
  }
  source.kind = kind;
  source.path = path;
  return source;
}

std::shared_ptr<const Survey> LoadSurveyWithPhotos(const Project& project,
                                                   const std::string& photo_folder,
                                                   const Control& control) {
  if (photo_folder.empty()) return project.LoadSurveyFromCache(control);
  std::error_code error;
  if (!fs::is_directory(photo_folder, error)) {
    throw InputError(photo_folder, "", "is no folder", "give the folder the photographs are in");
  }
  Project elsewhere = project;
  elsewhere.SetPhotoFolder(fs::absolute(photo_folder, error).string());
  return elsewhere.LoadSurveyFromCache(control);
}

ViewContext ViewOf(const Cloud& cloud) {
  // A million centres say as much as all.
  constexpr std::size_t kSample = 1'000'000;
  const std::size_t step = std::max<std::size_t>(1, cloud.size() / kSample);
  std::vector<Vec3d> centers;
  std::vector<float> radii;
  for (std::size_t i = 0; i < cloud.size(); i += step) {
    centers.push_back(cloud.frame.WorldFromLocal(cloud.center[i]));
    radii.push_back(cloud.RadiusOf(i));
  }
  ViewContext view;
  Box3d& box = view.bounds;
  box = RobustBounds(centers);
  view.points = SamplePoints(centers, box);
  if (!radii.empty()) {
    const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
    std::nth_element(radii.begin(), middle, radii.end());
    const double radius = cloud.frame.unit * *middle;
    box.min = box.min - Vec3d{radius, radius, radius};
    box.max = box.max + Vec3d{radius, radius, radius};
  }
  return view;
}

}  // namespace sherd::cli
