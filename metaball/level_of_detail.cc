#include "metaball/level_of_detail.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "metaball/density/shapes.h"
#include "metaball/morton.h"
#include "metaball/parallel.h"
#include "metaball/surface_offset.h"

namespace sherd {
namespace {

constexpr std::size_t kBlock = 4096;
constexpr std::size_t kPart = 1 << 16;
constexpr int kKeyBits = 21;
constexpr double kKeySteps = 2097151.0;  // as BuildCloud has them: its clouds are in order then
// A metaball whose support is larger than so many cells is not merged: those it shares a cell with
// are nearer to each other than the surface can show.
constexpr double kCellsOfSupport = 2.0;
// A level must have at most this share of the metaballs of the one before.
constexpr double kShrink = 0.5;

std::uint32_t KeyCoordinate(float v, double extent) {
  const double scaled = (v / extent + 1.0) * 0.5 * kKeySteps;
  return static_cast<std::uint32_t>(std::clamp(scaled, 0.0, kKeySteps));
}

Channel EmptyLike(const Channel& channel, std::size_t n) {
  return Channel(channel.name(), channel.type(), channel.components(), n, channel.lo(),
                 channel.hi());
}

}  // namespace

LevelsOfDetail::LevelsOfDetail(const Cloud& cloud, const Surface& surface, int threads)
    : cloud_(&cloud), threads_(threads), why_not_(GroupMerge::WhyNot(surface)), surface_(surface) {
  if (why_not_.empty() && cloud_->size() < 2) why_not_ = "there is nothing to merge";
  if (!why_not_.empty()) return;
  const ResolvedDensity density = ResolveDensity(surface.density);
  scale_ = surface.radius_scale * density.support;
  core_ = DistanceOfValue(density.shape, surface.threshold / density.amplitude);
  smallest_radius_ = cloud_->radius.empty()
                         ? cloud_->uniform_radius
                         : *std::min_element(cloud_->radius.begin(), cloud_->radius.end());
  const Box3f box = cloud_->CenterBox();
  for (const Vec3f& corner : {box.min, box.max}) {
    for (const float v : {corner.x, corner.y, corner.z}) {
      extent_ = std::max(extent_, std::abs(static_cast<double>(v)));
    }
  }
  BuildBlocks();
}

std::uint64_t LevelsOfDetail::KeyOf(std::uint32_t i) const {
  const Vec3f& p = cloud_->center[i];
  return MortonKey63(KeyCoordinate(p.x, extent_), KeyCoordinate(p.y, extent_),
                     KeyCoordinate(p.z, extent_));
}

double LevelsOfDetail::CellEdge(int cell_log2) const {
  return std::ldexp(2.0 * extent_ / kKeySteps, cell_log2);
}

void LevelsOfDetail::BuildBlocks() {
  const std::size_t n = cloud_->size();
  blocks_.resize((n + kBlock - 1) / kBlock);
  ParallelFor(static_cast<std::int64_t>(blocks_.size()), threads_, [&](std::int64_t b, int) {
    const std::size_t begin = static_cast<std::size_t>(b) * kBlock;
    const std::size_t end = std::min(n, begin + kBlock);
    Block block{cloud_->center[begin], cloud_->center[begin], 0};
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3f& p = cloud_->center[i];
      block.min = {std::min(block.min.x, p.x), std::min(block.min.y, p.y),
                   std::min(block.min.z, p.z)};
      block.max = {std::max(block.max.x, p.x), std::max(block.max.y, p.y),
                   std::max(block.max.z, p.z)};
      block.radius = std::max(block.radius, cloud_->RadiusOf(i));
    }
    blocks_[static_cast<std::size_t>(b)] = block;
  });
}

void LevelsOfDetail::SortByKey() {
  const std::size_t n = cloud_->size();
  std::uint64_t last = 0;
  bool sorted = true;
  for (std::size_t i = 0; i < n && sorted; ++i) {
    const std::uint64_t key = KeyOf(static_cast<std::uint32_t>(i));
    sorted = last <= key;
    last = key;
  }
  if (sorted) return;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys(n);
  for (std::size_t i = 0; i < n; ++i) {
    keys[i] = {KeyOf(static_cast<std::uint32_t>(i)), static_cast<std::uint32_t>(i)};
  }
  std::sort(keys.begin(), keys.end());
  order_.resize(n);
  for (std::size_t i = 0; i < n; ++i) order_[i] = keys[i].second;
}

std::vector<std::size_t> LevelsOfDetail::PartEnds(int cell_log2) const {
  const std::size_t n = cloud_->size();
  const int shift = 3 * cell_log2;
  std::vector<std::size_t> ends;
  for (std::size_t end = 0; end < n;) {
    end = std::min(n, end + kPart);
    while (end < n && KeyOf(At(end)) >> shift == KeyOf(At(end - 1)) >> shift) ++end;
    ends.push_back(end);
  }
  return ends;
}

