#include "metaball/appearance/support_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "metaball/morton.h"
#include "metaball/parallel.h"

namespace sherd {
namespace {

constexpr std::size_t kWidth = SupportTree::kWidth;
constexpr float kNowhere = SupportTreeView::kNowhere;
constexpr std::size_t kLeavesPerTask = 1024;

std::size_t Sixteens(std::size_t n) { return (n + kWidth - 1) / kWidth; }

void Resize(std::size_t boxes, SupportTree::Level* level) {
  const std::size_t padded = Sixteens(boxes) * kWidth;
  for (auto* v :
       {&level->min_x, &level->min_y, &level->min_z, &level->max_x, &level->max_y, &level->max_z}) {
    v->assign(padded, kNowhere);
  }
}

// Calls run(first, last) for parts of [0, n).
template <class Run>
void InParts(std::size_t n, int threads, const Run& run) {
  const auto parts = static_cast<std::int64_t>((n + kLeavesPerTask - 1) / kLeavesPerTask);
  ParallelFor(parts, threads, [&](std::int64_t p, int) {
    run(p * kLeavesPerTask, std::min(n, (p + 1) * kLeavesPerTask));
  });
}

// Whether sixteens that follow each other in the cloud are neighbours in space: their boxes are not
// much larger than if the metaballs filled their box evenly.
bool IsLocal(const Cloud& cloud, const Box3f& box, int threads) {
  const std::size_t leaves = Sixteens(cloud.size());
  std::vector<float> diagonal(leaves);
  InParts(leaves, threads, [&](std::size_t first, std::size_t last) {
    for (std::size_t leaf = first; leaf < last; ++leaf) {
      Vec3f lo = cloud.center[leaf * kWidth], hi = lo;
      for (std::size_t k = leaf * kWidth; k < std::min(cloud.size(), (leaf + 1) * kWidth); ++k) {
        const Vec3f& c = cloud.center[k];
        lo = {std::min(lo.x, c.x), std::min(lo.y, c.y), std::min(lo.z, c.z)};
        hi = {std::max(hi.x, c.x), std::max(hi.y, c.y), std::max(hi.z, c.z)};
      }
      diagonal[leaf] = Length(hi - lo);
    }
  });
  const double mean = std::accumulate(diagonal.begin(), diagonal.end(), 0.0) / leaves;
  return mean <= 4.0 * Length(box.max - box.min) / std::cbrt(static_cast<double>(leaves));
}

std::vector<std::uint32_t> MortonOrder(const Cloud& cloud, const Box3f& box) {
  std::vector<std::uint64_t> key(cloud.size());
  const Vec3f size = box.max - box.min;
  const auto cell = [](float v, float lo, float extent) {
    return extent > 0.0f ? static_cast<std::uint32_t>((v - lo) / extent * 2097151.0f) : 0u;
  };
  for (std::size_t i = 0; i < key.size(); ++i) {
    const Vec3f& c = cloud.center[i];
    key[i] = MortonKey63(cell(c.x, box.min.x, size.x), cell(c.y, box.min.y, size.y),
                         cell(c.z, box.min.z, size.z));
  }
  std::vector<std::uint32_t> order(cloud.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return key[a] < key[b]; });
  return order;
}

}  // namespace

std::vector<std::uint32_t> TreeOrder(const Cloud& cloud, int threads) {
  const Box3f box = cloud.CenterBox();
  if (IsLocal(cloud, box, threads)) return {};
  return MortonOrder(cloud, box);
}

SupportTree::SupportTree(const Cloud& cloud, double radius_scale, int threads) {
  const std::size_t n = cloud.size(), leaves = Sixteens(n);
  order = TreeOrder(cloud, threads);
  for (auto* v : {&x, &y, &z, &radius}) v->resize(leaves * kWidth);
  levels.emplace_back();
  Resize(leaves, &levels[0]);
  InParts(leaves, threads, [&](std::size_t first, std::size_t last) {
    Level& level = levels[0];
    for (std::size_t leaf = first; leaf < last; ++leaf) {
      constexpr float kInf = std::numeric_limits<float>::infinity();
      Vec3f lo{kInf, kInf, kInf}, hi{-kInf, -kInf, -kInf};
      for (std::size_t k = leaf * kWidth; k < (leaf + 1) * kWidth; ++k) {
        if (k >= n) {
          x[k] = y[k] = z[k] = kNowhere;
          radius[k] = 0;
          continue;
        }
        const std::size_t i = order.empty() ? k : order[k];
        const Vec3f& c = cloud.center[i];
        const auto r = static_cast<float>(cloud.RadiusOf(i) * radius_scale * (1 + 1e-6));
        x[k] = c.x;
        y[k] = c.y;
        z[k] = c.z;
        radius[k] = r;
        lo = {std::min(lo.x, c.x - r), std::min(lo.y, c.y - r), std::min(lo.z, c.z - r)};
        hi = {std::max(hi.x, c.x + r), std::max(hi.y, c.y + r), std::max(hi.z, c.z + r)};
      }
      level.min_x[leaf] = lo.x;
      level.min_y[leaf] = lo.y;
      level.min_z[leaf] = lo.z;
      level.max_x[leaf] = hi.x;
      level.max_y[leaf] = hi.y;
      level.max_z[leaf] = hi.z;
    }
  });
  std::size_t count = leaves;
  for (;;) {
    const std::size_t above_count = Sixteens(count);
    Level above;
    Resize(above_count, &above);
    const Level& level = levels.back();
    for (std::size_t i = 0; i < above_count; ++i) {
      const auto first = static_cast<std::ptrdiff_t>(i * kWidth);
      const auto last = static_cast<std::ptrdiff_t>(std::min(count, (i + 1) * kWidth));
      const auto least = [&](const std::vector<float>& v) {
        return *std::min_element(v.begin() + first, v.begin() + last);
      };
      const auto most = [&](const std::vector<float>& v) {
        return *std::max_element(v.begin() + first, v.begin() + last);
      };
      above.min_x[i] = least(level.min_x);
      above.min_y[i] = least(level.min_y);
      above.min_z[i] = least(level.min_z);
      above.max_x[i] = most(level.max_x);
      above.max_y[i] = most(level.max_y);
      above.max_z[i] = most(level.max_z);
    }
    if (above_count == 1) {
      BallAround({above.min_x[0], above.min_y[0], above.min_z[0]},
                 {above.max_x[0], above.max_y[0], above.max_z[0]}, &middle, &reach);
      return;
    }
    levels.push_back(std::move(above));
    count = above_count;
  }
}

SupportTreeView SupportTree::view() const {
  SupportTreeView view;
  for (const Level& from : levels) {
    view.level[view.levels++] = {from.min_x.data(), from.min_y.data(), from.min_z.data(),
                                 from.max_x.data(), from.max_y.data(), from.max_z.data(),
                                 from.size()};
  }
  view.x = x.data();
  view.y = y.data();
  view.z = z.data();
  view.radius = radius.data();
  view.order = order.empty() ? nullptr : order.data();
  view.size = x.size();
  view.middle = middle;
  view.reach = reach;
  return view;
}

}  // namespace sherd
