#include "app/cli/appearance_options.h"

#include <cmath>
#include <memory>
#include <utility>

#include "app/cli/option_types.h"
#include "metaball/appearance/bake.h"
#include "metaball/appearance/deferred.h"
#include "metaball/appearance/pseudo_color.h"
#include "metaball/appearance/uv_gradients.h"
#include "metaball/error.h"
#include "reconstruction/photographs.h"

namespace sherd::cli {
namespace {

constexpr const char* kUvChannel = "uv";

// The channels that are made where they are asked for and the cloud does not have them.
constexpr const char* kSpacing = "spacing";
constexpr const char* kViews = "views";

[[noreturn]] void RefuseLight(const std::string& text) {
  throw InputError("", "", "\"" + text + "\" is no light",
                   "give x,y,z (a direction), point:x,y,z, camera, camera-sun:x,y,z or "
                   "camera-point:x,y,z, then @intensity or @r,g,b if wanted");
}

Image ReadImage(const std::string& path, ImageEncoding encoding) {
  PhotoImage photo = ReadPhoto(path);
  Image image;
  image.width = photo.width;
  image.height = photo.height;
  image.encoding = encoding;
  image.bytes = std::move(photo.pixels);
  return image;
}

TextureLookup LookupOf(const AppearanceOptions& options, const std::string& path,
                       ImageEncoding encoding, const Scene& scene, const Vec3d& up) {
  TextureLookup lookup;
  lookup.image = std::make_shared<ImagePyramid>(ReadImage(path, encoding));
  lookup.repeat_u = lookup.repeat_v = options.texture_repeat;
  if (options.projection == "uv") {
    lookup.coordinates = TextureCoordinates::kChannel;
    lookup.uv = {kUvChannel, options.texture_repeat};
    return lookup;
  }
  ProjectionKind kind = ProjectionKind::kPlanar;
  if (options.projection == "cylindrical") kind = ProjectionKind::kCylindrical;
  if (options.projection == "spherical") kind = ProjectionKind::kSpherical;
  if (options.projection == "cubic") kind = ProjectionKind::kCubic;
  // A plane is looked at from above, its upper edge to the north; what goes around stands upright.
  const Vec3d vertical = Normalized(up);
  const Vec3d level =
      std::abs(vertical.y) < 0.9 ? Vec3d{0, 1, 0} : Vec3d{0, 0, vertical.y > 0 ? -1.0 : 1.0};
  const Vec3d north = Normalized(level - vertical * Dot(level, vertical));
  const bool plane = kind == ProjectionKind::kPlanar;
  lookup.projection = FitProjection(*scene.cloud, kind,
                                    options.projection_along.value_or(plane ? -vertical : north),
                                    options.projection_up.value_or(plane ? north : vertical));
  return lookup;
}

// The photographs that see each metaball, as many as the level remembers.
Channel ViewsOf(const Level& level) {
  Channel views(kViews, ChannelType::kFloat32, 1, level.cloud.size());
  for (std::size_t i = 0; i < views.size() && i + 1 < level.photo_begin.size(); ++i) {
    views.Set(i, {{static_cast<float>(level.photo_begin[i + 1] - level.photo_begin[i])}});
  }
  return views;
}

// Of a level for which no holes were closed.
Channel AllSurveyed(const Level& level) {
  Channel surveyed(kSurveyedChannel, ChannelType::kUnorm8, 1, level.cloud.size());
  for (std::size_t i = 0; i < surveyed.size(); ++i) surveyed.Set(i, {{1}});
  return surveyed;
}

void ApplyColorBy(const AppearanceOptions& options, const Level* level, int threads, Scene* scene) {
  Appearance& appearance = scene->appearance;
  appearance.color = ColorSource::kQuantity;
  PseudoColor& pseudo = appearance.pseudo;
  pseudo.map = std::make_shared<ColorMap>(ColorMapNamed(options.color_map));
  pseudo.range = options.color_range;
  const std::string& by = options.color_by;
  const std::pair<const char*, Quantity> words[] = {{"intensity", Quantity::kIntensity},
                                                    {"field", Quantity::kField},
                                                    {"distance", Quantity::kCameraDistance},
                                                    {"normal", Quantity::kNormal},
                                                    {"morton", Quantity::kMortonKey}};
  for (const auto& [word, quantity] : words) {
    if (by != word) continue;
    pseudo.quantity = quantity;
    return;
  }
  if (by == "x" || by == "y" || by == "z") {
    pseudo.quantity = Quantity::kPosition;
    pseudo.axis = {by == "x" ? 1.0 : 0.0, by == "y" ? 1.0 : 0.0, by == "z" ? 1.0 : 0.0};
    return;
  }
  if (by.starts_with("distance:")) {
    pseudo.quantity = Quantity::kPointDistance;
    pseudo.point = ParseVector(by.substr(9));
    return;
  }
  pseudo.quantity = Quantity::kChannel;
  pseudo.channel = by;
  const std::size_t colon = by.rfind(':');
  if (colon != std::string::npos && colon + 2 == by.size() && by.back() >= '0' &&
      by.back() <= '3') {
    pseudo.channel = by.substr(0, colon);
    pseudo.component = by.back() - '0';
  }
  const bool surveyed = pseudo.channel == kSurveyedChannel && level;
  if (surveyed && !pseudo.range) pseudo.range = {0, 1};
  if (scene->cloud->FindChannel(pseudo.channel)) return;
  const bool views = pseudo.channel == kViews && level && !level->photo_begin.empty();
  // Otherwise CheckAppearance says what there is.
  if (pseudo.channel != kSpacing && !views && !surveyed) return;
  auto cloud = std::make_shared<Cloud>(*scene->cloud);
  if (views) {
    cloud->channels.push_back(ViewsOf(*level));
  } else if (surveyed) {
    cloud->channels.push_back(AllSurveyed(*level));
  } else {
    AddSpacingChannel(cloud.get(), kSpacing, threads);
  }
  scene->cloud = std::move(cloud);
}

}  // namespace

const Light* AppearanceOptions::OnlyDirection() const {
  if (lights.size() != 1 || lights[0].kind != LightKind::kDirectional || lights[0].with_camera ||
      lights[0].intensity != 1 || !(lights[0].color == Vec3f{1, 1, 1})) {
    return nullptr;
  }
  return &lights[0];
}

Light ParseLight(const std::string& text) {
  Light light;
  std::string place = text;
  const std::size_t at = text.find('@');
  if (at != std::string::npos) {
    place = text.substr(0, at);
    const std::string strength = text.substr(at + 1);
    // One number is an intensity for all three.
    const bool color = strength.find(',') != std::string::npos;
    const Vec3d v = ParseVector(color ? strength : strength + ",0,0");
    if (v.x < 0 || v.y < 0 || v.z < 0) RefuseLight(text);
    if (color) {
      light.color = v.cast<float>();
    } else {
      light.intensity = v.x;
    }
  }
  if (place == "camera") return light;
  std::string kind = "sun";
  const std::size_t colon = place.find(':');
  if (colon != std::string::npos) {
    kind = place.substr(0, colon);
    place = place.substr(colon + 1);
  }
  if (kind.starts_with("camera-")) {
    light.with_camera = true;
    kind = kind.substr(7);
  }
  if (kind != "sun" && kind != "point") RefuseLight(text);
  light.kind = kind == "sun" ? LightKind::kDirectional : LightKind::kPoint;
  const Vec3d v = ParseVector(place);
  (light.kind == LightKind::kDirectional ? light.to_light : light.position) = v;
  if (light.kind == LightKind::kDirectional && !(Length(v) > 0 && Length(v) < INFINITY)) {
    throw InputError("", "", "\"" + text + "\" is no direction", "its length must be above 0");
  }
  return light;
}

ColorRange ParseColorRange(const std::string& text) {
  const Vec3d v = [&] {
    try {
      return ParseVector(text + ",0");
    } catch (const InputError&) {
      throw InputError("", "", "\"" + text + "\" is no range", "give lo,hi without blanks");
    }
  }();
  if (!(v.x < v.y)) {
    throw InputError("", "", "\"" + text + "\" is no range", "the first number must be the lower");
  }
  return {v.x, v.y};
}

void AddLightOption(CLI::App* app, AppearanceOptions* options) {
  app->add_option_function<std::vector<std::string>>(
         "--light",
         [options](const std::vector<std::string>& texts) {
           options->lights.clear();
           for (const std::string& text : texts) {
             try {
               options->lights.push_back(ParseLight(text));
             } catch (const Error& error) {
               throw CLI::ValidationError("--light", error.what());
             }
           }
         },
         "direction towards the light, world, or point:X,Y,Z, camera, camera-sun:X,Y,Z or "
         "camera-point:X,Y,Z (in the camera's axes: right, down, forward), each with @INTENSITY or "
         "@R,G,B after it; may be given several times [default: the light is at the camera]")
      ->type_name("X,Y,Z")
      ->allow_extra_args(false)
      ->group("Surface and light");
}

void AddAppearanceOptions(CLI::App* app, AppearanceOptions* options) {
  constexpr const char* kSurface = "Surface and light";
  constexpr const char* kLook = "Appearance";
  app->add_flag("--shadows", options->shadows, "lights away from the camera throw shadows")
      ->group(kSurface);
  auto* ambient = app->add_flag("--ambient-occlusion", options->ambient_occlusion,
                                "ambient light is weaker where the surface hides the sky");
  ambient->group(kSurface);
  AddSetting(app, "ao-directions", &options->ao_directions, "N")->needs(ambient)->group(kSurface);
  AddSetting(app, "ao-distance", &options->ao_distance, "D")->needs(ambient)->group(kSurface);
  AddChoice(app, "--normals", &options->normals, {"gradient", "influence"},
            "normals of the field, or weighted by the metaballs' influence (thesis 3.5) [default "
            "gradient]")
      ->group(kSurface);

  auto* by = app->add_option(
                    "--color-by", options->color_by,
                    "colours stand for a quantity: intensity, field, x, y, z, distance "
                    "(from the camera), distance:X,Y,Z, normal, morton, spacing, views "
                    "and surveyed (of a level), or a channel of the cloud (NAME or NAME:COMPONENT)")
                 ->type_name("QUANTITY")
                 ->group(kLook);
  AddChoice(app, "--color-map", &options->color_map, ColorMapNames(),
            "colours of --color-by [default viridis]")
      ->needs(by)
      ->group(kLook);
  AddParsed(app, "--color-range",
            "values at the ends of the map [default: found from the metaballs]",
            [options](const std::string& text) { options->color_range = ParseColorRange(text); })
      ->type_name("LO,HI")
      ->needs(by)
      ->group(kLook);
  auto* texture =
      app->add_option("--texture", options->texture, "an image, looked up at every surface point")
          ->type_name("FILE")
          ->excludes(by)
          ->group(kLook);
  app->add_option("--normal-map", options->normal_map,
                  "an image that bends the normals (thesis 3.6), projected like the texture")
      ->type_name("FILE")
      ->group(kLook);
  AddChoice(app, "--projection", &options->projection,
            {"planar", "cylindrical", "spherical", "cubic", "uv"},
            "how images lie on the surface; uv: by the cloud's channel of that name [default "
            "planar, seen from above]")
      ->group(kLook);
  AddDirection(app, "--projection-along", &options->projection_along,
               "the direction in which images are looked at")
      ->group(kLook);
  AddDirection(app, "--projection-up", &options->projection_up, "what is up in images")
      ->group(kLook);
  AddChoice(app, "--texture-mode", &options->texture_mode, {"surface", "per-metaball"},
            "look the texture up at the surface point, or once for each metaball (the thesis's "
            "way) [default surface]")
      ->needs(texture)
      ->group(kLook);
  app->add_flag("--texture-repeat", options->texture_repeat, "images repeat beyond their borders")
      ->group(kLook);
  AddSetting(app, "filter", &options->filter, "N")->group(kLook);
}

void ApplyAppearance(const AppearanceOptions& options, const Level* level, const Vec3d& up,
                     int threads, Scene* scene) {
  Appearance& appearance = scene->appearance;
  if (!options.OnlyDirection()) appearance.lights = options.lights;
  appearance.shadows.enabled = options.shadows;
  AmbientOcclusion& occlusion = appearance.occlusion;
  occlusion.enabled = options.ambient_occlusion;
  occlusion.directions = static_cast<int>(ValueOf("ao-directions", options.ao_directions));
  occlusion.distance = ValueOf("ao-distance", options.ao_distance);
  if (options.normals == "influence") appearance.normal = NormalSource::kInfluence;
  appearance.filter = static_cast<int>(ValueOf("filter", options.filter));
  if (appearance.filter % 2 == 0) {
    throw InputError("--filter", "", "the filter is an odd number of pixels wide",
                     "give 1, 3, 5, 7, 9 or 11");
  }
  const bool images = !options.texture.empty() || !options.normal_map.empty();
  if (images && options.projection == "uv" && scene->cloud->FindChannel(kUvChannel) &&
      !scene->cloud->FindChannel(UvGradientName(kUvChannel, 0))) {
    auto cloud = std::make_shared<Cloud>(*scene->cloud);
    AddUvGradients(cloud.get(), kUvChannel, options.texture_repeat, threads);
    scene->cloud = std::move(cloud);
  }
  if (!options.color_by.empty()) ApplyColorBy(options, level, threads, scene);
  if (!options.texture.empty()) {
    TextureLookup lookup = LookupOf(options, options.texture, ImageEncoding::kSrgb8, *scene, up);
    if (options.texture_mode == "surface") {
      appearance.color = ColorSource::kTexture;
      appearance.texture = std::move(lookup);
    } else {
      auto cloud = std::make_shared<Cloud>(*scene->cloud);
      cloud->color = TextureColors(*cloud, lookup, threads);
      scene->cloud = std::move(cloud);
    }
  }
  if (!options.normal_map.empty()) {
    appearance.normal_map.source = NormalMapSource::kImage;
    appearance.normal_map.lookup =
        LookupOf(options, options.normal_map, ImageEncoding::kData8, *scene, up);
  }
  CheckAppearance(*scene);
  // A range that cannot be found (a component that does not exist) is told before the work.
  if (appearance.color == ColorSource::kQuantity) RangeOf(*scene, Camera{});
}

}  // namespace sherd::cli
