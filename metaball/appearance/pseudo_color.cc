#include "metaball/appearance/pseudo_color.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "metaball/appearance/gather.h"
#include "metaball/error.h"
#include "metaball/morton.h"

namespace sherd {
namespace {

constexpr std::size_t kRangeSamples = 65536;
constexpr double kRangeTail = 0.02;
constexpr int kMortonBits = 10;  // levels of the thesis's octree

double ComponentOf(const float* v, int components, int component) {
  if (component >= 0) return v[component];
  double sum = 0;
  for (int k = 0; k < components; ++k) sum += static_cast<double>(v[k]) * v[k];
  return std::sqrt(sum);
}

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

PseudoColorPass::PseudoColorPass(const Scene& scene, const Camera& camera, const Frame& frame)
    : pseudo_(scene.appearance.pseudo),
      map_(MapOf(pseudo_)),
      frame_(frame),
      range_(RangeOf(scene, camera)),
      axis_(Normalized(pseudo_.axis)),
      eye_(camera.eye) {
  if (pseudo_.quantity == Quantity::kChannel) {
    CheckComponent(ChannelNamed(*scene.cloud, pseudo_.channel), pseudo_.component);
    for (const ChannelPlane& plane : frame.channels) {
      if (plane.name == pseudo_.channel) plane_ = &plane;
    }
  }
  if (pseudo_.quantity == Quantity::kMortonKey) {
    const Box3f box = scene.cloud->CenterBox();
    const Vec3f size = box.max - box.min;
    const float side = std::max({size.x, size.y, size.z});
    cube_min_ = scene.cloud->frame.WorldFromLocal(box.min);
    cube_side_ = (side > 0 ? side : 1) * scene.cloud->frame.unit;
  }
}

double PseudoColorPass::ValueAt(std::size_t pixel, const Vec3d& point) const {
  switch (pseudo_.quantity) {
    case Quantity::kIntensity:
      return frame_.intensity[pixel];
    case Quantity::kField:
      return frame_.weight[pixel];
    case Quantity::kPosition:
      return Dot(point, axis_);
    case Quantity::kCameraDistance:
      return Length(point - eye_);
    case Quantity::kPointDistance:
      return Length(point - pseudo_.point);
    case Quantity::kMortonKey: {
      const auto cell = [&](double v) {
        const double x = v / cube_side_ * (1 << kMortonBits);
        return static_cast<std::uint32_t>(
            std::clamp(x, 0.0, static_cast<double>((1 << kMortonBits) - 1)));
      };
      const Vec3d p = point - cube_min_;
      return static_cast<double>(MortonKey63(cell(p.x), cell(p.y), cell(p.z))) /
             static_cast<double>((1u << 3 * kMortonBits) - 1);
    }
    default:
      break;
  }
  const auto components = static_cast<std::size_t>(plane_->components);
  return ComponentOf(&plane_->values[pixel * components], plane_->components, pseudo_.component);
}

Vec3f PseudoColorPass::ColorAt(std::size_t pixel, const Vec3d& point, const Vec3f& normal) const {
  if (pseudo_.quantity == Quantity::kNormal) {
    // As picture programs show normal maps: the encoded value is (n + 1) / 2.
    const auto value = [](float v) {
      return LinearFromSrgb(std::clamp(0.5f * v + 0.5f, 0.0f, 1.0f));
    };
    return {value(normal.x), value(normal.y), value(normal.z)};
  }
  return map_.At((ValueAt(pixel, point) - range_.lo) / (range_.hi - range_.lo));
}

}  // namespace sherd
