// Colour maps: a value in [0, 1] becomes a colour (thesis 3.4, algorithm 4).
//
// The maps are stored as a few colours and interpolated in Oklab (Ottosson 2020), so that equal
// steps of the value look equal and no band shows. viridis, magma: Smith and van der Walt 2015;
// cividis: Nunez, Anderton and Renslow 2018; all three in the public domain (CC0).
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "metaball/color.h"
#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd {

// What stands for "no value here", linear light: a grey that none of the maps but grey holds.
inline constexpr Vec3f kNoValue{0.2f, 0.2f, 0.2f};

// A map as a table, on the CPU or on the GPU.
struct ColorMapView {
  static constexpr int kSteps = 1024;
  const Vec3f* table = nullptr;  // kSteps + 1 colours, linear light, even steps over [0, 1]

  // Linear light, interpolated. t is clamped to [0, 1]; NaN gives kNoValue.
  SHERD_HD Vec3f At(double t) const {
    if (std::isnan(t)) return {kNoValue.x, kNoValue.y, kNoValue.z};
    const double x = std::clamp(t, 0.0, 1.0) * kSteps;
    const int k = std::min(static_cast<int>(x), kSteps - 1);
    const auto part = static_cast<float>(x - k);
    return table[k] * (1.0f - part) + table[k + 1] * part;
  }
};

class ColorMap {
 public:
  // Two colours or more, evenly spaced over [0, 1]. Throws Error for fewer.
  ColorMap(std::string name, const std::vector<Rgb8>& nodes);

  const std::string& name() const { return name_; }
  // Valid while the map lives.
  ColorMapView view() const { return {table_.data()}; }
  // As ColorMapView::At. Thread-safe.
  Vec3f At(double t) const { return view().At(t); }
  // The map read from its other end.
  ColorMap Reversed() const;

 private:
  std::string name_;
  std::vector<Rgb8> nodes_;
  std::vector<Vec3f> table_;  // of the view
};

// "viridis" (the default), "cividis", "magma", "grey" (from a dark grey on), and "ten": ten colours
// along the hues, as the thesis's figures 4.2 and 4.3 use (their values are not printed; these are
// ours).
const std::vector<std::string>& ColorMapNames();
// Throws InputError naming the maps there are. The result lives as long as the program.
const ColorMap& ColorMapNamed(std::string_view name);

}  // namespace sherd
