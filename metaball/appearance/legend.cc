#include "metaball/appearance/legend.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "metaball/appearance/pseudo_color.h"
#include "metaball/error.h"

namespace sherd {
namespace {

constexpr int kBarColors = 256;

// Decimal point in every locale.
std::string LabelOf(double value, int decimals) {
  char text[64];
  if (value != 0 && (std::abs(value) >= 1e7 || decimals > 6)) {
    std::snprintf(text, sizeof(text), "%.3g", value);
  } else {
    std::snprintf(text, sizeof(text), "%.*f", std::max(decimals, 0), value == 0 ? 0.0 : value);
  }
  std::string label = text;
  std::replace(label.begin(), label.end(), ',', '.');
  return label;
}

}  // namespace

std::vector<double> RoundTicks(double lo, double hi, int max_ticks, int* decimals) {
  *decimals = 0;
  if (!(hi > lo) || !std::isfinite(hi - lo)) return {lo};
  const int most = std::max(max_ticks, 2);
  double power = std::pow(10.0, std::floor(std::log10((hi - lo) / most)));
  for (;; power *= 10) {
    for (const int digit : {1, 2, 5}) {
      const double step = digit * power;
      const double first = std::ceil(lo / step - 1e-9), last = std::floor(hi / step + 1e-9);
      if (!(last - first + 1 <= most)) continue;
      *decimals = std::max(0, static_cast<int>(std::ceil(-std::log10(power) - 1e-9)));
      std::vector<double> ticks;
      // Divided by whole powers of ten: 0.6 and not 0.6000000000000001; never -0.
      const double divisor = power < 1 ? std::round(1 / power) : 1;
      for (double k = first; k <= last; ++k) {
        const double tick = power < 1 ? k * digit / divisor : k * step;
        ticks.push_back(std::clamp(tick + 0.0, lo, hi));
      }
      return ticks;
    }
  }
}

Legend MakeLegend(const Scene& scene, const Camera& camera, int max_ticks) {
  const PseudoColor& pseudo = scene.appearance.pseudo;
  if (scene.appearance.color != ColorSource::kQuantity) {
    throw Error("only a picture coloured by a quantity has a legend");
  }
  if (pseudo.quantity == Quantity::kNormal) {
    throw Error("normals are shown as three colours: there is no bar to draw");
  }
  Legend legend;
  legend.title = TitleOf(pseudo);
  legend.range = RangeOf(scene, camera);
  for (int i = 0; i < kBarColors; ++i) {
    legend.colors.push_back(
        Rgb8FromLinear(MapOf(pseudo).At(static_cast<double>(i) / (kBarColors - 1))));
  }
  int decimals = 0;
  for (const double value : RoundTicks(legend.range.lo, legend.range.hi, max_ticks, &decimals)) {
    legend.ticks.push_back({(value - legend.range.lo) / (legend.range.hi - legend.range.lo), value,
                            LabelOf(value, decimals)});
  }
  return legend;
}

}  // namespace sherd
