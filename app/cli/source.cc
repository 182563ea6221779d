#include "app/cli/source.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <utility>

#include "app/project/format.h"
#include "metaball/error.h"
#include "metaball/median.h"
#include "metaball/metaball_file.h"
#include "metaball/progress_range.h"
#include "metaball/thesis_file.h"
#include "reconstruction/level.h"
#include "reconstruction/mesh_import.h"
#include "reconstruction/mesh_points.h"
#include "reconstruction/ply.h"

namespace sherd::cli {
namespace {

namespace fs = std::filesystem;

// Files of 32-bit numbers far from the origin lost digits before they came here.
void WarnOfFloats(const std::string& path, Source* source) {
  if (source->cloud->empty()) return;
  const Vec3d& o = source->cloud->frame.origin;
  const double far = std::max({std::abs(o.x), std::abs(o.y), std::abs(o.z)});
  if (!(far > 1e4)) return;
  source->warnings.push_back(path + ": coordinates near " + FormatNumber(far) +
                             " are stored as 32-bit numbers, in steps of about " +
                             FormatNumber(far * 0x1p-24, 2) +
                             " units: precision was lost before this program read them");
}

// Missing radii come from the spacing of the points.
void BuildFrom(const std::string& path, CloudInput input, const SourceOptions& options,
               const Control& control, Source* source) {
  control.ThrowIfStopped();
  if (input.radius.empty() && !input.center.empty()) {
    control.Report("radii from the spacing of the points", 0.5);
    input.radius = RadiiFromSpacing(input.center, options.radius_factor.value_or(0.0));
    control.ThrowIfStopped();
  }
  CloudReport report;
  source->cloud = std::make_shared<const Cloud>(BuildCloud(input, &report));
  source->dropped = report.dropped_not_finite + report.dropped_radius;
  if (source->dropped > 0) {
    source->warnings.push_back(path + ": " + FormatGrouped(source->dropped) +
                               " metaballs cannot be drawn and were left out (no finite position, "
                               "or no positive radius)");
  }
}

Channel NormalChannel(const std::vector<Vec3f>& normals) {
  Channel channel("normal", ChannelType::kOctahedral, 3, normals.size());
  for (std::size_t i = 0; i < normals.size(); ++i) {
    channel.Set(i, {{normals[i].x, normals[i].y, normals[i].z, 0}});
  }
  return channel;
}

Source OpenPly(const std::string& path, const SourceOptions& options, const Control& control) {
  Source source;
  PlyCloud ply = ReadPly(path, PartOf(control, 0, 0.5));
  CloudInput input;
  input.center = std::move(ply.position);
  input.color = std::move(ply.color);
  input.radius = std::move(ply.radius);
  if (options.channels && !ply.normal.empty()) input.channels = {NormalChannel(ply.normal)};
  BuildFrom(path, std::move(input), options, control, &source);
  if (ply.float_positions) WarnOfFloats(path, &source);
  return source;
}

Source OpenMesh(const std::string& path, const SourceOptions& options, const Control& control) {
  Source source;
  control.Report("reading the mesh", 0);
  const ImportedMesh mesh = ReadMesh(path, control);
  source.texture = mesh.TextureName();
  MeshPoints points = options.samples > 0 ? PointsOnTriangles(mesh, options.samples, control)
                                          : PointsAtVertices(mesh, control);
  source.warnings = points.warnings;
  BuildFrom(path, ToMetaballs(std::move(points)), options, control, &source);
  WarnOfFloats(path, &source);
  return source;
}

Source OpenThesisFile(const std::string& path) {
  Source source;
  ThesisScene scene = SceneOfThesis(ReadThesisFile(path), path);
  source.cloud = std::make_shared<const Cloud>(std::move(scene.cloud));
  source.surface = scene.surface;
  source.texture = std::move(scene.color_texture);
  source.normal_map_texture = std::move(scene.normal_map_texture);
  return source;
}

Source OpenMetaballFile(const std::string& path) {
  Source source;
  MetaballFile file = ReadMetaballFile(path);
  source.surface = file.SurfaceOf();
  source.cloud = std::make_shared<const Cloud>(std::move(file.cloud));
  return source;
}

Source OpenProject(const std::string& path, const SourceOptions& options, const Control& control) {
  Source source;
  source.project = Project::Open(path);
  const std::string name =
      options.level.empty() ? source.project->LargestLevel().name : options.level;
  source.level = source.project->LoadLevel(name, PartOf(control, 0, 0.5));
  source.cloud = std::shared_ptr<const Cloud>(source.level, &source.level->cloud);
  source.surface.threshold = source.level->stats.threshold;
  if (options.channels && !source.level->normal.empty()) {
    auto cloud = std::make_shared<Cloud>(*source.cloud);
    cloud->channels.push_back(NormalChannel(source.level->normal));
    source.cloud = std::move(cloud);
  }
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
                     "give a project (.sherd), a metaball file, a .ply file or a mesh");
  }
  in.read(begin, 4);
  if (IsMetaballFile(path)) return SourceKind::kMetaballFile;
  if (begin[0] == 'p' && begin[1] == 'l' && begin[2] == 'y' &&
      (begin[3] == '\n' || begin[3] == '\r' || begin[3] == ' ')) {
    return SourceKind::kPly;
  }
  if (IsThesisFileName(path)) return SourceKind::kThesisFile;
  if (IsMeshFileName(path)) return SourceKind::kMesh;
  // A damaged project is still one by its name: its own reader says where the damage is.
  if (Project::IsProjectFile(path) || path.ends_with(".sherd")) return SourceKind::kProject;
  throw InputError(path, "", "is neither a project, a metaball file, a mesh nor a .ply file",
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
  const bool has_triangles = kind == SourceKind::kMesh || kind == SourceKind::kPly;
  if (options.samples > 0 && !has_triangles) {
    throw InputError(path, "", "has no triangles to take points from",
                     "leave --samples out, or give a mesh");
  }
  Source source;
  switch (kind) {
    case SourceKind::kProject:
      source = OpenProject(path, options, control);
      break;
    case SourceKind::kMetaballFile:
      source = OpenMetaballFile(path);
      break;
    case SourceKind::kThesisFile:
      source = OpenThesisFile(path);
      break;
    case SourceKind::kPly:
      source =
          options.samples > 0 ? OpenMesh(path, options, control) : OpenPly(path, options, control);
      break;
    case SourceKind::kMesh:
      source = OpenMesh(path, options, control);
      break;
  }
  if (kind != SourceKind::kProject) source.view = ViewOf(*source.cloud);
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
    const double radius = cloud.frame.unit * Median(std::move(radii));
    box.min = box.min - Vec3d{radius, radius, radius};
    box.max = box.max + Vec3d{radius, radius, radius};
  }
  return view;
}

}  // namespace sherd::cli
