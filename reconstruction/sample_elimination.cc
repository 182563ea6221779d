#include "reconstruction/sample_elimination.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "reconstruction/neighbors.h"
#include "reconstruction/parallel.h"

namespace sherd {
namespace {

constexpr std::size_t kBlock = 2048;
constexpr std::uint32_t kGone = UINT32_MAX;

// Samples by how crowded they are, the most crowded on top, whose crowding can fall.
class CrowdingHeap {
 public:
  explicit CrowdingHeap(std::vector<float> crowding)
      : crowding_(std::move(crowding)), heap_(crowding_.size()), place_(crowding_.size()) {
    std::iota(heap_.begin(), heap_.end(), 0u);
    std::iota(place_.begin(), place_.end(), 0u);
    for (std::size_t i = heap_.size() / 2; i-- > 0;) Sink(i);
  }

  bool Holds(std::uint32_t sample) const { return place_[sample] != kGone; }
  std::uint32_t Pop() {
    const std::uint32_t top = heap_.front();
    place_[top] = kGone;
    const std::uint32_t last = heap_.back();
    heap_.pop_back();
    if (last != top) {
      heap_.front() = last;
      place_[last] = 0;
      Sink(0);
    }
    return top;
  }
  void Relieve(std::uint32_t sample, float by) {
    crowding_[sample] -= by;
    Sink(place_[sample]);
  }

 private:
  bool Above(std::uint32_t a, std::uint32_t b) const {
    return crowding_[a] != crowding_[b] ? crowding_[a] > crowding_[b] : a < b;
  }
  void Sink(std::size_t at) {
    const std::uint32_t sample = heap_[at];
    for (;;) {
      std::size_t child = 2 * at + 1;
      if (child >= heap_.size()) break;
      if (child + 1 < heap_.size() && Above(heap_[child + 1], heap_[child])) ++child;
      if (!Above(heap_[child], sample)) break;
      heap_[at] = heap_[child];
      place_[heap_[at]] = static_cast<std::uint32_t>(at);
      at = child;
    }
    heap_[at] = sample;
    place_[sample] = static_cast<std::uint32_t>(at);
  }

