// sherd reconstruct: photographs become a COLMAP workspace, and, where asked for, a project.
#include <memory>
#include <nlohmann/json.hpp>

#include "app/cli/command.h"
#include "app/cli/progress.h"
#include "app/cli/summary.h"
#include "app/cli/table.h"
#include "app/project/colmap_run.h"
#include "app/project/format.h"
#include "app/project/project.h"
#include "metaball/progress_range.h"

namespace sherd::cli {
namespace {

struct Options {
  ReconstructOptions reconstruct;
  std::string project;
  bool no_dense = false, json = false;
};

int RunReconstruct(const Options& options, const Environment& environment) {
  ReconstructOptions reconstruct = options.reconstruct;
  reconstruct.dense = !options.no_dense;
  Progress progress(environment.stop);
  const bool import = !options.project.empty();
  const ReconstructResult result =
      Reconstruct(reconstruct, PartOf(progress.control(), 0, import ? 0.95 : 1));
  std::optional<Project> project;
  if (import) {
    ImportOptions to_import;
    to_import.source = reconstruct.workspace;
    to_import.photo_folder = reconstruct.photos;
    project = ImportSurvey(to_import, options.project, PartOf(progress.control(), 0.95, 1));
  }
  progress.Clear();
  if (options.json) {
    Json stages = Json::array();
    for (const ReconstructStage& stage : result.stages) {
      stages.push_back(
          {{"stage", stage.name}, {"skipped", stage.skipped}, {"seconds", stage.seconds}});
    }
    Json json = {{"workspace", reconstruct.workspace},
                 {"colmap", result.version},
                 {"cuda", result.cuda},
                 {"models", result.models},
                 {"stages", std::move(stages)},
                 {"dense", result.no_dense.empty()},
                 {"no_dense", result.no_dense.empty() ? Json() : Json(result.no_dense)},
                 {"log", result.log}};
    if (project) json["project"] = ToJson(*project);
    PrintJson(json);
    return kSuccess;
  }
  std::vector<std::vector<std::string>> rows;
  for (const ReconstructStage& stage : result.stages) {
    rows.push_back(
        {stage.name, stage.skipped ? "done by an earlier run" : FormatSeconds(stage.seconds)});
  }
  std::string text = "Reconstructed by " + result.version + " in " + reconstruct.workspace + "\n" +
                     Table(rows, 2, {1});
  if (result.models > 1) {
    text += "  " + std::to_string(result.models) +
            " models that share no photographs; the largest is taken (sherd info lists them)\n";
  }
  if (!result.no_dense.empty()) text += "  No dense cloud: " + result.no_dense + "\n";
  text += project ? DescribeImport(*project)
                  : "Next: sherd import " + reconstruct.workspace + " --project P.sherd\n";
  Print(text);
  return kSuccess;
}

}  // namespace

void AddReconstruct(CLI::App* program, Action* action) {
  auto options = std::make_shared<Options>();
  ReconstructOptions& r = options->reconstruct;
  CLI::App* app = program->add_subcommand(
      "reconstruct", "Make a COLMAP workspace of photographs, by COLMAP itself.");
  app->add_option("PHOTOS", r.photos, "the folder of the photographs; only read")->required();
  app->add_option("--workspace", r.workspace,
                  "the folder to work in; a run that was interrupted is gone on with there")
      ->required()
      ->type_name("DIR");
  app->add_option("--project", options->project, "import the result into this project")
      ->type_name("P.sherd");
  app->add_option("--camera-model", r.camera_model, "COLMAP's name of the lens model")
      ->capture_default_str()
      ->type_name("MODEL");
  app->add_flag("--single-camera", r.single_camera,
                "all photographs by one camera at one focal length");
  app->add_flag("--sequential", r.sequential,
                "the names are in the order the photographs were taken: try neighbours alone");
  app->add_option("--max-image-size", r.max_image_size,
                  "longest side that is looked at, px [default: COLMAP's own]")
      ->check(CLI::Range(100, 100000))
      ->type_name("PX");
  app->add_option("--threads", r.threads, "processors to use [default: COLMAP's own choice]")
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
  app->add_flag("--no-dense", options->no_dense,
                "stop before the dense stages (they need a COLMAP with CUDA)");
  app->add_option("--colmap", r.colmap, "COLMAP's program")
      ->capture_default_str()
      ->type_name("FILE");
  app->add_flag("--json", options->json, "print the summary as JSON");
  app->footer(
      "Examples:\n"
      "  sherd reconstruct photographs --workspace trench_colmap --single-camera\n"
      "  sherd reconstruct photographs --workspace trench_colmap --project trench.sherd\n"
      "COLMAP's own words are in DIR/colmap.log.");
  app->callback([options, action] {
    *action = [options](const Environment& environment) {
      return RunReconstruct(*options, environment);
    };
  });
}

}  // namespace sherd::cli
