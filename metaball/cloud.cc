#include "metaball/cloud.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "metaball/error.h"
#include "metaball/morton.h"

namespace sherd {
namespace {

std::uint32_t MortonCoordinate(float v) {
  // [-1, 1] to 21 bits.
  const double scaled = (static_cast<double>(v) + 1.0) * 0.5 * 2097151.0;
  return static_cast<std::uint32_t>(std::clamp(scaled, 0.0, 2097151.0));
}

template <class T>
std::size_t BytesOf(const std::vector<T>& v) {
  return v.capacity() * sizeof(T);
}

}  // namespace

LocalFrame LocalFrame::ForBox(const Vec3d& min, const Vec3d& max) {
  LocalFrame frame;
  // Halved before adding: the sum of two huge coordinates may overflow.
  frame.origin = min * 0.5 + max * 0.5;
  const Vec3d half = max * 0.5 - min * 0.5;
  const double extent = std::max({half.x, half.y, half.z});
  if (extent > 0) {
    int exponent = 0;
    std::frexp(extent, &exponent);
    frame.unit = std::ldexp(1.0, std::clamp(exponent, -1000, 1000));
    // An origin on the float grid of the unit: shifting the whole survey by a multiple of it leaves
    // every local coordinate the same.
    const double grid = frame.unit * 0x1p-24;
    for (double* v : {&frame.origin.x, &frame.origin.y, &frame.origin.z}) {
      const double snapped = std::nearbyint(*v / grid) * grid;
      if (std::isfinite(snapped)) *v = snapped;
    }
  }
  return frame;
}

std::size_t Cloud::MemoryBytes() const {
  std::size_t bytes = BytesOf(center) + BytesOf(radius) + BytesOf(color) + BytesOf(threshold);
  for (const Channel& channel : channels) bytes += channel.MemoryBytes();
  return bytes;
}

const Channel* Cloud::FindChannel(std::string_view name) const {
  for (const Channel& channel : channels) {
    if (channel.name() == name) return &channel;
  }
  return nullptr;
}

Box3f Cloud::CenterBox() const {
  if (center.empty()) return {};
  Box3f box{center[0], center[0]};
  for (const Vec3f& p : center) {
    box.min = {std::min(box.min.x, p.x), std::min(box.min.y, p.y), std::min(box.min.z, p.z)};
    box.max = {std::max(box.max.x, p.x), std::max(box.max.y, p.y), std::max(box.max.z, p.z)};
  }
  return box;
}

void Cloud::Validate(const std::string& source) const {
  const auto metaball = [](std::size_t i) { return "metaball " + std::to_string(i); };
  if (!(frame.unit > 0) || !std::isfinite(frame.unit) || !IsFinite(frame.origin)) {
    throw InputError(source, "", "the cloud's frame is not finite");
  }
  const auto check_size = [&](std::size_t values, const std::string& what) {
    if (values == size()) return;
    throw InputError(source, "",
                     "there are " + std::to_string(values) + " " + what + " for " +
                         std::to_string(size()) + " metaballs");
  };
  if (!radius.empty()) check_size(radius.size(), "radii");
  if (!color.empty()) check_size(color.size(), "colours");
  if (!threshold.empty()) check_size(threshold.size(), "thresholds");
  for (const Channel& channel : channels) {
    check_size(channel.size(), "values of channel '" + channel.name() + "'");
    if (FindChannel(channel.name()) != &channel) {
      throw InputError(source, "", "there are two channels named '" + channel.name() + "'");
    }
  }
  if (size() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max())) {
    throw InputError(source, "", "a cloud holds at most 2147483647 metaballs");
  }
  for (std::size_t i = 0; i < size(); ++i) {
    if (!IsFinite(center[i])) throw InputError(source, metaball(i), "the centre is not finite");
    const float r = RadiusOf(i);
    if (!(r > 0) || !std::isfinite(r)) {
      throw InputError(source, metaball(i), "the radius must be positive and finite");
    }
    if (!threshold.empty() && (!(threshold[i] > 0) || !std::isfinite(threshold[i]))) {
      throw InputError(source, metaball(i), "the threshold must be positive and finite");
    }
  }
}