  std::vector<float> crowding_;
  std::vector<std::uint32_t> heap_, place_;
};

// Who crowds whom: neighbours of i at entries begin[i] .. begin[i + 1).
struct Crowd {
  std::vector<std::uint64_t> begin;
  std::vector<std::uint32_t> neighbor;
  std::vector<float> weight;
};

Crowd FindCrowds(const Samples& samples, double d_max, double d_min, const Control& control) {
  const std::size_t n = samples.position.size();
  const NeighborSearch search(samples.position);
  const auto stretch = [&](std::size_t i) {
    return samples.stretch.empty() ? 1.0 : static_cast<double>(samples.stretch[i]);
  };
  // A point on an even sheet has a few dozen; where points pile up, the nearest say enough.
  constexpr int kMost = 64;
  const std::size_t blocks = (n + kBlock - 1) / kBlock;
  std::vector<std::vector<std::uint32_t>> neighbor(blocks);
  std::vector<std::vector<float>> weight(blocks);
  std::vector<std::uint32_t> counts(n);
  ParallelBlocks(
      n, kBlock,
      [&](std::size_t begin, std::size_t end) {
        int idx[kMost];
        float distance[kMost];
        auto& neighbors = neighbor[begin / kBlock];
        auto& weights = weight[begin / kBlock];
        for (std::size_t i = begin; i < end; ++i) {
          const int found = search.Within(i, 2 * d_max * stretch(i), kMost, idx, distance);
          for (int k = 0; k < found; ++k) {
            const auto j = static_cast<std::uint32_t>(idx[k]);
            if (j == i) continue;
            // Both must find the other, so the smaller reach of the two counts.
            const double both = std::min(stretch(i), stretch(j));
            const double x = 1 - std::max<double>(distance[k] / both, d_min) / (2 * d_max);
            if (!(x > 0)) continue;
            const double x2 = x * x, x4 = x2 * x2;
            neighbors.push_back(j);
            weights.push_back(static_cast<float>(x4 * x4));
            ++counts[i];
          }
        }
      },
      control);
  Crowd out;
  out.begin.resize(n + 1, 0);
  for (std::size_t i = 0; i < n; ++i) out.begin[i + 1] = out.begin[i] + counts[i];
  out.neighbor.reserve(out.begin.back());
  out.weight.reserve(out.begin.back());
  for (std::size_t b = 0; b < blocks; ++b) {
    out.neighbor.insert(out.neighbor.end(), neighbor[b].begin(), neighbor[b].end());
    out.weight.insert(out.weight.end(), weight[b].begin(), weight[b].end());
    neighbor[b] = {};
    weight[b] = {};
  }
  return out;
}

// Which samples go, in that order.
std::vector<std::uint32_t> Eliminate(const Samples& samples, std::uint64_t target,
                                     const Control& control) {
  const std::size_t n = samples.position.size();
  double area = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double stretch = samples.stretch.empty() ? 1.0 : samples.stretch[i];
    area += samples.area[i] / (stretch * stretch);
  }
  const double wanted = static_cast<double>(std::max<std::uint64_t>(1, target));
  const double d_max = std::sqrt(area / (2 * std::sqrt(3.0) * wanted));
  const double d_min = 0.65 * d_max * (1 - std::pow(wanted / static_cast<double>(n), 1.5));
  const Crowd crowd = FindCrowds(samples, d_max, d_min, control);
  std::vector<float> crowding(n, 0.0f);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::uint64_t k = crowd.begin[i]; k < crowd.begin[i + 1]; ++k) {
      crowding[i] += crowd.weight[k];
    }
  }
  CrowdingHeap heap(std::move(crowding));
  std::vector<std::uint32_t> gone;
  gone.reserve(n - target);
  while (gone.size() < n - target) {
    if (gone.size() % 4096 == 0) control.ThrowIfStopped();
    const std::uint32_t i = heap.Pop();
    gone.push_back(i);
    for (std::uint64_t k = crowd.begin[i]; k < crowd.begin[i + 1]; ++k) {
      if (heap.Holds(crowd.neighbor[k])) heap.Relieve(crowd.neighbor[k], crowd.weight[k]);
    }
  }
  return gone;
}

}  // namespace

std::vector<std::uint32_t> EliminateSamples(const Samples& samples, std::uint64_t target,
                                            const Control& control) {
  std::vector<bool> stays(samples.position.size(), true);
  for (const std::uint32_t i : Eliminate(samples, target, control)) stays[i] = false;
  std::vector<std::uint32_t> kept;
  kept.reserve(target);
  for (std::size_t i = 0; i < stays.size(); ++i) {
    if (stays[i]) kept.push_back(static_cast<std::uint32_t>(i));
  }
  return kept;
}

std::vector<std::uint32_t> EliminationOrder(const Samples& samples, const Control& control) {
  const std::size_t n = samples.position.size();
  std::vector<std::uint32_t> order(n);  // filled from the back
  std::vector<std::uint32_t> left(n);   // of all samples, ascending
  std::iota(left.begin(), left.end(), 0u);
  while (left.size() > 1) {
    Samples stage;
    for (const std::uint32_t i : left) {
      stage.position.push_back(samples.position[i]);
      if (!samples.stretch.empty()) stage.stretch.push_back(samples.stretch[i]);
    }
    // Every stage samples the same surface.
    const double scale = static_cast<double>(n) / static_cast<double>(left.size());
    for (const std::uint32_t i : left) stage.area.push_back(samples.area[i] * scale);
    const std::vector<std::uint32_t> gone = Eliminate(stage, left.size() / 2, control);
    std::size_t end = left.size();
    for (const std::uint32_t i : gone) {
      order[--end] = left[i];
      left[i] = kGone;
    }
    std::erase(left, kGone);
  }
  if (n > 0) order[0] = left[0];
  return order;
}

}  // namespace sherd