template <class Visit>
void LevelsOfDetail::ForEachGroup(std::size_t begin, std::size_t end, int cell_log2,
                                  const Visit& visit) const {
  const int shift = 3 * cell_log2;
  const double largest = kCellsOfSupport * CellEdge(cell_log2);
  std::vector<std::uint32_t> small;
  std::uint64_t cell = 0;
  const auto flush = [&] {
    if (!small.empty()) visit(std::span<const std::uint32_t>(small), small.size() > 1);
    small.clear();
  };
  for (std::size_t k = begin; k < end; ++k) {
    const std::uint32_t i = At(k);
    const std::uint64_t own = KeyOf(i) >> shift;
    if (own != cell) flush();
    cell = own;
    if (merge_->SupportOf(cloud_->RadiusOf(i)) <= largest) {
      small.push_back(i);
    } else {
      visit(std::span<const std::uint32_t>(&i, 1), false);
    }
  }
  flush();
}

bool LevelsOfDetail::MeasureNext(const Control& control) {
  if (!merge_) {
    SortByKey();
    merge_ =
        std::make_unique<GroupMerge>(surface_, MeasureSurfaceOffset(*cloud_, surface_, threads_));
    const double edge = scale_ * smallest_radius_ / kCellsOfSupport;
    next_log2_ =
        static_cast<int>(std::clamp(std::ceil(std::log2(edge / CellEdge(0))), 0.0, kKeyBits + 1.0));
  }
  const std::size_t before = levels_.empty() ? cloud_->size() : levels_.back().metaballs;
  for (; next_log2_ <= kKeyBits; ++next_log2_) {
    control.ThrowIfStopped();
    const double edge = CellEdge(next_log2_);
    const std::vector<std::size_t> ends = PartEnds(next_log2_);
    std::vector<std::size_t> counts(ends.size(), 0);
    std::vector<double> errors(ends.size(), 0.0);
    ParallelFor(static_cast<std::int64_t>(ends.size()), threads_, [&](std::int64_t p, int) {
      control.ThrowIfStopped();
      const auto part = static_cast<std::size_t>(p);
      ForEachGroup(part == 0 ? 0 : ends[part - 1], ends[part], next_log2_,
                   [&](std::span<const std::uint32_t> members, bool merge) {
                     ++counts[part];
                     if (!merge) return;
                     errors[part] =
                         std::max(errors[part], merge_->Merge(*cloud_, members, edge).error);
                   });
    });
    const std::size_t count = std::accumulate(counts.begin(), counts.end(), std::size_t{0});
    if (static_cast<double>(count) > kShrink * static_cast<double>(before)) continue;
    LevelOfDetail level;
    level.cell_log2 = next_log2_++;
    level.metaballs = count;
    level.error = *std::max_element(errors.begin(), errors.end()) * cloud_->frame.unit;
    levels_.push_back(std::move(level));
    return true;
  }
  return false;
}

void LevelsOfDetail::MakeCloud(LevelOfDetail* level, const Control& control) const {
  const std::vector<std::size_t> ends = PartEnds(level->cell_log2);
  std::vector<std::size_t> first(ends.size() + 1, 0);
  const auto for_parts = [&](const auto& visit) {
    ParallelFor(static_cast<std::int64_t>(ends.size()), threads_, [&](std::int64_t p, int) {
      control.ThrowIfStopped();
      const auto part = static_cast<std::size_t>(p);
      ForEachGroup(part == 0 ? 0 : ends[part - 1], ends[part], level->cell_log2,
                   [&](std::span<const std::uint32_t> members, bool) { visit(part, members); });
    });
  };
  for_parts([&](std::size_t part, std::span<const std::uint32_t>) { ++first[part + 1]; });
  std::partial_sum(first.begin(), first.end(), first.begin());
  const std::size_t n = first.back();

  const Cloud& full = *cloud_;
  const double edge = CellEdge(level->cell_log2);
  auto cloud = std::make_shared<Cloud>();
  cloud->frame = full.frame;
  cloud->center.resize(n);
  cloud->radius.resize(n);
  if (!full.color.empty()) cloud->color.resize(n);
  cloud->uniform_color = full.uniform_color;
  for (const Channel& channel : full.channels) cloud->channels.push_back(EmptyLike(channel, n));
  level->representative.resize(n);
  for_parts([&](std::size_t part, std::span<const std::uint32_t> members) {
    const std::size_t at = first[part]++;
    if (members.size() == 1) {
      const std::uint32_t i = members[0];
      cloud->center[at] = full.center[i];
      cloud->radius[at] = full.RadiusOf(i);
      level->representative[at] = i;
    } else {
      const MergedMetaball merged = merge_->Merge(full, members, edge);
      cloud->center[at] = merged.center;
      cloud->radius[at] = merged.radius;
      level->representative[at] = merged.representative;
    }
    // As the field weighs them: by the area they cover.
    double weights = 0;
    Vec3d color{};
    const double unit = 1.0 / cloud->radius[at];
    for (const std::uint32_t i : members) {
      const double weight = full.RadiusOf(i) * unit * full.RadiusOf(i) * unit;
      weights += weight;
      if (!full.color.empty())
        color = color + weight * LinearFromRgb8(full.color[i]).cast<double>();
    }
    if (!full.color.empty()) {
      cloud->color[at] = members.size() == 1 ? full.color[members[0]]
                                             : Rgb8FromLinear((color / weights).cast<float>());
    }
    for (std::size_t c = 0; c < full.channels.size(); ++c) {
      const Channel& channel = full.channels[c];
      double sums[4] = {};
      for (const std::uint32_t i : members) {
        const double share = full.RadiusOf(i) * unit * full.RadiusOf(i) * unit / weights;
        const ChannelValue value = channel.Get(i);
        for (int j = 0; j < channel.components(); ++j) sums[j] += share * value.v[j];
      }
      ChannelValue mean;
      for (int j = 0; j < channel.components(); ++j) mean.v[j] = static_cast<float>(sums[j]);
      cloud->channels[c].Set(at, mean);
    }
  });
  level->cloud = std::move(cloud);
}