Cloud BuildCloud(const CloudInput& input, CloudReport* report, std::vector<std::uint32_t>* order) {
  const std::size_t n = input.center.size();
  const auto check_size = [&](std::size_t values, const std::string& what) {
    if (values != n) throw Error("BuildCloud: as many " + what + " as centres are needed, or none");
  };
  if (!input.radius.empty()) check_size(input.radius.size(), "radii");
  if (!input.color.empty()) check_size(input.color.size(), "colours");
  if (!input.threshold.empty()) check_size(input.threshold.size(), "thresholds");
  for (const Channel& channel : input.channels) {
    check_size(channel.size(), "values of channel '" + channel.name() + "'");
  }
  if (n > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max())) {
    throw Error("a cloud holds at most 2147483647 metaballs");
  }
  CloudReport counts;
  const bool own_radius = !input.radius.empty();
  std::vector<std::pair<std::uint64_t, std::uint32_t>> kept;
  kept.reserve(n);
  Vec3d min{INFINITY, INFINITY, INFINITY}, max{-INFINITY, -INFINITY, -INFINITY};
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3d& p = input.center[i];
    const double r = own_radius ? input.radius[i] : input.uniform_radius;
    if (!IsFinite(p) || !std::isfinite(r)) {
      ++counts.dropped_not_finite;
      continue;
    }
    if (!(r > 0)) {
      ++counts.dropped_radius;
      continue;
    }
    if (!input.threshold.empty() &&
        (!(input.threshold[i] > 0) || !std::isfinite(input.threshold[i]))) {
      ++counts.dropped_threshold;
      continue;
    }
    kept.emplace_back(0, static_cast<std::uint32_t>(i));
    min = {std::min(min.x, p.x), std::min(min.y, p.y), std::min(min.z, p.z)};
    max = {std::max(max.x, p.x), std::max(max.y, p.y), std::max(max.z, p.z)};
  }
  Cloud cloud;
  if (!kept.empty()) cloud.frame = LocalFrame::ForBox(min, max);
  if (kept.size() == 1) {
    // No extent to scale by: the radius gives the unit.
    const double r = own_radius ? input.radius[kept[0].second] : input.uniform_radius;
    cloud.frame = LocalFrame::ForBox(min - Vec3d{r, r, r}, max + Vec3d{r, r, r});
  }
  for (auto& [key, i] : kept) {
    const Vec3f p = cloud.frame.LocalFromWorld(input.center[i]).cast<float>();
    key = MortonKey63(MortonCoordinate(p.x), MortonCoordinate(p.y), MortonCoordinate(p.z));
  }
  std::sort(kept.begin(), kept.end());

  // A radius that a float cannot hold in local units is clamped to the float range.
  const auto local_radius = [&](double r) {
    return static_cast<float>(std::clamp(r / cloud.frame.unit, 1e-30, 1e30));
  };
  cloud.center.reserve(kept.size());
  if (own_radius) cloud.radius.reserve(kept.size());
  if (!input.color.empty()) cloud.color.reserve(kept.size());
  if (!own_radius && !kept.empty()) cloud.uniform_radius = local_radius(input.uniform_radius);
  if (!input.threshold.empty()) cloud.threshold.reserve(kept.size());
  std::vector<std::uint32_t> input_idx;
  input_idx.reserve(kept.size());
  for (const auto& [key, i] : kept) {
    cloud.center.push_back(cloud.frame.LocalFromWorld(input.center[i]).cast<float>());
    if (own_radius) cloud.radius.push_back(local_radius(input.radius[i]));
    if (!input.color.empty()) cloud.color.push_back(input.color[i]);
    if (!input.threshold.empty()) {
      cloud.threshold.push_back(static_cast<float>(input.threshold[i]));
    }
    input_idx.push_back(i);
  }
  for (const Channel& channel : input.channels) {
    cloud.channels.push_back(channel.Reordered(input_idx));
  }
  if (order) *order = std::move(input_idx);
  if (report) *report = counts;
  return cloud;
}

}  // namespace sherd
