// sherd bench: error against time of every method, the stiff cases, and what features cost.
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "app/bench/bench_files.h"
#include "app/bench/contenders.h"
#include "app/bench/error_plot.h"
#include "app/bench/features.h"
#include "app/bench/measure.h"
#include "app/bench/stability.h"
#include "app/cli/command.h"
#include "app/cli/option_types.h"
#include "app/cli/progress.h"
#include "app/cli/source.h"
#include "app/cli/table.h"
#include "cuda/device_choice.h"
#include "datasets_synthetic/peer_scenes.h"
#include "metaball/cpu_renderer.h"
#include "metaball/error.h"
#include "metaball/progress_range.h"

namespace sherd::cli {
namespace {

struct BenchOptions {
  std::string source, level, scene = "height-field", metaballs, density, thresholds, device,
                             out = "bench";
  std::vector<std::string> methods;
  std::optional<Size> size;
  std::optional<double> threshold, threads;
  int repeat = 3;
  bool stability = false, features = false;
};

// What is drawn, and what it is called.
struct Subject {
  std::string name;
  Scene scene;
  Camera camera;
};

std::uint64_t CountOf(const std::string& text, std::uint64_t fallback) {
  if (text.empty()) return fallback;
  const std::vector<std::uint64_t> counts = ParseCounts(text);
  if (counts.size() != 1) {
    throw InputError("", "--metaballs", "\"" + text + "\" is not one count", "give one, as in 63k");
  }
  return counts.front();
}

// How far the thresholds of a synthetic scene's metaballs lie from the surface's, at most.
constexpr double kThresholdSpread = 0.3;

// Draws by thresholds of each metaball: the source's own, or for one without, spread ones.
void SetThresholds(ThresholdMode mode, Scene* scene) {
  scene->surface.mode = mode;
  if (mode == ThresholdMode::kUniform || !scene->cloud->threshold.empty()) return;
  auto cloud = std::make_shared<Cloud>(*scene->cloud);
  SpreadThresholds(scene->surface.threshold, kThresholdSpread, cloud.get());
  scene->cloud = cloud;
}

int ThreadsOf(const BenchOptions& options, int fallback) {
  return options.threads ? static_cast<int>(*options.threads) : fallback;
}

Subject SubjectOf(const BenchOptions& options, const Control& control) {
  const Size size = options.size.value_or(Size{320, 180});
  Subject subject;
  if (options.source.empty()) {
    const std::uint64_t count = CountOf(options.metaballs, 20000);
    PeerScene peer = options.scene == "shell" ? MakeShell(count, size.width, size.height)
                                              : MakeHeightField(count, size.width, size.height);
    subject = {options.scene, peer.scene, peer.camera};
  } else {
    SourceOptions source_options;
    source_options.level = options.level;
    const Source source = OpenSource(options.source, source_options, control);
    for (const std::string& warning : source.warnings) Warn(warning);
    subject.name = std::filesystem::path(options.source).filename().string();
    if (source.level) subject.name += ", level " + source.level->name;
    subject.scene = {source.cloud, source.surface, {}, {}};
    subject.camera = MakeCamera(source.view, {}, size.width, size.height);
  }
  Surface& surface = subject.scene.surface;
  if (!options.density.empty()) surface.density = ParseDensity(options.density);
  if (options.threshold) {
    surface.threshold = *options.threshold;
    surface.mode = ThresholdMode::kUniform;  // one that is asked for is one for all
  }
  if (!options.thresholds.empty()) {
    SetThresholds(ParseThresholdMode(options.thresholds), &subject.scene);
  }
  return subject;
}

void Write(const std::string& folder, const std::string& name, const FigureTable& table,
           const std::vector<std::pair<std::string, Figure>>& header) {
  const std::string path = (std::filesystem::path(folder) / name).string();
  WriteTextFile(path + ".csv", CsvOf(table));
  WriteTextFile(path + ".json", JsonOf(header, table));
}

DeviceChoice GpuOf(const BenchOptions& options) {
  return options.device.empty() ? DeviceChoice{} : GpuChoice(options.device);
}

std::string DeviceOf(int threads, const DeviceChoice& choice) {
  const int count = threads > 0 ? threads : 0;
  std::string device = MakeCpuRenderer()->device();
  if (count > 0) {
    // "2 threads, AVX2": as many as take part.
    const std::size_t comma = device.find(',');
    device = std::to_string(count) + (count == 1 ? " thread" : " threads") + device.substr(comma);
  }
  const std::unique_ptr<Renderer> gpu = MakeGpuRenderer(choice);
  return gpu ? device + "; " + gpu->device() : device;
}

int RunMethods(const BenchOptions& options, const Environment& environment) {
  std::vector<Method> methods;
  for (const std::string& name : options.methods) methods.push_back(ParseMethod(name));
  // Before the work: a folder that cannot be made is found out at once.
  MakeFolder(options.out);
  const double load = LoadAverage();
  Progress progress(environment.stop);
  const Subject subject = SubjectOf(options, PartOf(progress.control(), 0, 0.05));
  const Surface& surface = subject.scene.surface;
  const int threads = ThreadsOf(options, 1);
  const BenchScene scene{subject.name,
                         subject.scene.cloud->size(),
                         subject.camera.width,
                         subject.camera.height,
                         TextOf(surface.density),
                         surface.threshold,
                         NameOf(surface.mode),
                         threads,
                         options.repeat,
                         DeviceOf(threads, GpuOf(options)),
                         load};
  const ReferenceFrame reference =
      ReferenceRender(subject.scene, subject.camera, 0, PartOf(progress.control(), 0.05, 0.2));
  const std::vector<Contender> contenders = MakeContenders(methods, subject.scene, GpuOf(options));
  std::vector<Measurement> measurements;
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    progress.control().Report(
        "measuring " + contenders[i].series,
        0.2 + 0.8 * static_cast<double>(i) / static_cast<double>(contenders.size()));
    Control control;
    control.stop = environment.stop;
    measurements.push_back(Measure(contenders[i], subject.scene, subject.camera, reference, threads,
                                   options.repeat, control));
  }
  progress.Clear();
  Write(options.out, "bench", FiguresOf(measurements), HeaderOf(scene));
  const bool drawn = ScreenTable(measurements).size() > 1;
  if (drawn) {
    WriteErrorPlot(scene, measurements,
                   (std::filesystem::path(options.out) / "error_against_time").string());
    Print(Table(ScreenTable(measurements), 0, {1}) +
          "depth errors in radii of the smallest metaball at the hit, angles in degrees\n");
  }
  Print(ErrorsOf(measurements));
  return kSuccess;
}

int RunStabilityTable(const BenchOptions& options, const Environment& environment) {
  MakeFolder(options.out);
  Progress progress(environment.stop);
  const std::vector<StabilityRow> rows = RunStability(GpuOf(options), progress.control());
  progress.Clear();
  Write(options.out, "stability", FiguresOf(rows), {{"device", DeviceOf(0, GpuOf(options))}});
  Print(Table(ScreenTable(rows), 0, {1, 2, 3}));
  return kSuccess;
}

int RunFeatures(const BenchOptions& options, const Environment& environment) {
  FeatureOptions features;
  features.metaballs = CountOf(options.metaballs, features.metaballs);
  features.width = options.size.value_or(Size{1280, 720}).width;
  features.height = options.size.value_or(Size{1280, 720}).height;
  features.threads = ThreadsOf(options, 0);
  features.repeat = options.repeat;
  features.gpu = GpuOf(options);
  MakeFolder(options.out);
  const double load = LoadAverage();
  Progress progress(environment.stop);
  const std::vector<BytesRow> bytes = MeasureBytes(features, progress.control());
  const std::vector<FeatureRow> times = MeasureFeatures(features, progress.control());
  progress.Clear();
  const std::vector<std::pair<std::string, Figure>> header = {
      {"scene", "height-field"},
      {"metaballs", static_cast<double>(features.metaballs)},
      {"repeat", static_cast<double>(features.repeat)},
      {"device", DeviceOf(features.threads, features.gpu)},
      {"load_average_before", load < 0 ? Figure{} : Figure{load}}};
  Write(options.out, "bytes_per_metaball", FiguresOf(bytes), header);
  Write(options.out, "features", FiguresOf(times), header);
  Print(Table(ScreenTable(bytes), 0) + "\n" + Table(ScreenTable(times), 0, {1}));
  return kSuccess;
}

int RunBench(const BenchOptions& options, const Environment& environment) {
  if (options.stability) return RunStabilityTable(options, environment);
  if (options.features) return RunFeatures(options, environment);
  return RunMethods(options, environment);
}

}  // namespace

