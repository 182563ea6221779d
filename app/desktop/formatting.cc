#include "app/desktop/formatting.h"

#include <algorithm>
#include <cmath>

namespace sherd {

QString formatCoordinate(double value, double resolution) {
  int decimals = 3;
  if (resolution > 0 && std::isfinite(resolution)) {
    decimals = static_cast<int>(std::clamp(std::ceil(-std::log10(resolution)), 0.0, 9.0));
  }
  return QString::number(value, 'f', decimals);
}

}  // namespace sherd
