#include "metaball/moving.h"

#include <algorithm>
#include <cmath>

#include "metaball/error.h"

namespace sherd {
namespace {

constexpr const char* kSource = "the moving cloud";

std::string Metaball(std::size_t i) { return "metaball " + std::to_string(i); }

void CheckPositive(std::span<const double> values, const std::string& what) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] > 0 && std::isfinite(values[i])) continue;
    throw InputError(kSource, Metaball(i), "the " + what + " must be positive and finite");
  }
}

// As BuildCloud: what a float cannot hold in local units is clamped to its range.
float LocalRadius(double radius, const LocalFrame& frame) {
  return static_cast<float>(std::clamp(radius / frame.unit, 1e-30, 1e30));
}

}  // namespace

MovingCloud::MovingCloud(const CloudInput& input) {
  for (std::size_t i = 0; i < input.center.size(); ++i) {
    if (IsFinite(input.center[i])) continue;
    throw InputError(kSource, Metaball(i), "the centre is not finite");
  }
  CheckPositive(input.radius, "radius");
  if (input.radius.empty() && !input.center.empty()) {
    CheckPositive(std::span(&input.uniform_radius, 1), "radius");
  }
  CheckPositive(input.threshold, "threshold");
  std::vector<std::uint32_t> order;
  cloud_ = std::make_shared<Cloud>(BuildCloud(input, nullptr, &order));
  place_.resize(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    place_[order[k]] = static_cast<std::uint32_t>(k);
  }
}

void MovingCloud::CheckCount(std::size_t count, const std::string& what) const {
  if (count == size()) return;
  throw Error("there are " + std::to_string(count) + " " + what + " for " + std::to_string(size()) +
              " metaballs");
}

void MovingCloud::SetPositions(std::span<const Vec3d> positions, std::size_t first) {
  if (first > size() || positions.size() > size() - first) {
    throw Error("there are not that many metaballs to move");
  }
  const LocalFrame& frame = cloud_->frame;
  bool fits = true;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (!IsFinite(positions[i])) {
      throw InputError(kSource, Metaball(first + i), "the centre is not finite");
    }
    const Vec3d p = frame.LocalFromWorld(positions[i]);
    fits = fits && std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) <= kRoom;
  }
  if (positions.empty()) return;
  if (!fits) {
    MoveFrame(positions, first);
    return;
  }
  for (std::size_t i = 0; i < positions.size(); ++i) {
    cloud_->center[place_[first + i]] = frame.LocalFromWorld(positions[i]).cast<float>();
  }
  ++cloud_->revisions.positions;
}

void MovingCloud::MoveFrame(std::span<const Vec3d> positions, std::size_t first) {
  Cloud& cloud = *cloud_;
  const LocalFrame old = cloud.frame;
  std::vector<Vec3d> world(size());
  for (std::size_t i = 0; i < size(); ++i) {
    const bool moved = i >= first && i - first < positions.size();
    world[i] = moved ? positions[i - first] : old.WorldFromLocal(cloud.center[place_[i]]);
  }
  Vec3d min = world[0], max = world[0];
  for (const Vec3d& p : world) {
    min = {std::min(min.x, p.x), std::min(min.y, p.y), std::min(min.z, p.z)};
    max = {std::max(max.x, p.x), std::max(max.y, p.y), std::max(max.z, p.z)};
  }
  // One place has no extent to scale by: the old unit stays.
  const Vec3d room = max == min ? Vec3d{old.unit, old.unit, old.unit} * 0.75 : Vec3d{};
  cloud.frame = LocalFrame::ForBox(min - room, max + room);
  for (std::size_t i = 0; i < size(); ++i) {
    cloud.center[place_[i]] = cloud.frame.LocalFromWorld(world[i]).cast<float>();
  }
  // Units are powers of two: radii are scaled without rounding.
  const double scale = old.unit / cloud.frame.unit;
  for (float& radius : cloud.radius) radius = LocalRadius(radius * scale, LocalFrame{});
  if (cloud.radius.empty()) {
    cloud.uniform_radius = LocalRadius(cloud.uniform_radius * scale, LocalFrame{});
  }
  ++cloud_->revisions.frame;
  ++cloud_->revisions.positions;
  ++cloud_->revisions.radii;
}

void MovingCloud::SetRadii(std::span<const double> radii) {
  CheckCount(radii.size(), "radii");
  CheckPositive(radii, "radius");
  cloud_->radius.resize(size());
  for (std::size_t i = 0; i < size(); ++i) {
    cloud_->radius[place_[i]] = LocalRadius(radii[i], cloud_->frame);
  }
  ++cloud_->revisions.radii;
}

void MovingCloud::SetUniformRadius(double radius) {
  CheckPositive(std::span(&radius, 1), "radius");
  cloud_->radius = {};
  cloud_->uniform_radius = LocalRadius(radius, cloud_->frame);
  ++cloud_->revisions.radii;
}

void MovingCloud::SetThresholds(std::span<const double> thresholds) {
  CheckCount(thresholds.size(), "thresholds");
  CheckPositive(thresholds, "threshold");
  cloud_->threshold.resize(size());
  for (std::size_t i = 0; i < size(); ++i) {
    cloud_->threshold[place_[i]] = static_cast<float>(thresholds[i]);
  }
  ++cloud_->revisions.thresholds;
}

void MovingCloud::SetColors(std::span<const Rgb8> colors) {
  CheckCount(colors.size(), "colours");
  cloud_->color.resize(size());
  for (std::size_t i = 0; i < size(); ++i) cloud_->color[place_[i]] = colors[i];
  ++cloud_->revisions.colors;
}

void MovingCloud::SetChannel(const Channel& channel) {
  CheckCount(channel.size(), "values of channel '" + channel.name() + "'");
  std::vector<std::uint32_t> order(size());
  for (std::size_t i = 0; i < size(); ++i) order[place_[i]] = static_cast<std::uint32_t>(i);
  Channel placed = channel.Reordered(order);
  ++cloud_->revisions.channels;
  for (Channel& own : cloud_->channels) {
    if (own.name() != channel.name()) continue;
    own = std::move(placed);
    return;
  }
  cloud_->channels.push_back(std::move(placed));
}

}  // namespace sherd
