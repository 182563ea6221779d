// sherd info: what a workspace or file holds, and what is missing.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/cli/command.h"
#include "app/cli/look_options.h"
#include "app/cli/source.h"
#include "app/cli/summary.h"
#include "app/cli/table.h"
#include "app/project/format.h"
#include "app/project/project.h"
#include "metaball/metaball_file.h"
#include "metaball/thesis_file.h"
#include "reconstruction/mesh_import.h"
#include "reconstruction/workspace.h"

namespace sherd::cli {
namespace {

namespace fs = std::filesystem;

struct InfoOptions {
  std::string path;
  bool json = false;
};

// As seen from the folder that was asked about, where that is shorter.
std::string Shown(const std::string& path, const Workspace& workspace) {
  std::error_code error;
  const fs::path base = fs::absolute(workspace.path, error).lexically_normal();
  const fs::path relative = fs::absolute(path, error).lexically_normal().lexically_relative(base);
  if (relative.empty() || relative == ".") return path;
  return relative.begin()->string() == ".." ? path : relative.string();
}

Json WorkspaceJson(const Workspace& workspace) {
  Json models = Json::array(), clouds = Json::array(), meshes = Json::array(),
       folders = Json::array();
  const std::vector<std::size_t> numbers = ModelNumbers(workspace);
  for (std::size_t i = 0; i < workspace.models.size(); ++i) {
    const SparseModelFiles& m = workspace.models[i];
    models.push_back({{"model", numbers[i]},
                      {"folder", m.folder},
                      {"format", m.binary ? "binary" : "text"},
                      {"dense_workspace", m.dense_workspace},
                      {"cameras", m.cameras},
                      {"images", m.images},
                      {"points", m.points},
                      {"problem", m.problem.empty() ? Json() : Json(m.problem)}});
  }
  for (const DenseCloudFile& c : workspace.clouds) {
    clouds.push_back({{"file", c.path},
                      {"points", c.points},
                      {"normals", c.normals},
                      {"colors", c.colors},
                      {"radii", c.radii},
                      {"visibility", c.visibility_path.empty() ? Json() : Json(c.visibility_path)},
                      {"model", c.model_idx ? Json(numbers[*c.model_idx]) : Json()},
                      {"problem", c.problem.empty() ? Json() : Json(c.problem)}});
  }
  for (const MeshFile& m : workspace.meshes) {
    meshes.push_back({{"file", m.path},
                      {"vertices", m.vertices ? Json(*m.vertices) : Json()},
                      {"faces", m.faces ? Json(*m.faces) : Json()}});
  }
  for (const PhotoFolder& f : workspace.photo_folders) {
    folders.push_back({{"folder", f.path}, {"files", f.files}, {"bytes", f.bytes}});
  }
  return {{"kind", "workspace"},
          {"path", workspace.path},
          {"models", std::move(models)},
          {"clouds", std::move(clouds)},
          {"meshes", std::move(meshes)},
          {"photo_folders", std::move(folders)},
          {"depth_maps", workspace.depth_maps},
          {"normal_maps", workspace.normal_maps},
          {"missing", workspace.missing}};
}

std::string WorkspaceText(const Workspace& workspace) {
  std::string text = workspace.path + "\n";
  const std::vector<std::size_t> numbers = ModelNumbers(workspace);
  if (!workspace.models.empty()) {
    std::vector<std::vector<std::string>> rows = {
        {"model", "photographs", "points", "cameras", "format", "folder"}};
    for (std::size_t i = 0; i < workspace.models.size(); ++i) {
      const SparseModelFiles& m = workspace.models[i];
      const std::string folder = Shown(m.folder, workspace) +
                                 (m.dense_workspace ? " (undistorted)" : "") +
                                 (m.problem.empty() ? "" : "  UNREADABLE: " + OneLine(m.problem));
      rows.push_back({std::to_string(numbers[i]), FormatGrouped(m.images), FormatGrouped(m.points),
                      FormatGrouped(m.cameras), m.binary ? "binary" : "text", folder});
    }
    text += "Sparse models\n" + Table(rows, 2, {4, 5});
  }
  if (!workspace.clouds.empty()) {
    text += "Point clouds\n";
    std::vector<std::vector<std::string>> rows;
    for (const DenseCloudFile& c : workspace.clouds) {
      std::string channels = c.normals ? "normals" : "no normals";
      channels += c.colors ? ", colours" : ", no colours";
      if (c.radii) channels += ", radii";
      channels += c.visibility_path.empty() ? "" : ", which photographs see each point";
      if (IsMeshFileName(c.path)) channels = "to be taken of its surface";
      if (!c.problem.empty()) channels = "UNREADABLE: " + OneLine(c.problem);
      rows.push_back({Shown(c.path, workspace), FormatGrouped(c.points) + " points", channels});
    }
    text += Table(rows, 2, {2});
  }
  if (!workspace.meshes.empty()) {
    text += "Meshes\n";
    std::vector<std::vector<std::string>> rows;
    for (const MeshFile& m : workspace.meshes) {
      rows.push_back({Shown(m.path, workspace),
                      m.vertices ? FormatGrouped(*m.vertices) + " vertices" : "",
                      m.faces ? FormatGrouped(*m.faces) + " faces" : ""});
    }
    text += Table(rows);
  }
  if (!workspace.photo_folders.empty()) {
    text += "Photographs\n";
    std::vector<std::vector<std::string>> rows;
    for (const PhotoFolder& f : workspace.photo_folders) {
      rows.push_back(
          {Shown(f.path, workspace), FormatGrouped(f.files) + " files", FormatBytes(f.bytes)});
    }
    text += Table(rows);
  }
  if (workspace.depth_maps + workspace.normal_maps > 0) {
    text += "Maps\n" + Fields({{"depth maps", FormatGrouped(workspace.depth_maps)},
                               {"normal maps", FormatGrouped(workspace.normal_maps)}});
  }
  if (!workspace.missing.empty()) {
    text += "Missing\n";
    for (const std::string& line : workspace.missing) text += "  " + OneLine(line) + "\n";
  }
  return text;
}

int InfoMetaballs(const InfoOptions& options) {
  const Source source = OpenSource(options.path, {}, {});
  const Cloud& cloud = *source.cloud;
  const Surface& surface = source.surface;
  Json channels = Json::array();
  std::string channel_names;
  for (const Channel& channel : cloud.channels) {
    channels.push_back({{"name", channel.name()}, {"components", channel.components()}});
    channel_names += (channel_names.empty() ? "" : ", ") + channel.name();
  }
  float smallest = 0, largest = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const float r = cloud.RadiusOf(i);
    smallest = i == 0 ? r : std::min(smallest, r);
    largest = std::max(largest, r);
  }
  const double unit = cloud.frame.unit;
  const Box3f local = cloud.CenterBox();
  const Vec3d lo = cloud.frame.WorldFromLocal(local.min);
  const Vec3d hi = cloud.frame.WorldFromLocal(local.max);
  if (options.json) {
    PrintJson({{"kind", "metaballs"},
               {"path", options.path},
               {"metaballs", cloud.size()},
               {"threshold", surface.threshold},
               {"thresholds", !cloud.threshold.empty()},
               {"threshold_mode", NameOf(surface.mode)},
               {"density", TextOf(surface.density)},
               {"radius_min", smallest * unit},
               {"radius_max", largest * unit},
               {"colors", !cloud.color.empty()},
               {"channels", channels},
               {"bounds", {{"min", ToJson(lo)}, {"max", ToJson(hi)}}},
               {"bytes", cloud.MemoryBytes()}});
    return kSuccess;
  }
  const Vec3d size = hi - lo;
  Print(options.path + "\n" +
        Fields({{"metaballs", FormatGrouped(cloud.size())},
                {"radius", FormatNumber(smallest * unit) +
                               (largest > smallest ? " to " + FormatNumber(largest * unit) : "") +
                               " units"},
                {"threshold", cloud.threshold.empty() ? FormatNumber(surface.threshold)
                                                      : "one each, " + NameOf(surface.mode)},
                {"density", TextOf(surface.density)},
                {"colours", cloud.color.empty() ? "one for all" : "one each"},
                {"further channels", channel_names},
                {"extent", FormatNumber(size.x) + " x " + FormatNumber(size.y) + " x " +
                               FormatNumber(size.z) + " units"},
                {"memory", FormatBytes(cloud.MemoryBytes())}}));
  return kSuccess;
}

int RunInfo(const InfoOptions& options) {
  std::error_code error;
  if (fs::is_regular_file(options.path, error)) {
    if (IsMetaballFile(options.path) || IsThesisFileName(options.path)) {
      return InfoMetaballs(options);
    }
    if (Project::IsProjectFile(options.path) || options.path.ends_with(".sherd")) {
      const Project project = Project::Open(options.path);
      if (options.json) {
        Json json = {{"kind", "project"}};
        json.update(ToJson(project));
        PrintJson(json);
      } else {
        const std::string levels = DescribeLevels(project);
        Print(options.path + "\n" + DescribeImport(project) +
              (levels.empty() ? "  no levels yet: sherd build " + options.path +
                                    " --levels 63k,126k,252k,502k\n"
                              : levels));
      }
      return kSuccess;
    }
  }
  const Workspace workspace = InspectWorkspace(options.path);
  if (options.json) {
    PrintJson(WorkspaceJson(workspace));
  } else {
    Print(WorkspaceText(workspace));
  }
  return kSuccess;
}

}  // namespace

void AddInfo(CLI::App* program, Action* action) {
  auto options = std::make_shared<InfoOptions>();
  CLI::App* app = program->add_subcommand(
      "info", "Say what a workspace, project or file holds, and what is missing.");
  app->add_option("PATH", options->path,
                  "a COLMAP workspace at any level, a project, a metaball file, a .ply, a mesh")
      ->required();
  app->add_flag("--json", options->json, "print JSON");
  app->footer(
      "Examples:\n"
      "  sherd info trench_colmap\n"
      "  sherd info trench.sherd --json");
  app->callback(
      [options, action] { *action = [options](const Environment&) { return RunInfo(*options); }; });
}

}  // namespace sherd::cli
