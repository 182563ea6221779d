// sherd render: one picture.
#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "app/cli/command.h"
#include "app/cli/look_options.h"
#include "app/cli/progress.h"
#include "app/cli/source.h"
#include "app/project/format.h"
#include "app/project/picture.h"
#include "app/project/render_picture.h"
#include "app/report/legend_picture.h"
#include "metaball/atomic_file.h"
#include "metaball/error.h"
#include "metaball/progress_range.h"
#include "reconstruction/mesh_import.h"

namespace sherd::cli {
namespace {

using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct RenderOptions {
  std::string source, out, level, depth_out, stats, reference;
  std::optional<double> reference_threshold, radius_factor;
  bool linear = false, json = false, legend = false;
  LookOptions look;
};

std::string CameraText(const Camera& camera) {
  const auto vector = [](const Vec3d& v) {
    return FormatExact(v.x) + "," + FormatExact(v.y) + "," + FormatExact(v.z);
  };
  return std::string(camera.projection == Projection::kOrthographic ? "orthographic"
                                                                    : "perspective") +
         " eye " + vector(camera.eye) + " right " + vector(camera.right) + " down " +
         vector(camera.down) + " forward " + vector(camera.forward) + " fx " +
         FormatExact(camera.fx) + " fy " + FormatExact(camera.fy) + " cx " +
         FormatExact(camera.cx) + " cy " + FormatExact(camera.cy);
}

PictureOptions PictureOptionsOf(const RenderOptions& options, const Source& source,
                                const Scene& scene, const Camera& camera,
                                const Renderer& renderer) {
  PictureOptions picture;
  picture.linear = options.linear;
  picture.alpha = ParseBackground(options.look.background).transparent;
  picture.bits = options.look.bits;
  picture.dpi = ValueOf("dpi", options.look.dpi);
  auto& metadata = picture.metadata;
  metadata["source"] = std::filesystem::path(options.source).filename().string();
  if (source.level) {
    metadata["level"] = source.level->name;
    metadata["radius"] =
        FormatExact(source.level->stats.radius_median * scene.surface.radius_scale);
  }
  metadata["metaballs"] = std::to_string(source.cloud->size());
  metadata["threshold"] = FormatExact(scene.surface.threshold);
  metadata["radius_scale"] = FormatExact(scene.surface.radius_scale);
  const AppearanceOptions& appearance = options.look.appearance;
  metadata["color"] = options.look.color;
  if (!appearance.color_by.empty()) {
    metadata["color"] = appearance.color_by + " (" + appearance.color_map + ")";
  }
  if (!appearance.texture.empty()) {
    metadata["color"] = std::filesystem::path(appearance.texture).filename().string() + " (" +
                        appearance.projection + ", " + appearance.texture_mode + ")";
  }
  metadata["camera"] = CameraText(camera);
  metadata["backend"] = renderer.backend() + " (" + renderer.device() + ")";
  if (source.project && source.project->metres_per_unit()) {
    metadata["metres_per_unit"] = FormatExact(*source.project->metres_per_unit());
  }
  return picture;
}

// The size asked for, or the photograph's own, or 1280 x 720.
Camera CameraFor(const LookOptions& look, const Source& source) {
  const ViewContext& context = source.view;
  const ViewRequest request = look.Request(false);
  if (look.photo.empty()) {
    const Size size = look.size.value_or(Size{1280, 720});
    return MakeCamera(context, request, size.width, size.height);
  }
  const std::size_t photo = FindPhotograph(*source.survey, look.photo);
  const Camera own = CameraOfPhotograph(*source.survey, photo);
  if (!look.size) return own;
  const double stretch = static_cast<double>(look.size->width) * own.height /
                         (static_cast<double>(look.size->height) * own.width);
  if (stretch < 0.99 || stretch > 1.01) {
    Warn("the photograph is " + std::to_string(own.width) + "x" + std::to_string(own.height) +
         ", so at " + std::to_string(look.size->width) + "x" + std::to_string(look.size->height) +
         " it appears stretched; a size of the same shape avoids that");
  }
  return MakeCamera(context, request, look.size->width, look.size->height);
}

int RunRender(const RenderOptions& options, const Environment& environment) {
  const Clock::time_point start = Clock::now();
  const LookOptions& look = options.look;
  look.CheckPhotoOptions();
  std::error_code error;
  if (!options.reference.empty() && !std::filesystem::exists(options.reference, error)) {
    throw InputError(options.reference, "", "does not exist",
                     "give the picture to compare with, or leave --reference out");
  }
  Progress progress(environment.stop);
  SourceOptions source_options;
  source_options.level = options.level;
  source_options.survey = look.needs_survey();
  source_options.photo_folder = look.photo_folder;
  source_options.radius_factor = options.radius_factor;
  const Source source =
      OpenSource(options.source, source_options, PartOf(progress.control(), 0, 0.3));
  progress.Clear();
  for (const std::string& warning : source.warnings) Warn(warning);
  const double seconds_load = SecondsSince(start);

  const Camera camera = CameraFor(look, source);
  RenderSettings settings = look.Settings();
  Scene scene{source.cloud, look.SurfaceOf(source.surface), look.Light()};
  ApplyAppearance(look.appearance, source.level.get(), source.view.up.value_or(Vec3d{0, 0, 1}),
                  settings.threads, &scene);
  std::optional<Frame> legend;
  if (options.legend) legend = DrawLegend(MakeLegend(scene, camera), camera.height);
  settings.planes.depth = !options.depth_out.empty();

  std::string why;
  const std::unique_ptr<Renderer> backend = RendererOf(look, &why);
  std::optional<PhotographShader> photographs;
  std::optional<PhotographRenderer> photo_renderer;
  if (look.photo_colors()) {
    photographs.emplace(look.Photographs(*source.survey, backend.get()));
    photo_renderer.emplace(backend.get(), &*photographs, source.level);
  }
  Renderer* const renderer = photo_renderer ? &*photo_renderer : backend.get();
  if (look.Device().backend == Backend::kAuto && backend->backend() == "cpu" && !why.empty()) {
    std::fprintf(stderr, "%s\n", OneLine(why).c_str());
  }

  // Opened before the work: a folder that cannot be written is found out at once.
  PictureWriter picture(options.out, camera.width, camera.height,
                        PictureOptionsOf(options, source, scene, camera, *renderer));
  std::optional<DepthWriter> depth;
  if (!options.depth_out.empty()) {
    depth.emplace(options.depth_out, camera.width, camera.height);
  }
  std::optional<AtomicFile> stats_file;
  if (!options.stats.empty()) stats_file.emplace(options.stats);

  const Background background = ParseBackground(look.background);
  double seconds_write = 0;
  int strips = 0, rows_done = 0;
  const RenderStats stats = RenderInStrips(
      renderer, scene, camera, settings,
      [&](Frame&& strip) {
        const Clock::time_point begin = Clock::now();
        if (depth) depth->WriteRows(strip);
        Composite(background, &strip);
        if (legend) OverlayLegend(*legend, camera.height, rows_done, &strip);
        rows_done += strip.height;
        picture.WriteRows(strip);
        seconds_write += SecondsSince(begin);
        ++strips;
      },
      PartOf(progress.control(), 0.3, 1));
  if (environment.stop.stop_requested()) throw Cancelled();
  const Clock::time_point finish = Clock::now();
  if (depth) depth->Finish();
  picture.Finish();
  seconds_write += SecondsSince(finish);
  progress.Clear();

  std::optional<PictureDifference> difference;
  const double limit = ValueOf("reference-threshold", options.reference_threshold);
  if (!options.reference.empty()) difference = ComparePictures(options.out, options.reference);

  Json json = {{"program", "sherd " SHERD_VERSION},
               {"source", options.source},
               {"level", source.level ? Json(source.level->name) : Json()},
               {"threshold", scene.surface.threshold},
               {"radius_scale", scene.surface.radius_scale},
               {"picture",
                {{"file", options.out},
                 {"width", camera.width},
                 {"height", camera.height},
                 {"supersample", settings.supersample},
                 {"strips", strips}}},
               {"camera", ToJson(camera)}};
  Json figures = ToJson(stats);
  figures["rare_events"]["metaballs_dropped"] = source.dropped;
  if (photo_renderer) {
    const PhotoShadingStats& photos = photo_renderer->photo_stats();
    figures["photographs"] = {{"pixels", photos.pixels},
                              {"from_photographs", photos.from_photos},
                              {"across_holes", photos.across_holes},
                              {"without_photograph", photos.without_photo},
                              {"used", photos.photos_used},
                              {"unreadable", photos.photos_unreadable}};
    figures["seconds"]["photographs"] = photos.seconds;
    for (const std::string& warning : photos.warnings) Warn(warning);
  }
  figures["seconds"]["load"] = seconds_load;
  figures["seconds"]["write"] = seconds_write;
  figures["seconds"]["total"] = SecondsSince(start);
  figures["cloud_bytes"] = source.cloud->MemoryBytes();
  figures["peak_memory_bytes"] = PeakMemory();
  json.update(figures);
  json["backend_note"] = why;
  if (difference) {
    json["reference"] = {{"file", options.reference},
                         {"rms", difference->rms},
                         {"largest", difference->largest},
                         {"share_off_by_8", difference->share_off_by_8},
                         {"threshold", limit},
                         {"passed", difference->rms <= limit}};
  }
  if (stats_file) {
    const std::string text = json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
    stats_file->Write(text.data(), text.size());
    stats_file->Commit();
  }
  if (options.json) {
    PrintJson(json);
  } else {
    std::string text = options.out + ": " + std::to_string(camera.width) + "x" +
                       std::to_string(camera.height) + ", " + FormatGrouped(source.cloud->size()) +
                       " metaballs, " + FormatSeconds(stats.seconds_total) + " on " +
                       stats.backend + " (" + stats.device + ")\n";
    if (stats.lod_metaballs > 0) {
      text += "level of detail: " + FormatGrouped(stats.lod_metaballs) +
              " metaballs, the surface within " + FormatNumber(stats.lod_error_px) + " px\n";
    }
    if (difference) {
      text += "difference from " + options.reference + ": " + FormatNumber(difference->rms) +
              " of 255 (root mean square), largest " + FormatNumber(difference->largest) + ", " +
              FormatShare(difference->share_off_by_8) + " of the pixels off by more than 8\n";
    }
    Print(text);
  }
  if (!stats.lod_note.empty()) Warn("no level of detail: " + stats.lod_note);
  if (stats.unresolved > 0) {
    Warn(FormatGrouped(stats.unresolved) +
         " rays reached the iteration bound: their pixels may be wrong");
  }
  if (stats.hits == 0) {
    Warn(
        "the picture is empty: no ray meets the surface (look elsewhere, lower --threshold or "
        "raise --radius-scale)");
  }
  if (difference && !(difference->rms <= limit)) {
    std::fprintf(stderr, "sherd: %s\n",
                 OneLine(options.out + ": differs from " + options.reference + " by " +
                         FormatNumber(difference->rms) + ", more than " + FormatNumber(limit))
                     .c_str());
    return kComparisonFailed;
  }
  return kSuccess;
}

}  // namespace

void AddRender(CLI::App* program, Action* action) {
  auto options = std::make_shared<RenderOptions>();
  CLI::App* app = program->add_subcommand(
      "render",
      "Render a level of a project, a metaball file, a mesh or a .ply file as a picture.");
  app->add_option(
         "SOURCE", options->source,
         "a project, a metaball file (.metaballs, .mbt, .mbb), a .ply with x y z radius red "
         "green blue (missing radii come from the spacing of the points; colours of "
         "integer type are sRGB, of float type linear), or the vertices of a mesh (" +
             MeshExtensionList() + ")")
      ->required();
  app->add_option("--out", options->out, "the picture: .png, .tif, .exr or .jpg")
      ->required()
      ->type_name("F");
  AddSize(app, &options->look.size, "pixels [default 1280x720; with --photo the photograph's]");
  app->add_option("--level", options->level, "level of a project [default: the largest]")
      ->type_name("63k");
  AddSetting(app, "radius-factor", &options->radius_factor, "F");
  AddLookOptions(app, &options->look);
  app->add_flag("--legend", options->legend, "draw the colours of --color-by and their values")
      ->needs("--color-by")
      ->group("Appearance");
  app->add_flag("--linear", options->linear,
                "write linear values, without the sRGB curve (.exr is always linear)")
      ->group("Picture");
  constexpr const char* kMore = "More output";
  app->add_option("--depth-out", options->depth_out,
                  "float image (.exr) of the distance along the ray in world units, 0 where "
                  "nothing is hit")
      ->type_name("F.exr")
      ->group(kMore);
  app->add_option("--stats", options->stats,
                  "counts, seconds per stage, memory, device and rare events as JSON")
      ->type_name("F.json")
      ->group(kMore);
  auto* reference = app->add_option("--reference", options->reference,
                                    "compare the picture with this one; exit code 1 when they "
                                    "differ by more than the threshold")
                        ->type_name("F.png")
                        ->group(kMore);
  AddSetting(app, "reference-threshold", &options->reference_threshold, "E")
      ->needs(reference)
      ->group(kMore);
  app->add_flag("--json", options->json, "print what --stats holds")->group(kMore);
  app->footer(
      "Examples:\n"
      "  sherd render trench.sherd --level 63k --view top --size 1920x1080 --out top.png\n"
      "  sherd render trench.sherd --photo DSC05083.JPG --color photo --out through.png\n"
      "  sherd render cloud.ply --eye 2,-3,1.5 --look-at 0,0,0 --up 0,0,1 --fov-x 50 \\\n"
      "      --size 1280x720 --background transparent --out cloud.png --depth-out depth.exr");
  app->callback([options, action] {
    *action = [options](const Environment& environment) {
      return RunRender(*options, environment);
    };
  });
}

}  // namespace sherd::cli
