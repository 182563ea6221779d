// sherd export: a surface or its metaballs for other programs; the way between the file formats.
#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/cli/command.h"
#include "app/cli/look_options.h"
#include "app/cli/option_types.h"
#include "app/cli/progress.h"
#include "app/cli/source.h"
#include "app/project/format.h"
#include "metaball/atomic_file.h"
#include "metaball/error.h"
#include "metaball/mesh/mesh.h"
#include "metaball/metaball_file.h"
#include "metaball/povray_export.h"
#include "metaball/progress_range.h"
#include "metaball/thesis_file.h"
#include "reconstruction/level.h"
#include "reconstruction/mesh_import.h"
#include "reconstruction/photographs.h"

namespace sherd::cli {
namespace {

using Clock = std::chrono::steady_clock;

struct ExportOptions {
  std::string source, out, level, texture, samples;
  std::optional<double> radius_factor, cell, cell_radii;
  bool json = false;
  LookOptions look;
  // Which options have a meaning only for which outputs; filled when the command is added.
  std::vector<const CLI::Option*> of_mesh, of_povray;
};

enum class Output { kPly, kObj, kPovRay, kMetaballs, kThesis };

Output OutputOf(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  if (extension == ".ply") return Output::kPly;
  if (extension == ".obj") return Output::kObj;
  if (extension == ".pov") return Output::kPovRay;
  if (extension == kMetaballExtension) return Output::kMetaballs;
  if (IsThesisFileName(path)) return Output::kThesis;
  throw OutputError(path,
                    "its extension must be .ply or .obj (mesh), .pov (POV-Ray), .metaballs, or "
                    ".mbt or .mbb (the thesis's text and binary files)");
}

void RefuseOptionsOfOthers(const ExportOptions& options, Output output) {
  const auto refuse = [&](const std::vector<const CLI::Option*>& of, const char* what) {
    for (const CLI::Option* option : of) {
      if (option->count() == 0) continue;
      throw InputError("", "", option->get_name() + " has a meaning for " + what + " only",
                       "leave it out, or choose another extension for " + options.out);
    }
  };
  if (output != Output::kPly && output != Output::kObj) refuse(options.of_mesh, "meshes");
  if (output != Output::kPovRay) refuse(options.of_povray, "a .pov file");
}

double CellSize(const ExportOptions& options, const Scene& scene) {
  if (options.cell) return *options.cell;
  // The default is half a radius.
  const double half = DefaultCellSize(scene);
  return options.cell_radii ? 2 * half * *options.cell_radii : half;
}

// What was written, for people and as JSON.
struct Report {
  std::string text;
  Json json;
};

Report ExportMesh(const ExportOptions& options, Output output, const Scene& scene,
                  const std::string& texture, const Control& control) {
  MeshOptions mesh_options;
  mesh_options.cell_size = CellSize(options, scene);
  const SurfaceMesh mesh = ExtractMesh(scene, mesh_options, control);
  control.ThrowIfStopped();
  if (output == Output::kPly) {
    WritePlyMesh(options.out, mesh, texture);
  } else {
    WriteObjMesh(options.out, mesh, texture);
  }
  if (mesh.triangle.empty()) {
    Warn(
        "the mesh is empty: nowhere does the field reach the threshold at a grid point (lower "
        "--threshold, raise --radius-scale or choose a smaller cell)");
  }
  return {FormatGrouped(mesh.position.size()) + " vertices, " +
              FormatGrouped(mesh.triangle.size()) + " triangles, cell " +
              FormatNumber(mesh_options.cell_size),
          {{"kind", "mesh"},
           {"vertices", mesh.position.size()},
           {"triangles", mesh.triangle.size()},
           {"cell_size", mesh_options.cell_size},
           {"texture_coordinates", !mesh.uv.empty()}}};
}

Report ExportPovRay(const ExportOptions& options, const Scene& scene, const ViewContext& view) {
  Size size{1280, 720};
  if (options.look.size) {
    size = *options.look.size;
  } else if (!options.look.photo.empty()) {
    const Camera own =
        CameraOfPhotograph(*view.survey, FindPhotograph(*view.survey, options.look.photo));
    size = {own.width, own.height};
  }
  const Camera camera = MakeCamera(view, options.look.Request(false), size.width, size.height);
  WritePovRay(options.out, scene, camera);
  return {"POV-Ray scene for +W" + std::to_string(size.width) + " +H" + std::to_string(size.height),
          {{"kind", "povray"}, {"camera", ToJson(camera)}}};
}

Report ExportMetaballs(const ExportOptions& options, Output output, const Scene& scene,
                       const Source& source) {
  if (output == Output::kMetaballs) {
    WriteMetaballFile(options.out, *scene.cloud, scene.surface);
    return {"metaball file", {{"kind", "metaballs"}}};
  }
  if (TextOf(scene.surface.density) != TextOf({})) {
    Warn("the thesis's file says nothing of densities: " + TextOf(scene.surface.density) +
         " is not kept");
  }
  ThesisScene thesis;
  thesis.cloud = *scene.cloud;
  thesis.surface = scene.surface;
  thesis.color_texture = options.texture.empty() ? source.texture : options.texture;
  thesis.normal_map_texture = source.normal_map_texture;
  // Radii as they are drawn: the file has no scale beside them.
  const auto scale = static_cast<float>(scene.surface.radius_scale);
  for (float& r : thesis.cloud.radius) r *= scale;
  thesis.cloud.uniform_radius *= scale;
  const ThesisFile file = ThesisOf(thesis);
  WriteThesisFile(options.out, file);
  return {"the thesis's file, flags " + std::to_string(file.flags),
          {{"kind", "thesis"}, {"flags", file.flags}}};
}

int RunExport(const ExportOptions& options, const Environment& environment) {
  const Clock::time_point start = Clock::now();
  const Output output = OutputOf(options.out);
  RefuseOptionsOfOthers(options, output);
  // A folder that cannot be written is found out before the work.
  { AtomicFile probe(options.out); }
  Progress progress(environment.stop);
  SourceOptions source_options;
  source_options.level = options.level;
  source_options.survey = !options.look.photo.empty();
  source_options.photo_folder = options.look.photo_folder;
  source_options.radius_factor = options.radius_factor;
  source_options.samples = options.samples.empty() ? 0 : ParseCount(options.samples);
  source_options.channels = output == Output::kMetaballs || output == Output::kThesis;
  const Source source =
      OpenSource(options.source, source_options, PartOf(progress.control(), 0, 0.3));
  progress.Clear();
  for (const std::string& warning : source.warnings) Warn(warning);

  const Scene scene{source.cloud, options.look.SurfaceOf(source.surface), options.look.Light()};
  Report report;
  switch (output) {
    case Output::kPly:
    case Output::kObj:
      report = ExportMesh(options, output, scene,
                          options.texture.empty() ? source.texture : options.texture,
                          PartOf(progress.control(), 0.3, 1));
      break;
    case Output::kPovRay:
      report = ExportPovRay(options, scene, source.view);
      break;
    case Output::kMetaballs:
    case Output::kThesis:
      report = ExportMetaballs(options, output, scene, source);
      break;
  }
  progress.Clear();
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  if (options.json) {
    Json json = {{"source", options.source},
                 {"out", options.out},
                 {"metaballs", source.cloud->size()},
                 {"metaballs_dropped", source.dropped}};
    json.update(report.json);
    json["seconds"] = seconds;
    json["peak_memory_bytes"] = PeakMemory();
    PrintJson(json);
  } else {
    Print(options.out + ": " + report.text + ", from " + FormatGrouped(source.cloud->size()) +
          " metaballs, " + FormatSeconds(seconds) + "\n");
  }
  return kSuccess;
}

}  // namespace

void AddExport(CLI::App* program, Action* action) {
  auto options = std::make_shared<ExportOptions>();
  CLI::App* app = program->add_subcommand(
      "export", "Write a surface as a mesh or POV-Ray scene, or its metaballs in another format.");
  app->alias("convert");
  app->add_option("SOURCE", options->source,
                  "a project, a metaball file (.metaballs, .mbt, .mbb), a point cloud (.ply) or a "
                  "mesh (.ply, " +
                      MeshExtensionList() + ")")
      ->required();
  app->add_option("OUT", options->out,
                  "by its extension: .ply, .obj (mesh), .pov (POV-Ray), .metaballs, .mbt, .mbb")
      ->required();
  app->add_option("--level", options->level, "level of a project [default: the largest]")
      ->type_name("63k");
  AddSetting(app, "radius-factor", &options->radius_factor, "F");
  AddParsed(app, "--samples",
            "of a mesh: so many points spread over its triangles by area [default: its vertices]",
            [options = options.get()](const std::string& text) {
              if (ParseCount(text) == 0) throw InputError("", "", "the count must be above 0");
              options->samples = text;
            })
      ->type_name("63k");
  app->add_option(
         "--texture", options->texture,
         "the image that texture coordinates belong to [default: the one the source names]")
      ->type_name("NAME");
  AddSurfaceOptions(app, &options->look);

  constexpr const char* kMesh = "Mesh (.ply, .obj)";
  auto* cell = app->add_option("--cell", options->cell, "size of a grid cell, world units")
                   ->type_name("C")
                   ->check(CLI::PositiveNumber)
                   ->group(kMesh);
  auto* radii =
      app->add_option("--cell-radii", options->cell_radii, "the same in median radii [default 0.5]")
          ->type_name("K")
          ->check(CLI::PositiveNumber)
          ->excludes(cell)
          ->group(kMesh);
  options->of_mesh = {cell, radii};

  // What is added from here on is of the .pov file alone.
  const auto before = app->get_options().size();
  AddSize(app, &options->look.size,
          "the picture's, pixels [default 1280x720; with --photo the photograph's]")
      ->group("Camera");
  AddCameraOptions(app, &options->look);
  AddLightOptions(app, &options->look);
  const auto all = app->get_options();
  options->of_povray.assign(all.begin() + static_cast<std::ptrdiff_t>(before), all.end());

  app->add_flag("--json", options->json, "print JSON");
  app->footer(
      "Camera and light are those of a .pov file.\n"
      "Examples:\n"
      "  sherd export trench.sherd trench.ply --level 252k --cell-radii 0.4\n"
      "  sherd export trench.sherd trench.pov --view top --ortho --size 1920x1080\n"
      "  sherd export vase.glb vase.metaballs --samples 250k");
  app->callback([options, action] {
    *action = [options](const Environment& environment) {
      return RunExport(*options, environment);
    };
  });
}

}  // namespace sherd::cli