void AddBench(CLI::App* program, Action* action) {
  auto options = std::make_shared<BenchOptions>();
  CLI::App* app = program->add_subcommand(
      "bench", "Measure every way to intersect a ray with the surface: error against time.");
  auto* source = app->add_option("SOURCE", options->source,
                                 "what \"sherd render\" takes; without it a synthetic scene");
  auto* level = app->add_option("--level", options->level, "level of a project")->type_name("63k");
  auto* scene =
      AddChoice(app, "--scene", &options->scene, {"height-field", "shell"}, "synthetic scene");
  auto* metaballs =
      app->add_option("--metaballs", options->metaballs,
                      "how many of the synthetic scene [default 20k; --features 250k]")
          ->type_name("N");
  AddSize(app, &options->size, "pixels [default 320x180; --features 1280x720]");
  auto* density = app->add_option("--density", options->density,
                                  "as of render; [default: the source's, murakami]")
                      ->type_name("NAME");
  auto* threshold = AddSetting(app, "threshold", &options->threshold, "T");
  auto* thresholds = AddChoice(app, "--thresholds", &options->thresholds, ThresholdModeNames(),
                               "one threshold for all, or the metaballs' own, blended, summed or "
                               "gated; a source without gets them, within 30 % of T [default: the "
                               "source's, uniform]");
  auto* methods =
      app->add_option("--methods", options->methods,
                      "some of ours, thesis, fixed-march, adaptive-march, sphere-tracing, "
                      "interval, polynomial [default: all]")
          ->delimiter(',')
          ->type_name("A,B");
  app->add_option("--repeat", options->repeat, "frames of each; the median counts [default 3]")
      ->check(CLI::Range(1, 1000))
      ->type_name("N");
  AddSetting(app, "threads", &options->threads, "N");
  AddDevice(app, &options->device,
            "the GPU that is measured beside the CPU, by its number in sherd devices, or all "
            "together [default: the first, where there is one]");
  app->add_option("--out", options->out, "folder for tables and plots [default bench]")
      ->type_name("FOLDER");
  auto* stability = app->add_flag("--stability", options->stability,
                                  "run the stiff and extreme cases on every backend instead");
  auto* features = app->add_flag("--features", options->features,
                                 "measure what each feature costs in bytes and time instead");
  source->excludes(scene)->excludes(metaballs);
  level->needs(source);
  features->excludes(stability);
  for (CLI::Option* mode : {stability, features}) {
    mode->excludes(source)->excludes(scene)->excludes(density)->excludes(threshold);
    mode->excludes(thresholds)->excludes(methods);
  }
  stability->excludes(metaballs);
  app->footer(
      "Times are medians of whole frames; only ratios within one run count.\n"
      "Examples:\n"
      "  sherd bench --out bench\n"
      "  sherd bench trench.sherd --level 63k --methods ours,thesis --out bench\n"
      "  sherd bench --stability --out bench\n"
      "  sherd bench --features --out bench");
  app->callback([options, action] {
    *action = [options](const Environment& environment) { return RunBench(*options, environment); };
  });
}

}  // namespace sherd::cli
