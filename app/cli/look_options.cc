#include "app/cli/look_options.h"

#include <nlohmann/json.hpp>

#include "cuda/renderers.h"
#include "metaball/error.h"

namespace sherd::cli {

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
  lighting.headlight = !light;
  if (light) lighting.to_light = *light;
  return lighting;
}

Surface LookOptions::SurfaceOf(double level_threshold) const {
  return {threshold.value_or(level_threshold), ValueOf("radius-scale", radius_scale)};
}

RenderSettings LookOptions::Settings(double default_supersample) const {
  RenderSettings settings;
  settings.supersample = static_cast<int>(supersample.value_or(default_supersample));
  settings.threads = static_cast<int>(ValueOf("threads", threads));
  return settings;
}

void AddLookOptions(CLI::App* app, LookOptions* look) {
  const auto in = [](const char* group, CLI::Option* option) { return option->group(group); };

  constexpr const char* kCamera = "Camera";
  auto* photo = in(kCamera, app->add_option("--photo", look->photo,
                                            "pose and pinhole intrinsics of this photograph (a "
                                            "name or the end of one), scaled to the size")
                                ->type_name("NAME"));
  auto* view = in(kCamera, AddChoice(app, "--view", &look->view, ViewPresetNames(),
                                     "a view that fits the points [default iso]"));
  auto* eye = in(kCamera, AddVector(app, "--eye", &look->eye, "where the camera stands, world"));
  auto* look_at = in(kCamera, AddVector(app, "--look-at", &look->look_at,
                                        "the point in the middle of the picture [default: the "
                                        "middle of the points]"));
  in(kCamera, AddDirection(app, "--up", &look->up,
                           "what is up, for --eye and --view [default: the project's, else 0,0,1]"))
      ->excludes(photo);
  auto* fov = in(kCamera, AddSetting(app, "fov-x", &look->fov_x, "DEG"));
  auto* width = in(kCamera, AddSetting(app, "ortho-width", &look->ortho_width, "W"));
  auto* ortho = in(
      kCamera, app->add_flag("--ortho", look->ortho, "orthographic, as wide as the points need"));
  photo->excludes(view)->excludes(eye)->excludes(fov)->excludes(width)->excludes(ortho);
  view->excludes(eye);
  look_at->needs(eye);
  fov->excludes(width)->excludes(ortho);

  constexpr const char* kSurface = "Surface and light";
  in(kSurface, AddChoice(app, "--color", &look->color, {"blend", "photo"},
                         "the metaballs' colours, blended, or those of the photographs (projects "
                         "only) [default blend]"));
  in(kSurface, AddSetting(app, "threshold", &look->threshold, "T"));
  in(kSurface, AddSetting(app, "radius-scale", &look->radius_scale, "S"));
  in(kSurface, AddSetting(app, "ambient", &look->ambient, "A"));
  in(kSurface, AddSetting(app, "diffuse", &look->diffuse, "D"));
  in(kSurface, AddDirection(app, "--light", &look->light,
                            "direction towards the light, world [default: the light is "
                            "at the camera]"));
  in(kSurface, app->add_flag("--unlit", look->unlit, "the colours themselves, without light"));

  constexpr const char* kPicture = "Picture";
  in(kPicture, AddSetting(app, "supersample", &look->supersample, "N"));
  in(kPicture, app->add_option_function<std::string>(
                      "--background",
                      [look](const std::string& text) {
                        try {
                          ParseBackground(text);
                        } catch (const InputError& error) {
                          throw CLI::ValidationError("--background", error.what());
                        }
                        look->background = text;
                      },
                      "red,green,blue, each 0 to 1 as sRGB shows them, or transparent [default: "
                      "white, 1,1,1]")
                   ->type_name("R,G,B|transparent"));
  in(kPicture, app->add_option("--bits", look->bits,
                               "bits a channel: 8 or 16; .exr: 16 or 32 [default 8; .exr 16]")
                   ->type_name("8|16|32")
                   ->check(CLI::IsMember({8, 16, 32})));
  in(kPicture, AddSetting(app, "dpi", &look->dpi, "N"));

  constexpr const char* kMachine = "Machine and input";
  in(kMachine, AddChoice(app, "--backend", &look->backend, {"auto", "cpu", "cuda"},
                         "what renders; auto: the GPU where there is one [default auto]"));
  in(kMachine, AddSetting(app, "threads", &look->threads, "N"));
  in(kMachine, app->add_option("--photos", look->photo_folder,
                               "folder where the photographs are now (found by relative name)")
                   ->type_name("DIR"));
}

std::unique_ptr<Renderer> RendererOf(const LookOptions& look, std::string* why) {
  return MakeRenderer(ParseBackend(look.backend), why);
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
          {"renderer_bytes", stats.bytes}};
}

}  // namespace sherd::cli