double LevelsOfDetail::ProjectedError(const Camera& camera, double error, double margin_px) const {
  const double focal = std::max(camera.fx, camera.fy);
  if (camera.projection == Projection::kOrthographic) return focal * error;
  const Vec3d eye = cloud_->frame.LocalFromWorld(camera.eye);
  // Slopes of what may be seen; the steeper, the more pixels a length covers there.
  const double tan_x = (std::max(camera.cx, camera.width - camera.cx) + margin_px + 1) / camera.fx;
  const double tan_y = (std::max(camera.cy, camera.height - camera.cy) + margin_px + 1) / camera.fy;
  const double local_error = error / cloud_->frame.unit;
  double worst = 0;
  for (const Block& block : blocks_) {
    const Vec3d lo = block.min.cast<double>(), hi = block.max.cast<double>();
    const Vec3d center = 0.5 * (lo + hi) - eye, half = 0.5 * (hi - lo);
    const double more = block.radius * scale_ + local_error;
    const auto reach = [&](const Vec3d& axis) {
      return std::abs(axis.x) * half.x + std::abs(axis.y) * half.y + std::abs(axis.z) * half.z +
             more;
    };
    const double depth = Dot(center, camera.forward), depth_reach = reach(camera.forward);
    if (depth + depth_reach <= 0) continue;
    // Outside where all of the block lies beyond the steepest slope at its farthest depth.
    const double far = depth + depth_reach;
    if (std::abs(Dot(center, camera.right)) - reach(camera.right) > tan_x * far ||
        std::abs(Dot(center, camera.down)) - reach(camera.down) > tan_y * far) {
      continue;
    }
    const double nearest = depth - depth_reach;
    if (!(nearest > 0)) return INFINITY;
    const auto slope = [&](const Vec3d& axis, double most) {
      return std::min(most, (std::abs(Dot(center, axis)) + reach(axis)) / nearest);
    };
    const double x = slope(camera.right, tan_x), y = slope(camera.down, tan_y);
    worst = std::max(worst, local_error / nearest * std::sqrt(1 + x * x + y * y));
  }
  return focal * worst;  // 0 where nothing can be seen
}

LevelChoice LevelsOfDetail::For(const Camera& camera, double pixels, const Control& control) {
  LevelChoice choice;
  if (!why_not_.empty() || !(pixels > 0)) return choice;
  // What is merged grows by at least what lies outside its own core.
  const double least = (1 - core_) * scale_ * smallest_radius_ * cloud_->frame.unit;
  if (!(ProjectedError(camera, least, pixels) < pixels)) return choice;
  std::size_t chosen = 0;
  double chosen_px = 0;
  for (std::size_t k = 0; k < levels_.size() || MeasureNext(control); ++k) {
    const double error_px = ProjectedError(camera, levels_[k].error, pixels);
    if (!(error_px < pixels)) break;
    chosen = k + 1;
    chosen_px = error_px;
  }
  if (chosen == 0) return choice;
  LevelOfDetail& level = levels_[chosen - 1];
  if (!level.cloud) MakeCloud(&level, control);
  choice.level = &level;
  choice.error_px = chosen_px;
  return choice;
}

std::size_t LevelsOfDetail::MemoryBytes() const {
  std::size_t bytes =
      order_.capacity() * sizeof(std::uint32_t) + blocks_.capacity() * sizeof(Block);
  for (const LevelOfDetail& level : levels_) {
    bytes += level.representative.capacity() * sizeof(std::uint32_t);
    if (level.cloud) bytes += level.cloud->MemoryBytes();
  }
  return bytes;
}

}  // namespace sherd
