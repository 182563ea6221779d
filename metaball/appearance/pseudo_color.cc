#include "metaball/appearance/pseudo_color.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "metaball/appearance/gather.h"
#include "metaball/error.h"

namespace sherd {
namespace {

constexpr std::size_t kRangeSamples = 65536;
constexpr double kRangeTail = 0.02;

void CheckComponent(const Channel& channel, int component) {
  if (component >= -1 && component < channel.components()) return;
  throw Error("channel '" + channel.name() + "' has " + std::to_string(channel.components()) +
              (channel.components() == 1 ? " component" : " components") + ", so there is no " +
              std::to_string(component));
}

// Robust bounds of value(i) over the metaballs; values that are not finite are left out.
template <class Value>
ColorRange Percentiles(std::size_t n, const Value& value) {
  const std::size_t count = std::min(n, kRangeSamples);
  std::vector<double> values;
  for (std::size_t k = 0; k < count; ++k) {
    const double v = value(k * n / count);
    if (std::isfinite(v)) values.push_back(v);
  }
  if (values.empty()) return {};
  const auto at = [&](double share) {
    const auto place =
        static_cast<std::ptrdiff_t>(std::lround(share * static_cast<double>(values.size() - 1)));
    std::nth_element(values.begin(), values.begin() + place, values.end());
    return values[static_cast<std::size_t>(place)];
  };
  ColorRange range{at(kRangeTail), at(1 - kRangeTail)};
  if (!(range.hi > range.lo)) {  // one value: the middle of the map
    const double room = std::max(std::abs(range.lo) * 1e-3, 1e-9);
    range = {range.lo - room, range.hi + room};
  }
  return range;
}

}  // namespace

const ColorMap& MapOf(const PseudoColor& pseudo) {
  return pseudo.map ? *pseudo.map : ColorMapNamed("viridis");
}

std::string TitleOf(const PseudoColor& pseudo) {
  switch (pseudo.quantity) {
    case Quantity::kIntensity:
      return "intensity";
    case Quantity::kField:
      return "field";
    case Quantity::kPosition: {
      const Vec3d& a = pseudo.axis;
      if (a.y == 0 && a.z == 0 && a.x > 0) return "x";
      if (a.x == 0 && a.z == 0 && a.y > 0) return "y";
      if (a.x == 0 && a.y == 0 && a.z > 0) return "z";
      return "position along the axis";
    }
    case Quantity::kCameraDistance:
      return "distance from the camera";
    case Quantity::kPointDistance:
      return "distance from the point";
    case Quantity::kNormal:
      return "normal";
    case Quantity::kMortonKey:
      return "Morton key";
    case Quantity::kChannel:
      break;
  }
  return pseudo.channel;
}

ColorRange RangeOf(const Scene& scene, const Camera& camera) {
  const PseudoColor& pseudo = scene.appearance.pseudo;
  if (pseudo.range) {
    if (!(pseudo.range->lo < pseudo.range->hi) ||
        !std::isfinite(pseudo.range->hi - pseudo.range->lo)) {
      throw Error("the range of the colours needs a lower and a higher end");
    }
    return *pseudo.range;
  }
  const Cloud& cloud = *scene.cloud;
  const double threshold = scene.surface.threshold;
  const auto center = [&](std::size_t i) { return cloud.frame.WorldFromLocal(cloud.center[i]); };
  switch (pseudo.quantity) {
    case Quantity::kIntensity:
      return {0, threshold};
    case Quantity::kField:
      return {threshold, threshold < 1 ? 1 : 2 * threshold};
    case Quantity::kPosition: {
      const Vec3d axis = Normalized(pseudo.axis);
      return Percentiles(cloud.size(), [&](std::size_t i) { return Dot(center(i), axis); });
    }
    case Quantity::kCameraDistance:
    case Quantity::kPointDistance: {
      const Vec3d from = pseudo.quantity == Quantity::kCameraDistance ? camera.eye : pseudo.point;
      return Percentiles(cloud.size(), [&](std::size_t i) { return Length(center(i) - from); });
    }
    case Quantity::kNormal:
    case Quantity::kMortonKey:
      return {0, 1};
    case Quantity::kChannel:
      break;
  }
  const Channel& channel = ChannelNamed(cloud, pseudo.channel);
  CheckComponent(channel, pseudo.component);
  return Percentiles(cloud.size(), [&](std::size_t i) {
    return ComponentOf(channel.Get(i).v, channel.components(), pseudo.component);
  });
}

QuantityView MakeQuantityView(const Scene& scene, const Camera& camera) {
  const PseudoColor& pseudo = scene.appearance.pseudo;
  QuantityView view;
  view.quantity = pseudo.quantity;
  view.range = RangeOf(scene, camera);
  view.axis = Normalized(pseudo.axis);
  view.eye = camera.eye;
  view.point = pseudo.point;
  view.map = MapOf(pseudo).view();
  if (pseudo.quantity == Quantity::kChannel) {
    const Channel& channel = ChannelNamed(*scene.cloud, pseudo.channel);
    CheckComponent(channel, pseudo.component);
    view.components = channel.components();
    view.component = pseudo.component;
  }
  if (pseudo.quantity == Quantity::kMortonKey) {
    const Box3f box = scene.cloud->CenterBox();
    const Vec3f size = box.max - box.min;
    const float side = std::max({size.x, size.y, size.z});
    view.cube_min = scene.cloud->frame.WorldFromLocal(box.min);
    view.cube_side = (side > 0 ? side : 1) * scene.cloud->frame.unit;
  }
  return view;
}

QuantityView QuantityOf(const Scene& scene, const Camera& camera, const Frame& frame) {
  QuantityView view = MakeQuantityView(scene, camera);
  view.intensity = frame.intensity.data();
  view.weight = frame.weight.data();
  for (const ChannelPlane& plane : frame.channels) {
    if (plane.name == scene.appearance.pseudo.channel) view.channel = plane.values.data();
  }
  return view;
}

}  // namespace sherd
