#include "reconstruction/outliers.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "metaball/median.h"
#include "reconstruction/local_plane.h"
#include "reconstruction/parallel.h"
#include "reconstruction/point_arrays.h"

namespace sherd {
namespace {

constexpr std::size_t kBlock = 4096;
// Mean distances on an even surface differ by about 15 % from point to point, at a border by half.
constexpr float kAboveNeighbors = 1.8f;
// Surface variation of 17 neighbours: a noisy surface has up to 0.05, a random cloud 0.1 to 0.3.
constexpr double kFillsSpace = 0.08;

// Sets of points; the smallest index names a set.
class Components {
 public:
  explicit Components(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t Find(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void Join(std::uint32_t a, std::uint32_t b) {
    a = Find(a);
    b = Find(b);
    if (a != b) parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace

void RemoveStray(const std::vector<char>& stray, PreparedPoints* prepared) {
  std::vector<std::uint32_t> kept;
  kept.reserve(stray.size());
  for (std::size_t i = 0; i < stray.size(); ++i) {
    if (!stray[i]) kept.push_back(static_cast<std::uint32_t>(i));
  }
  if (kept.size() == stray.size()) return;
  Keep(kept, &prepared->points);
  Keep(kept, &prepared->spacing);
  Keep(kept, &prepared->shift);
  prepared->outliers += stray.size() - kept.size();
}

void FindClumps(const NeighborSearch& search, const std::vector<float>& spacing,
                std::vector<char>* stray, const Control& control) {
  const std::size_t n = spacing.size();
  // In local spacings; on an even surface the 16 neighbours lie at 0.6 to 2.3.
  constexpr float kReach = 2.0f;
  Components components(n);
  // Neighbours are looked up in parallel, a stretch at a time, and joined in order.
  constexpr std::size_t kStretch = 1 << 16;
  std::vector<std::uint32_t> joined(kStretch * kOutlierNeighbors);
  for (std::size_t start = 0; start < n; start += kStretch) {
    const std::size_t count = std::min(kStretch, n - start);
    ParallelBlocks(
        count, kBlock,
        [&](std::size_t begin, std::size_t end) {
          int idx[kOutlierNeighbors + 1];
          float distance[kOutlierNeighbors + 1];
          for (std::size_t k = begin; k < end; ++k) {
            const std::size_t i = start + k;
            std::uint32_t* const out = &joined[k * kOutlierNeighbors];
            std::fill(out, out + kOutlierNeighbors, static_cast<std::uint32_t>(i));
            if ((*stray)[i]) continue;
            const int m = search.Nearest(i, kOutlierNeighbors + 1, idx, distance);
            int used = 0;
            for (int j = 0; j < m && used < kOutlierNeighbors; ++j) {
              const auto other = static_cast<std::uint32_t>(idx[j]);
              if (other == i || (*stray)[other]) continue;
              if (distance[j] <= kReach * std::min(spacing[i], spacing[other])) out[used++] = other;
            }
          }
        },
        control, "finding stray points",
        0.8 + 0.15 * static_cast<double>(start) / static_cast<double>(n), 0.95);
    for (std::size_t k = 0; k < count; ++k) {
      for (int j = 0; j < kOutlierNeighbors; ++j) {
        components.Join(static_cast<std::uint32_t>(start + k), joined[k * kOutlierNeighbors + j]);
      }
    }
  }
  std::vector<std::uint32_t> size(n, 0);
  for (std::size_t i = 0; i < n; ++i) ++size[components.Find(static_cast<std::uint32_t>(i))];
  const auto smallest = static_cast<std::uint32_t>(n / 2000);
  for (std::size_t i = 0; i < n; ++i) {
    if (size[components.Find(static_cast<std::uint32_t>(i))] < smallest) (*stray)[i] = 1;
  }
}

void FindSparse(const NeighborSearch& search, const std::vector<Vec3d>& positions,
                const std::vector<float>& mean, std::vector<char>* stray, const Control& control) {
  const std::size_t n = mean.size();
  std::vector<float> logs;
  logs.reserve(n);
  for (const float m : mean) {
    if (m > 0) logs.push_back(std::log(m));
  }
  if (logs.size() < n / 2) return;  // mostly coincident points: nothing to compare with
  const float median = Median(logs);
  for (float& v : logs) v = std::abs(v - median);
  const double deviation = 1.4826 * static_cast<double>(Median(std::move(logs)));
  // In a cloud of even density the deviation is about 0.15; at least three times the median
  // distance is asked for.
  const double limit = std::exp(median + std::max(std::log(3.0), 4.0 * deviation));
  const double suspicious = std::exp(median) * 1.5;
  ParallelBlocks(
      n, kBlock,
      [&](std::size_t begin, std::size_t end) {
        int idx[kOutlierNeighbors + 1];
        float distance[kOutlierNeighbors + 1];
        for (std::size_t i = begin; i < end; ++i) {
          if (!(mean[i] > suspicious)) continue;
          const int count = search.Nearest(i, kOutlierNeighbors + 1, idx, distance);
          float around[kOutlierNeighbors + 1];
          int m = 0;
          for (int j = 0; j < count; ++j) {
            if (static_cast<std::size_t>(idx[j]) != i) around[m++] = mean[idx[j]];
          }
          std::nth_element(around, around + m / 2, around + m);
          (*stray)[i] =
              m > 0 &&
              (mean[i] > kAboveNeighbors * around[m / 2] ||
               (mean[i] > limit && FitPlane(positions, idx, count).variation > kFillsSpace));
        }
      },
      control, "finding stray points", 0.7, 0.8);
}

}  // namespace sherd
