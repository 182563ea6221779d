// sherd build: density levels from an imported survey.
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
#include "metaball/stopwatch.h"

namespace sherd::cli {
namespace {

struct Options {
  std::string project, colors = "points";
  std::string reduction = std::string(ReductionName(LevelOptions{}.reduction));
  std::vector<std::uint64_t> levels;
  std::optional<double> radius_factor, threshold, photos_per_metaball;
  bool nested = false, keep_outliers = false, keep_noise = false, keep_holes = false;
  bool fresh = false, json = false;
};

int RunBuild(const Options& options, const Environment& environment) {
  const Stopwatch watch;
  Project project = Project::Open(options.project);
  LevelOptions level_options;
  level_options.reduction = *FindReduction(options.reduction);
  level_options.nested = options.nested;
  level_options.remove_outliers = !options.keep_outliers;
  level_options.smooth_noise = !options.keep_noise;
  level_options.close_holes = !options.keep_holes;
  level_options.radius_factor = ValueOf("radius-factor", options.radius_factor);
  level_options.threshold = options.threshold.value_or(0.0);
  level_options.max_photos_per_metaball =
      static_cast<int>(ValueOf("photos-per-metaball", options.photos_per_metaball));
  level_options.photo_colors = options.colors == "photographs";

  std::vector<std::uint64_t> targets;
  std::vector<std::string> kept;
  for (const std::uint64_t target : options.levels) {
    level_options.target_count = target;
    const auto& levels = project.levels();
    // Built by this program with the same options: building it again would give the same.
    const auto same = std::find_if(levels.begin(), levels.end(), [&](const LevelEntry& level) {
      return level.program == SHERD_VERSION && level.options == level_options;
    });
    if (same != levels.end() && !options.fresh) {
      kept.push_back(same->name);
    } else {
      targets.push_back(target);
    }
  }
  if (!targets.empty()) {
    Progress progress(environment.stop);
    BuildLevels(&project, targets, level_options, progress.control());
  }
  const double seconds = watch.Seconds();

  for (const std::uint64_t target : targets) {
    const LevelEntry& level = project.FindLevel(FormatCount(target));
    if (level.stats.count < target && level.stats.count + target / 100 < target) {
      Warn("level " + level.name +
           " holds every point there is: " + FormatGrouped(level.stats.count) +
           ", fewer than the " + FormatGrouped(target) + " asked for");
    }
  }
  if (options.json) {
    Json built = Json::array();
    for (const std::uint64_t target : targets) {
      built.push_back(ToJson(project.FindLevel(FormatCount(target))));
    }
    PrintJson({{"project", options.project},
               {"built", std::move(built)},
               {"up_to_date", kept},
               {"seconds", seconds},
               {"peak_memory_bytes", PeakMemory()}});
    return kSuccess;
  }
  std::string text;
  if (!targets.empty()) {
    text = "Built " + std::to_string(targets.size()) +
           (targets.size() == 1 ? " level" : " levels") + " in " + FormatSeconds(seconds) +
           " (peak memory " + FormatBytes(PeakMemory()) + ")\n";
  }
  for (const std::string& name : kept) {
    text += "Level " + name + " was up to date (--fresh builds it again)\n";
  }
  Print(text + DescribeLevels(project) + "Next: sherd compare " + options.project +
        " --size 1920x1080 --out sheet.png\n");
  return kSuccess;
}

}  // namespace

void AddBuild(CLI::App* program, Action* action) {
  auto options = std::make_shared<Options>();
  CLI::App* app = program->add_subcommand(
      "build", "Build density levels of a project, each by a target count.");
  app->add_option("PROJECT", options->project, "a project made by sherd import")->required();
  AddParsed(app, "--levels",
            "how many metaballs each level holds (k and M are understood), reached within 1 %",
            [options](const std::string& text) { options->levels = ParseCounts(text); })
      ->required()
      ->type_name("63k,126k,...");
  AddChoice(app, "--reduction", &options->reduction, ReductionNames(),
            "how the points are reduced: to even spacing by cells of a grid or as blue noise, or "
            "denser where the surface bends");
  app->add_flag("--nested", options->nested,
                "every level holds the points of the coarser ones that are built so, and more");
  AddSetting(app, "radius-factor", &options->radius_factor, "F");
  AddSetting(app, "threshold", &options->threshold, "T");
  AddSetting(app, "photos-per-metaball", &options->photos_per_metaball, "N");
  AddChoice(app, "--colors", &options->colors, {"points", "photographs"},
            "each metaball's colour: the mean of its points', or what the photographs at full "
            "resolution show there, exposures evened out [default points]");
  app->add_flag("--keep-outliers", options->keep_outliers, "do not remove stray points");
  app->add_flag("--keep-noise", options->keep_noise,
                "take the points where they were surveyed, not smoothed");
  app->add_flag("--keep-holes", options->keep_holes,
                "do not close the survey's small holes (photographs that see a point are needed)");
  app->add_flag("--fresh", options->fresh, "build also levels that are there and up to date");
  app->add_flag("--json", options->json, "print the levels as JSON");
  app->footer(
      "Examples:\n"
      "  sherd build trench.sherd --levels 63k,126k,252k,502k\n"
      "  sherd build trench.sherd --levels 1.5M --radius-factor 2 --fresh");
  app->callback([options, action] {
    *action = [options](const Environment& environment) { return RunBuild(*options, environment); };
  });
}

}  // namespace sherd::cli
