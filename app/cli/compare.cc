// sherd compare: levels by one camera on a sheet.
#include <algorithm>
#include <ctime>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "app/cli/command.h"
#include "app/cli/look_options.h"
#include "app/cli/progress.h"
#include "app/cli/source.h"
#include "app/cli/summary.h"
#include "app/cli/table.h"
#include "app/project/format.h"
#include "app/project/picture.h"
#include "app/project/render_picture.h"
#include "app/report/sheet.h"
#include "metaball/appearance/pseudo_color.h"
#include "metaball/error.h"
#include "metaball/progress_range.h"
#include "metaball/stopwatch.h"

namespace sherd::cli {
namespace {

namespace fs = std::filesystem;

// A sheet is looked at, not measured: its edges are smoothed unless told otherwise.
constexpr double kSheetSupersample = 2;

struct Options {
  std::string project, levels, out, csv, separate, title;
  bool json = false;
  LookOptions look;
};

std::vector<std::string> LevelNames(const Options& options, const Project& project) {
  std::vector<std::string> names;
  if (options.levels.empty()) {
    project.LargestLevel();  // says what to do where there are none
    for (const LevelEntry& level : project.levels()) names.push_back(level.name);
    return names;
  }
  std::string name;
  for (const char c : options.levels + ",") {
    if (c != ',') {
      name += c;
      continue;
    }
    const std::string found = project.FindLevel(name).name;
    if (std::find(names.begin(), names.end(), found) == names.end()) names.push_back(found);
    name.clear();
  }
  return names;
}

std::string Today() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  char text[16];
  std::strftime(text, sizeof text, "%Y-%m-%d", &local);
  return text;
}

std::string Subtitle(const Project& project, const LookOptions& look, const Survey* survey) {
  const ImportSummary& import = project.import_summary();
  ViewRequest request = look.Request(true);
  if (survey && !request.photo.empty()) {
    request.photo = survey->photographs[FindPhotograph(*survey, request.photo)].name;
  }
  std::string text = DescribeView(request);
  text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  const std::string dot = "   \u00b7   ";
  text += dot + FormatGrouped(import.points) + (import.dense ? " dense points" : " sparse points");
  if (import.photographs > 0) {
    text += ", " + FormatGrouped(import.photographs) + " photographs";
  }
  if (look.photo_colors()) text += dot + "colours of the photographs";
  return text + dot + Today();
}

// A picture's name for a level: its own, without what a file name cannot hold.
std::string FileName(const std::string& level) {
  std::string name = level;
  std::replace(name.begin(), name.end(), '/', '_');
  return name + ".png";
}

int RunCompare(const Options& options, const Environment& environment) {
  const Stopwatch watch;
  const LookOptions& look = options.look;
  look.CheckPhotoOptions();
  const Project project = Project::Open(options.project);
  const std::vector<std::string> names = LevelNames(options, project);
  const int n = static_cast<int>(names.size());

  SheetOptions sheet;
  sheet.width = look.size ? look.size->width : 1920;
  sheet.height = look.size ? look.size->height : 1080;
  sheet.title = options.title.empty() ? project.title() : options.title;
  sheet.metres_per_unit = project.metres_per_unit();
  PanelSizeFor(sheet, n);  // refuses a sheet that is too small before anything is loaded

  Progress progress(environment.stop);
  std::shared_ptr<const Survey> survey;
  if (look.needs_survey()) {
    survey = LoadSurveyWithPhotos(project, look.photo_folder, PartOf(progress.control(), 0, 0.1));
  }
  const ViewContext context = project.MakeViewContext(survey.get());
  sheet.subject_aspect = SubjectAspect(context, look.Request(true));
  const PanelSize panel_size = PanelSizeFor(sheet, n);
  const Camera camera =
      MakeCamera(context, look.Request(true), panel_size.width, panel_size.height);
  sheet.subtitle = Subtitle(project, look, survey.get());

  PictureOptions picture;
  picture.bits = look.bits;
  picture.dpi = ValueOf("dpi", look.dpi);
  picture.metadata["source"] = fs::path(options.project).filename().string();
  picture.metadata["view"] = DescribeView(look.Request(true));
  for (const std::string& name : names) {
    picture.metadata["levels"] += (picture.metadata["levels"].empty() ? "" : ", ") + name;
  }
  // Opened before the work: a folder that cannot be written is found out at once.
  PictureWriter writer(options.out, sheet.width, sheet.height, picture);
  if (!options.separate.empty()) {
    std::error_code error;
    fs::create_directories(options.separate, error);
    if (error) throw OutputError(options.separate, "cannot be made: " + error.message());
  }

  std::string why;
  const std::unique_ptr<Renderer> backend = RendererOf(look, &why);
  if (look.Device().backend == Backend::kAuto && backend->backend() == "cpu" && !why.empty()) {
    progress.Clear();
    std::fprintf(stderr, "%s\n", OneLine(why).c_str());
  }
  RenderSettings settings = look.Settings(kSheetSupersample);
  settings.planes.depth = true;
  const Background background = ParseBackground(look.background);

  std::optional<PhotographShader> photographs;  // decoded once for all levels
  if (look.photo_colors()) {
    photographs.emplace(look.Photographs(*survey, backend.get()));
  }
  AppearanceOptions appearance = look.appearance;
  std::vector<SheetPanel> panels;
  std::vector<std::string> warnings;
  for (int i = 0; i < n; ++i) {
    const std::string& name = names[static_cast<std::size_t>(i)];
    const double from = 0.1 + 0.85 * i / n, to = 0.1 + 0.85 * (i + 1) / n;
    const auto level = project.LoadLevel(
        name, PartOf(progress.control(), from, from + 0.2 * (to - from), name + ": "));
    const Control control = PartOf(progress.control(), from + 0.2 * (to - from), to, name + ": ");
    Scene scene{std::shared_ptr<const Cloud>(level, &level->cloud),
                look.SurfaceOf(level->stats.threshold), look.Light()};
    ApplyAppearance(appearance, level.get(), context.up.value_or(Vec3d{0, 0, 1}), settings.threads,
                    &scene);
    // Colours mean the same on every level: the first one's range is that of all.
    if (!appearance.color_by.empty() && !appearance.color_range) {
      appearance.color_range = RangeOf(scene, camera);
    }
    SheetPanel panel;
    panel.title = name;
    panel.level = level->stats;
    panel.threshold = scene.surface.threshold;
    panel.radius_scale = scene.surface.radius_scale;
    if (photographs) {
      PhotographRenderer renderer(backend.get(), &*photographs, level);
      panel.frame = renderer.Render(scene, camera, settings, control);
      warnings.insert(warnings.end(), renderer.photo_stats().warnings.begin(),
                      renderer.photo_stats().warnings.end());
    } else {
      panel.frame = backend->Render(scene, camera, settings, control);
    }
    if (!options.separate.empty()) {
      Frame alone = panel.frame;
      Composite(background, &alone);
      PictureOptions separate = picture;
      separate.alpha = background.transparent;
      separate.metadata["levels"] = name;
      WritePicture((fs::path(options.separate) / FileName(name)).string(), alone, separate);
    }
    // The sheet itself is opaque: white under what is transparent.
    Composite(background.transparent ? Background{} : background, &panel.frame);
    if (!panel.frame.stats.lod_note.empty()) {
      warnings.push_back("level " + name + ": no level of detail: " + panel.frame.stats.lod_note);
    }
    if (panel.frame.stats.unresolved > 0) {
      warnings.push_back("level " + name + ": " + FormatGrouped(panel.frame.stats.unresolved) +
                         " rays reached the iteration bound: their pixels may be wrong");
    }
    panels.push_back(std::move(panel));
  }
  progress.control().Report("drawing the sheet", 0.96);
  writer.WriteRows(ComposeSheet(sheet, camera, panels));
  if (environment.stop.stop_requested()) throw Cancelled();
  if (!options.csv.empty()) WriteSheetCsv(options.csv, panels, sheet.metres_per_unit);
  writer.Finish();
  progress.Clear();
  std::sort(warnings.begin(), warnings.end());
  warnings.erase(std::unique(warnings.begin(), warnings.end()), warnings.end());
  for (const std::string& warning : warnings) Warn(warning);

  const double seconds = watch.Seconds();
  if (options.json) {
    Json levels = Json::array();
    for (const SheetPanel& panel : panels) {
      Json level = ToJson(project.FindLevel(panel.title));
      level["threshold"] = panel.threshold;
      level["radius_scale"] = panel.radius_scale;
      level["render"] = ToJson(panel.frame.stats);
      levels.push_back(std::move(level));
    }
    PrintJson({{"sheet", options.out},
               {"width", sheet.width},
               {"height", sheet.height},
               {"camera", ToJson(camera)},
               {"levels", std::move(levels)},
               {"backend_note", why},
               {"seconds", seconds},
               {"peak_memory_bytes", PeakMemory()}});
    return kSuccess;
  }
  std::vector<std::vector<std::string>> rows = {
      {"level", "metaballs", "spacing", "radius", "hits", "render time", "memory"}};
  for (const SheetPanel& panel : panels) {
    const RenderStats& stats = panel.frame.stats;
    rows.push_back(
        {panel.title, FormatGrouped(panel.level.count),
         FormatLength(panel.level.spacing, sheet.metres_per_unit),
         FormatLength(panel.level.radius_median * panel.radius_scale, sheet.metres_per_unit),
         stats.rays > 0
             ? FormatShare(static_cast<double>(stats.hits) / static_cast<double>(stats.rays))
             : "-",
         FormatSeconds(stats.SecondsToDraw()), FormatBytes(panel.level.cloud_bytes + stats.bytes)});
  }
  Print(options.out + ": " + std::to_string(sheet.width) + "x" + std::to_string(sheet.height) +
        ", " + std::to_string(n) + (n == 1 ? " level" : " levels") + " in " +
        FormatSeconds(seconds) + " (peak memory " + FormatBytes(PeakMemory()) + ")\n" +
        Table(rows));
  return kSuccess;
}

}  // namespace

