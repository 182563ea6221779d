// How a surface looks beyond blended colours and one light: all of it data of the scene.
//
// A scene that leaves everything at its default pays nothing for this. Otherwise the picture is
// made in two steps: the tracer finds the surface and fills the planes that are needed, then passes
// over the finished frame colour and light it (metaball/appearance/deferred.h).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "metaball/appearance/color_map.h"
#include "metaball/appearance/image.h"
#include "metaball/appearance/projection.h"
#include "metaball/appearance/volume_texture.h"
#include "metaball/frame.h"
#include "metaball/vec.h"

namespace sherd {

// ---- colour ---------------------------------------------------------------------------------

enum class ColorSource {
  kBlended,   // the metaballs' own colours (thesis 3.1)
  kQuantity,  // a quantity through a colour map (thesis 3.2-3.4)
  kTexture,   // an image, looked up at the surface point
  kVolume,    // a three-dimensional texture
};

enum class Quantity {
  kIntensity,       // sum f^2 / F (thesis 3.2): how much one metaball decides alone
  kField,           // F = sum f; the threshold itself, but where a ray starts inside the surface
  kPosition,        // along an axis (thesis 3.3)
  kCameraDistance,  // world units, from the camera's eye
  kPointDistance,   // world units, from a point
  kNormal,          // the normal's x, y, z as red, green, blue; no map
  kMortonKey,  // of the surface point in the cube around the centres, 10 levels (thesis 2.4.2),
               // 0 to 1
  kChannel,    // of V
};

struct ColorRange {
  double lo = 0, hi = 1;  // lo < hi, finite
  friend bool operator==(const ColorRange&, const ColorRange&) = default;
};

struct PseudoColor {
  Quantity quantity = Quantity::kIntensity;
  Vec3d axis{0, 0, 1};                  // kPosition; any length > 0
  Vec3d point{};                        // kPointDistance; world
  std::string channel;                  // kChannel
  int component = 0;                    // of that channel; -1: the length of its vector
  std::shared_ptr<const ColorMap> map;  // null: viridis
  std::optional<ColorRange> range;      // none: RangeOf (pseudo_color.h)
  friend bool operator==(const PseudoColor&, const PseudoColor&) = default;
};

enum class TextureCoordinates {
  kChannel,     // a channel of V with two components, blended to the surface point
  kProjection,  // computed at the surface point itself
};

struct TextureLookup {
  std::shared_ptr<const ImagePyramid> image;  // never null where the lookup is used
  TextureCoordinates coordinates = TextureCoordinates::kProjection;
  UvRequest uv{"uv"};  // for kChannel
  TextureProjection projection;
  bool repeat_u = false, repeat_v = false;  // outside [0, 1]; else the border goes on
};

// ---- normals --------------------------------------------------------------------------------

enum class NormalSource {
  kGradient,   // of the field: the true normal
  kInfluence,  // sum (f / F) (p - c) / |p - c| (thesis 3.5); the gradient where that cancels
};

enum class NormalMapSource {
  kNone,
  kChannel,  // a channel of V with three components, world axes (thesis 3.6 as it is)
  kImage,    // an image in the surface's own axes: right and up of the image, and outwards
};

// thesis 3.6: N = (N_surface + N_map) / 2, made a unit vector. Images hold x and y in [-1, 1] as
// 0 to 255 and z in [0, 1] as 128 to 255.
struct NormalMap {
  NormalMapSource source = NormalMapSource::kNone;
  std::string channel = "normal_map";
  TextureLookup lookup;
};

// ---- light ----------------------------------------------------------------------------------

enum class LightKind {
  kCamera,       // at the camera's eye
  kDirectional,  // infinitely far away
  kPoint,        // at a place; as strong at every distance (thesis 3.7)
};

struct Light {
  LightKind kind = LightKind::kCamera;
  Vec3d to_light{0, 0, 1};   // kDirectional: towards the light, any length > 0
  Vec3d position{};          // kPoint
  bool with_camera = false;  // to_light or position in the camera's axes (right, down, forward)
  Vec3f color{1, 1, 1};      // linear, >= 0
  double intensity = 1;      // >= 0
};

// Both are found by casting rays from each surface point through the whole cloud. A crossing that
// lies less than `bias` radii of the metaball there before the point is the point's own surface.
struct Shadows {
  bool enabled = false;  // of every light but those at the camera
  double bias = 0.05;    // > 0
};

// The ambient light's share that reaches a point: the cosine-weighted share of the directions above
// it along which nothing lies within the distance.
struct AmbientOcclusion {
  bool enabled = false;
  int directions = 32;  // over the whole sphere, 4..1024; the same for every pixel
  double distance = 0;  // world units; 0: a tenth of the diagonal of the centres' box
  double bias = 0.05;   // radii, > 0
};

struct Appearance {
  ColorSource color = ColorSource::kBlended;
  PseudoColor pseudo;
  TextureLookup texture;
  std::shared_ptr<const VolumeTexture> volume;  // for kVolume
  NormalSource normal = NormalSource::kGradient;
  NormalMap normal_map;
  std::vector<Light> lights;  // empty: the one of Scene::lighting
  Shadows shadows;
  AmbientOcclusion occlusion;
  int filter = 1;  // box filter on the finished picture (thesis 4.3): 1, 3, 5, 7, 9 or 11 pixels
};

}  // namespace sherd
