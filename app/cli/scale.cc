// sherd scale: how long a unit of a project is, and what is up in it.
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>

#include "app/cli/command.h"
#include "app/cli/look_options.h"
#include "app/cli/option_types.h"
#include "app/cli/progress.h"
#include "app/cli/source.h"
#include "app/cli/summary.h"
#include "app/project/format.h"
#include "app/project/project.h"
#include "metaball/error.h"
#include "reconstruction/target_scale.h"

namespace sherd::cli {
namespace {

struct Options {
  std::string project;
  std::optional<double> metres_per_unit;
  std::optional<KnownDistance> known_distance;
  std::optional<Size> chessboard;
  std::string markers, photos;
  std::optional<double> target_size;
  std::optional<Vec3d> up;
  bool level_ground = false;
  std::optional<double> ground_tolerance;
  bool json = false;
};

TargetScale ScaleOfTargets(const Options& options, const Project& project,
                           const Environment& environment) {
  if (!options.target_size) {
    throw InputError("", "", "how large the targets are is missing", "add --target-size METRES");
  }
  TargetOptions targets;
  targets.markers = options.markers;
  targets.size_m = *options.target_size;
  if (options.chessboard) {
    targets.columns = options.chessboard->width;
    targets.rows = options.chessboard->height;
  }
  Progress progress(environment.stop);
  const auto survey = LoadSurveyWithPhotos(project, options.photos, progress.control());
  TargetScale scale = ScaleFromTargets(targets, *survey, progress.control());
  progress.Clear();
  return scale;
}

constexpr double kDegrees = 180 / std::numbers::pi;

Json GroundJson(const LevelledGround& levelled) {
  const GroundPlane& ground = levelled.ground;
  return {{"tilt_deg", levelled.tilt_rad * kDegrees},
          {"points", ground.points},
          {"share", ground.share},
          {"by_normals", ground.by_normals},
          {"tolerance", ground.tolerance},
          {"rms", ground.rms},
          {"normal", ToJson(ground.normal)},
          {"point", ToJson(ground.point)},
          {"transform", ToJson(levelled.transform)}};
}

std::string GroundText(const LevelledGround& levelled) {
  const GroundPlane& ground = levelled.ground;
  return "Levelled: the ground, " + FormatNumber(100 * ground.share) + " % of the points" +
         (ground.by_normals ? " that face up" : "") + " within " + FormatNumber(ground.tolerance) +
         " units (root mean square " + FormatNumber(ground.rms) + "), was tilted by " +
         FormatNumber(levelled.tilt_rad * kDegrees) +
         " degrees against what was up; it is z = 0 now, and +z is up\n";
}

int RunScale(const Options& options, const Environment& environment) {
  Project project = Project::Open(options.project);
  std::optional<TargetScale> targets;
  if (options.chessboard || !options.markers.empty()) {
    targets = ScaleOfTargets(options, project, environment);
    for (const std::string& warning : targets->warnings) Warn(warning);
    project.SetMetresPerUnit(targets->metres_per_unit);
  } else if (options.metres_per_unit || options.known_distance) {
    project.SetMetresPerUnit(options.known_distance ? ScaleOf(*options.known_distance)
                                                    : *options.metres_per_unit);
  }
  std::optional<LevelledGround> levelled;
  if (options.level_ground) {
    Progress progress(environment.stop);
    const GroundOptions ground{options.up, options.ground_tolerance};
    levelled = LevelGround(&project, ground, progress.control());  // saves all that was set
  } else {
    if (options.up) {
      Progress progress(environment.stop);
      project.SetUp(*options.up, *project.LoadSurveyFromCache(progress.control()));
    }
    if (options.up || targets || options.metres_per_unit || options.known_distance) project.Save();
  }
  const std::optional<double>& scale = project.metres_per_unit();
  if (options.json) {
    Json json = {{"path", options.project}, {"metres_per_unit", scale ? Json(*scale) : Json()}};
    if (targets) {
      json["targets"] = {{"relative_error", targets->relative_error},
                         {"lengths", targets->lengths},
                         {"corners", targets->corners},
                         {"photographs", targets->photographs},
                         {"reprojection_px", targets->reprojection_px}};
    }
    json["up"] = project.up() ? ToJson(*project.up()) : Json();
    if (levelled) json["ground"] = GroundJson(*levelled);
    PrintJson(json);
  } else {
    std::string measured;
    if (targets) {
      measured = "Measured: " + FormatGrouped(targets->lengths) + " lengths between " +
                 FormatGrouped(targets->corners) + " corners in " +
                 FormatGrouped(targets->photographs) + " photographs, standard error " +
                 FormatNumber(100 * targets->relative_error) + " %, reprojection " +
                 FormatNumber(targets->reprojection_px) + " px\n";
    }
    Print(measured +
          (scale ? "One unit is " + FormatNumber(*scale) + " m\n"
                 : "The scale is not known: sherd scale " + options.project +
                       " --distance X,Y,Z X,Y,Z METRES\n") +
          (levelled ? GroundText(*levelled) : ""));
  }
  return kSuccess;
}

}  // namespace

void AddScale(CLI::App* program, Action* action) {
  auto options = std::make_shared<Options>();
  CLI::App* app = program->add_subcommand(
      "scale", "Say or set how long a unit of a project is, and what is up.");
  app->add_option("PROJECT", options->project, "the project")->required()->type_name("P.sherd");
  auto* scale = AddSetting(app, "metres-per-unit", &options->metres_per_unit, "M");
  auto* distance = AddKnownDistance(app, &options->known_distance)->excludes(scale);
  auto* chessboard =
      AddParsed(app, "--chessboard",
                "the scale from a chessboard in the photographs: its inner corners, "
                "where four squares meet",
                [options](const std::string& text) { options->chessboard = ParseSize(text); })
          ->excludes(scale)
          ->excludes(distance)
          ->type_name("9x6");
  app->add_option("--markers", options->markers,
                  "the scale from coded markers in the photographs: OpenCV's dictionary")
      ->excludes(scale)
      ->excludes(distance)
      ->excludes(chessboard)
      ->type_name("4x4_50");
  app->add_option("--target-size", options->target_size,
                  "the side of a square of the chessboard, or of a marker's black square, metres")
      ->check(CLI::PositiveNumber)
      ->type_name("M");
  app->add_option("--photos", options->photos, "folder where the photographs are now")
      ->type_name("DIR");
  AddDirection(app, "--up", &options->up, "what is up, world: a direction or an axis, as -y");
  auto* level = app->add_flag("--level-ground", options->level_ground,
                              "find the ground, the largest plane within 30 degrees of level, and "
                              "turn the project so that it is z = 0 and +z is up");
  app->add_option("--ground-tolerance", options->ground_tolerance,
                  "how far points of the ground may lie from its plane, units [default: 0.5 % of "
                  "the survey's diagonal]")
      ->check(CLI::PositiveNumber)
      ->needs(level)
      ->type_name("D");
  app->add_flag("--json", options->json, "print JSON");
  app->footer(
      "Examples:\n"
      "  sherd scale trench.sherd\n"
      "  sherd scale trench.sherd --distance 0.12,0.4,-1 1.6,0.38,-0.9 2.00\n"
      "  sherd scale trench.sherd --chessboard 9x6 --target-size 0.03\n"
      "  sherd scale trench.sherd --markers 4x4_50 --target-size 0.1\n"
      "  sherd scale trench.sherd --up -y --level-ground");
  app->callback([options, action] {
    *action = [options](const Environment& environment) { return RunScale(*options, environment); };
  });
}

}  // namespace sherd::cli
