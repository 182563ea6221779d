#include "reconstruction/sample_elimination.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

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

// Who crowds whom. Kept as the blocks were found, as one array of all would hold it twice for a
// moment, and without the weights, which would double it.
class Crowds {
 public:
  Crowds(const Samples& samples, double d_max, double d_min, const Control& control);

  std::span<const std::uint32_t> Around(std::size_t i) const {
    const std::vector<std::uint32_t>& block = block_[i / kBlock];
    const std::size_t end =
        i % kBlock + 1 < kBlock && i + 1 < begin_.size() ? begin_[i + 1] : block.size();
    return {block.data() + begin_[i], block.data() + end};
  }
  // By how much two samples crowd each other (Yuksel 2015, section 3), the same either way; 0 where
  // they are too far apart. Both must find the other, so the smaller reach of the two counts.
  float Between(std::size_t i, std::size_t j) const {
    const double distance = Length(samples_.position[i] - samples_.position[j]);
    const double x =
        1 - std::max(distance / std::min(Stretch(i), Stretch(j)), d_min_) / (2 * d_max_);
    if (!(x > 0)) return 0;
    const double x2 = x * x, x4 = x2 * x2;
    return static_cast<float>(x4 * x4);
  }

 private:
  double Stretch(std::size_t i) const {
    return samples_.stretch.empty() ? 1.0 : static_cast<double>(samples_.stretch[i]);
  }

  const Samples& samples_;
  double d_max_, d_min_;
  std::vector<std::vector<std::uint32_t>> block_;
  std::vector<std::uint32_t> begin_;  // of each sample, in its block
};

Crowds::Crowds(const Samples& samples, double d_max, double d_min, const Control& control)
    : samples_(samples),
      d_max_(d_max),
      d_min_(d_min),
      block_((samples.position.size() + kBlock - 1) / kBlock),
      begin_(samples.position.size()) {
  const NeighborSearch search(samples.position);
  // A point on an even sheet has a few dozen; where points pile up, the nearest say enough.
  constexpr int kMost = 64;
  ParallelBlocks(
      samples.position.size(), kBlock,
      [&](std::size_t begin, std::size_t end) {
        int idx[kMost];
        float distance[kMost];
        thread_local std::vector<std::uint32_t> around;
        around.clear();
        for (std::size_t i = begin; i < end; ++i) {
          begin_[i] = static_cast<std::uint32_t>(around.size());
          const int found = search.Within(i, 2 * d_max * Stretch(i), kMost, idx, distance);
          for (int k = 0; k < found; ++k) {
            const auto j = static_cast<std::uint32_t>(idx[k]);
            if (j != i && Between(i, j) > 0) around.push_back(j);
          }
        }
        block_[begin / kBlock] = {around.begin(), around.end()};  // no larger than it must be
      },
      control);
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
  const Crowds crowds(samples, d_max, d_min, control);
  std::vector<float> crowding(n, 0.0f);
  for (std::size_t i = 0; i < n; ++i) {
    for (const std::uint32_t j : crowds.Around(i)) crowding[i] += crowds.Between(i, j);
  }
  CrowdingHeap heap(std::move(crowding));
  std::vector<std::uint32_t> gone;
  gone.reserve(n - target);
  while (gone.size() < n - target) {
    if (gone.size() % 4096 == 0) control.ThrowIfStopped();
    const std::uint32_t i = heap.Pop();
    gone.push_back(i);
    for (const std::uint32_t j : crowds.Around(i)) {
      if (heap.Holds(j)) heap.Relieve(j, crowds.Between(i, j));
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
