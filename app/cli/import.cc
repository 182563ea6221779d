// sherd import: a COLMAP workspace becomes a project.
#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/cli/command.h"
#include "app/cli/option_types.h"
#include "app/cli/progress.h"
#include "app/cli/summary.h"
#include "app/project/format.h"
#include "app/project/project.h"
#include "metaball/error.h"
#include "reconstruction/mesh_import.h"

namespace sherd::cli {
namespace {

struct Options {
  std::string path, project, photos, masks, decimate, samples, memory_limit, transform;
  std::optional<std::size_t> model;
  std::optional<double> metres_per_unit;
  std::optional<KnownDistance> known_distance;
  std::optional<Vec3d> up;
  bool dense = false, sparse = false, depth_maps = false, vertices = false, json = false;
};

// The model the user's number means.
std::size_t ModelIndex(const std::string& path, std::size_t number) {
  const Workspace workspace = InspectWorkspace(path);
  const std::vector<std::size_t> numbers = ModelNumbers(workspace);
  const auto it = std::find(numbers.begin(), numbers.end(), number);
  if (it != numbers.end()) return static_cast<std::size_t>(it - numbers.begin());
  std::string all;
  for (const std::size_t n : numbers) all += (all.empty() ? "" : ", ") + std::to_string(n);
  throw InputError(path, "", "has no model " + std::to_string(number),
                   numbers.empty() ? "it has no sparse model at all"
                                   : "its models are " + all + " (see sherd info)");
}

int RunImport(const Options& options, const Environment& environment) {
  ImportOptions import;
  import.source = options.path;
  import.photo_folder = options.photos;
  import.mask_folder = options.masks;
  if (options.model) import.model = ModelIndex(options.path, *options.model);
  import.points = options.dense        ? PointSource::kDense
                  : options.sparse     ? PointSource::kSparse
                  : options.depth_maps ? PointSource::kDepthMaps
                                       : PointSource::kAuto;
  import.metres_per_unit = options.metres_per_unit;
  import.known_distance = options.known_distance;
  import.transform = options.transform;
  import.up = options.up;
  if (!options.decimate.empty()) import.decimate_to = ParseCount(options.decimate);
  if (options.vertices) import.mesh_samples = 0;
  if (!options.samples.empty()) import.mesh_samples = ParseCount(options.samples);
  if (!options.memory_limit.empty()) {
    import.memory_limit_bytes = ParseCount(options.memory_limit) << 20;
  }
  Progress progress(environment.stop);
  const Project project = ImportSurvey(import, options.project, progress.control());
  progress.Clear();
  if (options.json) {
    Json json = ToJson(project);
    json["peak_memory_bytes"] = PeakMemory();
    PrintJson(json);
  } else {
    Print("Imported into " + options.project + " in " +
          FormatSeconds(project.import_summary().seconds) + " (peak memory " +
          FormatBytes(PeakMemory()) + ")\n" + DescribeImport(project) + "Next: sherd build " +
          options.project + " --levels 63k,126k,252k,502k\n");
  }
  return kSuccess;
}

}  // namespace

void AddImport(CLI::App* program, Action* action) {
  auto options = std::make_shared<Options>();
  CLI::App* app = program->add_subcommand(
      "import", "Import a COLMAP workspace, a point cloud or a mesh into a project.");
  app->add_option(
         "PATH", options->path,
         std::string("a workspace at any level: its folder, sparse/, dense/; a .ply; a mesh (") +
             MeshExtensionList() + ")")
      ->required();
  app->add_option("--project", options->project,
                  "the project to make; an earlier one is replaced once the import has succeeded")
      ->required()
      ->type_name("P.sherd");
  app->add_option("--photos", options->photos,
                  "folder where the photographs are (found by relative name)")
      ->type_name("DIR");
  app->add_option("--masks", options->masks,
                  "folder of the photographs' masks, sub/a.jpg.png for sub/a.jpg: what is black "
                  "there is not looked at")
      ->type_name("DIR");
  app->add_option_function<std::uint64_t>(
         "--model", [options](const std::uint64_t& n) { options->model = n; },
         "the sparse model to use, as \"sherd info\" numbers them [default: the largest]")
      ->type_name("N");
  auto* dense = app->add_flag("--dense", options->dense, "points of the dense cloud (fused.ply)");
  auto* maps = app->add_flag("--depth-maps", options->depth_maps,
                             "points of the depth maps (stereo/depth_maps), whether or not there "
                             "is a dense cloud")
                   ->excludes(dense);
  app->add_flag("--sparse", options->sparse,
                "points of the sparse model [default: the dense cloud, else the depth maps where "
                "half the photographs have one, else these]")
      ->excludes(dense)
      ->excludes(maps);
  auto* scale = AddSetting(app, "metres-per-unit", &options->metres_per_unit, "M");
  AddKnownDistance(app, &options->known_distance)->excludes(scale);
  app->add_option("--transform", options->transform,
                  "move everything by the transform that colmap model_aligner wrote "
                  "(--transform_path), or by a 4 x 4 matrix")
      ->type_name("FILE");
  AddDirection(app, "--up", &options->up,
               "what is up, world: a direction or an axis, as -y [default: from the photographs]");
  AddParsed(app, "--decimate", "thin the cloud to about this many points while it is read",
            [options](const std::string& text) {
              ParseCount(text);
              options->decimate = text;
            })
      ->type_name("5M");
  auto* samples =
      AddParsed(app, "--samples",
                "of a mesh: so many points spread over its triangles by area [default: 1M; of a "
                ".ply its vertices]",
                [options](const std::string& text) {
                  ParseCount(text);
                  options->samples = text;
                })
          ->type_name("1M");
  app->add_flag("--vertices", options->vertices, "of a mesh: its vertices as they are")
      ->excludes(samples);
  AddParsed(app, "--memory-limit",
            "refuse a cloud that needs more than this many MiB [default: 80 % of what is free]",
            [options](const std::string& text) {
              ParseCount(text);
              options->memory_limit = text;
            })
      ->type_name("MIB");
  app->add_flag("--json", options->json, "print the summary as JSON");
  app->footer(
      "Examples:\n"
      "  sherd import trench_colmap --project trench.sherd --metres-per-unit 1\n"
      "  sherd import trench_colmap/dense --project trench.sherd --photos /mnt/photographs\n"
      "  sherd import trench_colmap --project trench.sherd --distance 0,0,0 1.5,0,0.2 2.00\n"
      "  sherd import trench_colmap --project sparse.sherd --sparse --model 1\n"
      "  sherd import vase.glb --project vase.sherd --samples 2M --metres-per-unit 1");
  app->callback([options, action] {
    *action = [options](const Environment& environment) {
      return RunImport(*options, environment);
    };
  });
}

}  // namespace sherd::cli
