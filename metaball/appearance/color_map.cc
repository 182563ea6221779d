#include "metaball/appearance/color_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "metaball/error.h"

namespace sherd {
namespace {

Vec3f OklabFromLinear(const Vec3f& c) {
  const float l = std::cbrt(0.4122214708f * c.x + 0.5363325363f * c.y + 0.0514459929f * c.z);
  const float m = std::cbrt(0.2119034982f * c.x + 0.6806995451f * c.y + 0.1073969566f * c.z);
  const float s = std::cbrt(0.0883024619f * c.x + 0.2817188376f * c.y + 0.6299787005f * c.z);
  return {0.2104542553f * l + 0.7936177850f * m - 0.0040720468f * s,
          1.9779984951f * l - 2.4285922050f * m + 0.4505937099f * s,
          0.0259040371f * l + 0.7827717662f * m - 0.8086757660f * s};
}

Vec3f LinearFromOklab(const Vec3f& c) {
  const float l = c.x + 0.3963377774f * c.y + 0.2158037573f * c.z;
  const float m = c.x - 0.1055613458f * c.y - 0.0638541728f * c.z;
  const float s = c.x - 0.0894841775f * c.y - 1.2914855480f * c.z;
  const float l3 = l * l * l, m3 = m * m * m, s3 = s * s * s;
  const auto clamped = [](float v) { return std::clamp(v, 0.0f, 1.0f); };
  return {clamped(4.0767416621f * l3 - 3.3077115913f * m3 + 0.2309699292f * s3),
          clamped(-1.2684380046f * l3 + 2.6097574011f * m3 - 0.3413193965f * s3),
          clamped(-0.0041960863f * l3 - 0.7034186147f * m3 + 1.7076147010f * s3)};
}

constexpr Rgb8 Hex(unsigned v) {
  return {static_cast<std::uint8_t>(v >> 16), static_cast<std::uint8_t>(v >> 8 & 255),
          static_cast<std::uint8_t>(v & 255)};
}

std::vector<Rgb8> Nodes(std::initializer_list<unsigned> colors) {
  std::vector<Rgb8> nodes;
  for (const unsigned color : colors) nodes.push_back(Hex(color));
  return nodes;
}

const std::vector<ColorMap>& Maps() {
  static const std::vector<ColorMap> maps = {
      {"viridis", Nodes({0x440154, 0x482878, 0x3e4989, 0x31688e, 0x26828e, 0x1f9e89, 0x35b779,
                         0x6ece58, 0xb5de2b, 0xfde725})},
      {"cividis", Nodes({0x00224e, 0x123570, 0x3b496c, 0x575d6d, 0x707173, 0x8a8678, 0xa59c74,
                         0xc3b369, 0xe1cc55, 0xfee838})},
      {"magma", Nodes({0x000004, 0x180f3d, 0x440f76, 0x721f81, 0x9e2f7f, 0xcd4071, 0xf1605d,
                       0xfd9668, 0xfeca8d, 0xfcfdbf})},
      {"grey", Nodes({0x1a1a1a, 0xffffff})},
      {"ten", Nodes({0x5e2ca5, 0x2f4bd6, 0x1f8de0, 0x1fc3c9, 0x25b36b, 0x8fd135, 0xf2e02e, 0xf59a1e,
                     0xe4412f, 0xb3206f})},
  };
  return maps;
}

}  // namespace

ColorMap::ColorMap(std::string name, const std::vector<Rgb8>& nodes)
    : name_(std::move(name)), nodes_(nodes) {
  if (nodes_.size() < 2) throw Error("a colour map needs at least two colours");
  std::vector<Vec3f> lab;
  for (const Rgb8& node : nodes_) lab.push_back(OklabFromLinear(LinearFromRgb8(node)));
  constexpr int kSteps = ColorMapView::kSteps;
  for (int i = 0; i <= kSteps; ++i) {
    const float x = static_cast<float>(i) / kSteps * static_cast<float>(lab.size() - 1);
    const std::size_t k = std::min(static_cast<std::size_t>(x), lab.size() - 2);
    const float part = x - static_cast<float>(k);
    table_.push_back(LinearFromOklab(lab[k] * (1.0f - part) + lab[k + 1] * part));
  }
}

ColorMap ColorMap::Reversed() const {
  return {name_, std::vector<Rgb8>(nodes_.rbegin(), nodes_.rend())};
}

const std::vector<std::string>& ColorMapNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const ColorMap& map : Maps()) all.push_back(map.name());
    return all;
  }();
  return names;
}

const ColorMap& ColorMapNamed(std::string_view name) {
  std::string known;
  for (const ColorMap& map : Maps()) {
    if (map.name() == name) return map;
    known += (known.empty() ? "" : ", ") + map.name();
  }
  throw InputError("", "", "there is no colour map '" + std::string(name) + "'",
                   "there are " + known);
}

}  // namespace sherd