void AddCompare(CLI::App* program, Action* action) {
  auto options = std::make_shared<Options>();
  CLI::App* app = program->add_subcommand(
      "compare", "Put levels of a project side by side on a sheet, seen by one camera.");
  app->add_option("PROJECT", options->project, "a project with levels")->required();
  app->add_option("--levels", options->levels, "which levels [default: all]")
      ->type_name("63k,126k,...");
  app->add_option("--out", options->out, "the sheet: .png, .tif, .exr or .jpg")
      ->required()
      ->type_name("F");
  AddSize(app, &options->look.size, "pixels of the whole sheet [default 1920x1080]");
  app->add_option("--title", options->title, "the sheet's title [default: the project's name]")
      ->type_name("TEXT");
  app->add_option("--csv", options->csv, "the figures as a table")->type_name("F.csv");
  app->add_option("--separate", options->separate, "each panel as a picture in this folder")
      ->type_name("DIR");
  app->add_flag("--json", options->json, "print the figures as JSON");
  AddLookOptions(app, &options->look);
  app->footer(
      "A sheet takes 2 x 2 rays a pixel unless --supersample says otherwise.\n"
      "Examples:\n"
      "  sherd compare trench.sherd --view top --ortho --size 3840x2160 --out sheet.png\n"
      "  sherd compare trench.sherd --levels 63k,502k --photo DSC05083.JPG --size 1920x1080 \\\n"
      "      --out sheet.png --csv figures.csv --separate panels");
  app->callback([options, action] {
    *action = [options](const Environment& environment) {
      return RunCompare(*options, environment);
    };
  });
}

}  // namespace sherd::cli
