#include "app/cli/look_options.h"

#include <nlohmann/json.hpp>

#include "app/project/render_picture.h"
#include "cuda/renderers.h"
#include "metaball/error.h"
#include "metaball/lod_renderer.h"
#include "metaball/methods/methods.h"

namespace sherd::cli {
namespace {

CLI::Option* In(const char* group, CLI::Option* option) { return option->group(group); }

constexpr const char* kSurface = "Surface and light";

}  // namespace

DeviceChoice LookOptions::Device() const {
  if (device.empty()) return ParseDeviceChoice(backend);
  if (backend == "cpu") {
    throw InputError("", "", "--device is for what a GPU renders", "leave out --backend cpu");
  }
  return GpuChoice(device);
}

PhotographShader LookOptions::Photographs(const Survey& survey, Renderer* renderer) const {
  PhotoShadingOptions options;
  options.memory_mb = static_cast<int>(ValueOf("photo-memory", photo_memory));
  for (const std::string& name : leave_out) {
    options.leave_out.push_back(static_cast<std::uint32_t>(FindPhotograph(survey, name)));
  }
  options.even_exposures = !as_shot;
  options.show_unseen = show_unseen;
  PhotographShader shader = MakePhotographShader(survey, renderer, options);
  // What photographs see is compared with to less than a pixel: not by a coarser level, nor by a
  // method that is there to be compared with.
  if (level_of_detail || ParseMethod(method) != Method::kOurs) shader.DrawWith(nullptr);
  return shader;
}

void LookOptions::CheckPhotoOptions() const {
  if (photo_colors()) {
    const char* const other = !appearance.color_by.empty()  ? "--color-by"
                              : !appearance.texture.empty() ? "--texture"
                                                            : nullptr;
    if (!other) return;
    throw InputError("", "", std::string(other) + " and --color photo both colour the surface",
                     "leave one of them out");
  }
  const char* const given = !leave_out.empty() ? "--leave-out"
                            : show_unseen      ? "--show-unseen"
                            : as_shot          ? "--as-shot"
                            : photo_memory     ? "--photo-memory"
                                               : nullptr;
  if (given) {
    throw InputError("", "", std::string(given) + " is for colours from photographs",
                     "add --color photo");
  }
}

ViewRequest LookOptions::Request(bool keep_photo_shape) const {
  ViewRequest request;
  request.photo = photo;
  request.eye = eye;
  request.look_at = look_at;
  request.up = up;
  request.fov_x_deg = fov_x;
  request.ortho_width = ortho_width;
  request.orthographic = ortho;
  if (!view.empty()) request.preset = ParseViewPreset(view);
  request.keep_photo_shape = keep_photo_shape;
  return request;
}

Lighting LookOptions::Light() const {
  Lighting lighting;
  lighting.unlit = unlit;
  lighting.ambient = ValueOf("ambient", ambient);
  lighting.diffuse = ValueOf("diffuse", diffuse);
  if (const sherd::Light* light = appearance.OnlyDirection()) {
    lighting.headlight = false;
    lighting.to_light = light->to_light;
  }
  return lighting;
}

Surface LookOptions::SurfaceOf(double level_threshold) const {
  Surface own;
  own.threshold = level_threshold;
  return SurfaceOf(own);
}

Surface LookOptions::SurfaceOf(Surface own) const {
  if (density) own.density = *density;
  if (!thresholds.empty()) {
    own.mode = ParseThresholdMode(thresholds);
  } else if (threshold && own.mode == ThresholdMode::kBlended) {
    own.mode = ThresholdMode::kUniform;  // one that is asked for is one for all
  }
  own.threshold = threshold.value_or(own.threshold);
  own.radius_scale = radius_scale.value_or(own.radius_scale);
  return own;
}

RenderSettings LookOptions::Settings(double default_supersample) const {
  RenderSettings settings;
  settings.supersample = static_cast<int>(supersample.value_or(default_supersample));
  settings.threads = static_cast<int>(ValueOf("threads", threads));
  return settings;
}

void AddCameraOptions(CLI::App* app, LookOptions* look) {
  constexpr const char* kCamera = "Camera";
  auto* photo = In(kCamera, app->add_option("--photo", look->photo,
                                            "pose and pinhole intrinsics of this photograph (a "
                                            "name or the end of one), scaled to the size")
                                ->type_name("NAME"));
  auto* view = In(kCamera, AddChoice(app, "--view", &look->view, ViewPresetNames(),
                                     "a view that fits the points [default iso]"));
  auto* eye = In(kCamera, AddVector(app, "--eye", &look->eye, "where the camera stands, world"));
  auto* look_at = In(kCamera, AddVector(app, "--look-at", &look->look_at,
                                        "the point in the middle of the picture [default: the "
                                        "middle of the points]"));
  In(kCamera, AddDirection(app, "--up", &look->up,
                           "what is up, for --eye and --view [default: the project's, else 0,0,1]"))
      ->excludes(photo);
  auto* fov = In(kCamera, AddSetting(app, "fov-x", &look->fov_x, "DEG"));
  auto* width = In(kCamera, AddSetting(app, "ortho-width", &look->ortho_width, "W"));
  auto* ortho = In(
      kCamera, app->add_flag("--ortho", look->ortho, "orthographic, as wide as the points need"));
  photo->excludes(view)->excludes(eye)->excludes(fov)->excludes(width)->excludes(ortho);
  view->excludes(eye);
  look_at->needs(eye);
  fov->excludes(width)->excludes(ortho);
}

void AddSurfaceOptions(CLI::App* app, LookOptions* look) {
  In(kSurface, AddSetting(app, "threshold", &look->threshold, "T"));
  In(kSurface, AddSetting(app, "radius-scale", &look->radius_scale, "S"));
  In(kSurface,
     AddParsed(app, "--density",
               "murakami, wyvill, nishimura, blinn:RATE,AMPLITUDE, power:N, ratio, "
               "reciprocal, ramp:DEGREE,SLOPE or trigonometric:RATE,AMPLITUDE [default: the "
               "file's, else murakami]",
               [look](const std::string& text) { look->density = ParseDensity(text); })
         ->type_name("NAME"));
  In(kSurface, AddChoice(app, "--thresholds", &look->thresholds, ThresholdModeNames(),
                         "one threshold for all, or the metaballs' own, blended, summed (thesis "
                         "2.9) or gated (thesis algorithms 2-6) [default: the file's, else "
                         "uniform]"));
}

void AddLightOptions(CLI::App* app, LookOptions* look) {
  In(kSurface, AddSetting(app, "ambient", &look->ambient, "A"));
  In(kSurface, AddSetting(app, "diffuse", &look->diffuse, "D"));
  AddLightOption(app, &look->appearance);
  In(kSurface, app->add_flag("--unlit", look->unlit, "the colours themselves, without light"));
}

void AddLookOptions(CLI::App* app, LookOptions* look) {
  AddCameraOptions(app, look);
  In(kSurface, AddChoice(app, "--color", &look->color, {"blend", "photo"},
                         "the metaballs' colours, blended, or those of the photographs (projects "
                         "only) [default blend]"));
  AddSurfaceOptions(app, look);
  AddLightOptions(app, look);
  AddAppearanceOptions(app, &look->appearance);

  constexpr const char* kPhotographs = "Colours from photographs";
  In(kPhotographs, app->add_option("--leave-out", look->leave_out,
                                   "photographs (names or ends of them) that give no colours")
                       ->delimiter(',')
                       ->type_name("NAME,..."));
  In(kPhotographs, app->add_flag("--show-unseen", look->show_unseen,
                                 "magenta where no photograph sees the surface (otherwise the "
                                 "metaballs' colours)"));
  In(kPhotographs,
     app->add_flag("--as-shot", look->as_shot, "the photographs' own exposures, not evened out"));
  In(kPhotographs, AddSetting(app, "photo-memory", &look->photo_memory, "MIB"));

  constexpr const char* kPicture = "Picture";
  In(kPicture, AddSetting(app, "supersample", &look->supersample, "N"));
  In(kPicture, AddSetting(app, "level-of-detail", &look->level_of_detail, "PX"));
  In(kPicture, AddParsed(app, "--background",
                         "red,green,blue, each 0 to 1 as sRGB shows them, or transparent [default: "
                         "white, 1,1,1]",
                         [look](const std::string& text) {
                           ParseBackground(text);
                           look->background = text;
                         })
                   ->type_name("R,G,B|transparent"));
  In(kPicture, app->add_option("--bits", look->bits,
                               "bits a channel: 8 or 16; .exr: 16 or 32 [default 8; .exr 16]")
                   ->type_name("8|16|32")
                   ->check(CLI::IsMember({8, 16, 32})));
  In(kPicture, AddSetting(app, "dpi", &look->dpi, "N"));

  constexpr const char* kMachine = "Machine and input";
  In(kMachine, AddChoice(app, "--backend", &look->backend, {"auto", "cpu", "cuda"},
                         "what renders; auto: the GPU where there is one [default auto]"));
  In(kMachine, AddDevice(app, &look->device,
                         "the GPU that renders, by its number in sherd devices, or all: each "
                         "draws a part of every picture [default: the first that can be used]"));
  std::vector<std::string> methods;
  for (const Method method : AllMethods()) methods.emplace_back(NameOf(method));
  In(kMachine, AddChoice(app, "--method", &look->method, methods,
                         "how rays meet the surface: ours, or one it is measured against, on the "
                         "CPU (docs/accuracy.md) [default ours]"))
      ->excludes("--backend")
      ->excludes("--device");
  In(kMachine, AddSetting(app, "threads", &look->threads, "N"));
  In(kMachine, app->add_option("--photos", look->photo_folder,
                               "folder where the photographs are now (found by relative name)")
                   ->type_name("DIR"));
}

std::unique_ptr<Renderer> RendererOf(const LookOptions& look, std::string* why) {
  const Method method = ParseMethod(look.method);
  if (method != Method::kOurs) return MakeMethodRenderer(method);
  std::unique_ptr<Renderer> renderer = MakeRenderer(look.Device(), why);
  const double pixels = ValueOf("level-of-detail", look.level_of_detail);
  return pixels > 0 ? MakeLodRenderer(std::move(renderer), pixels) : std::move(renderer);
}

Json ToJson(const Vec3d& v) { return Json::array({v.x, v.y, v.z}); }

Json ToJson(const Camera& camera) {
  return {{"projection",
           camera.projection == Projection::kOrthographic ? "orthographic" : "perspective"},
          {"width", camera.width},
          {"height", camera.height},
          {"eye", ToJson(camera.eye)},
          {"right", ToJson(camera.right)},
          {"down", ToJson(camera.down)},
          {"forward", ToJson(camera.forward)},
          {"fx", camera.fx},
          {"fy", camera.fy},
          {"cx", camera.cx},
          {"cy", camera.cy}};
}

Json ToJson(const RenderStats& stats) {
  return {{"backend", stats.backend},
          {"device", stats.device},
          {"metaballs", stats.metaballs},
          {"metaballs_in_view", stats.metaballs_in_view},
          {"tile_entries", stats.tile_entries},
          {"rays", stats.rays},
          {"hits", stats.hits},
          {"rare_events",
           {{"rays_started_inside", stats.rays_started_inside},
            {"grazing", stats.grazing},
            {"unresolved", stats.unresolved}}},
          {"seconds",
           {{"prepare", stats.seconds_prepare},
            {"bin", stats.seconds_bin},
            {"trace", stats.seconds_trace},
            {"render", stats.seconds_total}}},
          {"renderer_bytes", stats.bytes},
          {"level_of_detail",
           {{"metaballs", stats.lod_metaballs},
            {"error_px", stats.lod_error_px},
            {"seconds", stats.lod_seconds},
            {"bytes", stats.lod_bytes},
            {"note", stats.lod_note}}}};
}

}  // namespace sherd::cli
