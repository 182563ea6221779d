// The tree of a cloud's supports in the machine's memory, for the rays of shadows and ambient
// occlusion.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "cuda/kernels/support_tree.h"
#include "metaball/appearance/support_tree.h"
#include "metaball/cloud.h"

namespace sherd {

template <class Machine>
class DeviceTree {
 public:
  // What it takes for that many metaballs, an order of their own included.
  static std::uint64_t BytesFor(std::size_t metaballs) {
    std::uint64_t bytes = metaballs * sizeof(std::uint32_t);
    bytes += Sixteens(metaballs) * kWidth * 4 * sizeof(float);
    for (const std::size_t count : BoxesOfLevels(metaballs)) {
      bytes += Sixteens(count) * kWidth * 6 * sizeof(float);
    }
    return bytes;
  }

  // The tree over a cloud and its spheres on the machine; kept as long as these are the same.
  SupportTreeView Use(const std::shared_ptr<const Cloud>& cloud,
                      const kernels::MetaballArrays& metaballs, int threads, Machine* machine) {
    const bool moved = cloud_.lock() != cloud || revisions_.positions != cloud->revisions.positions;
    const bool same = !moved && revisions_.frame == cloud->revisions.frame &&
                      revisions_.radii == cloud->revisions.radii &&
                      radius_scale_ == metaballs.radius_scale;
    if (same) return view_;
    cloud_.reset();
    if (moved) {
      const std::vector<std::uint32_t> order = TreeOrder(*cloud, threads);
      machine->ResizeExactly(&order_, order.size(), "a tree's order");
      machine->Upload(&order_, 0, order.data(), order.size());
    }
    Build(metaballs, machine);
    cloud_ = cloud;
    revisions_ = cloud->revisions;
    radius_scale_ = metaballs.radius_scale;
    return view_;
  }

  void Release(Machine* machine) {
    cloud_.reset();
    machine->Release(&order_);
    machine->Release(&metaballs_);
    machine->Release(&boxes_);
  }

 private:
  template <class T>
  using Buffer = typename Machine::template Buffer<T>;
  static constexpr std::size_t kWidth = SupportTreeView::kWidth;

  static std::size_t Sixteens(std::size_t n) { return (n + kWidth - 1) / kWidth; }
  static std::vector<std::size_t> BoxesOfLevels(std::size_t metaballs) {
    std::vector<std::size_t> counts{Sixteens(metaballs)};
    while (counts.back() > kWidth) counts.push_back(Sixteens(counts.back()));
    return counts;
  }

  void Build(const kernels::MetaballArrays& metaballs, Machine* machine) {
    const std::vector<std::size_t> counts = BoxesOfLevels(metaballs.count);
    std::size_t boxes = 0;
    for (const std::size_t count : counts) boxes += Sixteens(count) * kWidth;
    const std::size_t padded = counts[0] * kWidth;
    machine->ResizeExactly(&metaballs_, 4 * padded, "a tree's metaballs");
    machine->ResizeExactly(&boxes_, 6 * boxes, "a tree's boxes");

    view_ = {};
    view_.order = order_.size() > 0 ? order_.data() : nullptr;
    view_.size = padded;
    float* const x = metaballs_.data();
    view_.x = x;
    view_.y = x + padded;
    view_.z = x + 2 * padded;
    view_.radius = x + 3 * padded;
    kernels::TreeBoxes below;
    float* free = boxes_.data();
    for (std::size_t k = 0; k < counts.size(); ++k) {
      const kernels::TreeBoxes level{free, Sixteens(counts[k]) * kWidth};
      free += 6 * level.size;
      if (k == 0) {
        machine->ForEach("PlaceLeaves", level.size,
                         kernels::PlaceLeaves{metaballs, view_.order, x, x + padded, x + 2 * padded,
                                              x + 3 * padded, level});
      } else {
        machine->ForEach("PlaceBoxes", level.size,
                         kernels::PlaceBoxes{below, counts[k - 1], level});
      }
      view_.level[view_.levels++] = level.view();
      below = level;
    }
    // A ball around all: from the box of the highest level's boxes, which are sixteen.
    std::array<float, 6 * kWidth> top;
    machine->DownloadRect(top.data(), top.size(), boxes_, 6 * (boxes - kWidth), top.size(),
                          static_cast<int>(top.size()), 1);
    const kernels::TreeBoxes bounds{top.data(), kWidth};
    Vec3f lo = bounds.Min(0), hi = bounds.Max(0);
    for (std::size_t k = 1; k < counts.back(); ++k) {
      const Vec3f a = bounds.Min(k), b = bounds.Max(k);
      lo = {std::min(lo.x, a.x), std::min(lo.y, a.y), std::min(lo.z, a.z)};
      hi = {std::max(hi.x, b.x), std::max(hi.y, b.y), std::max(hi.z, b.z)};
    }
    BallAround(lo, hi, &view_.middle, &view_.reach);
  }

  std::weak_ptr<const Cloud> cloud_;
  CloudRevisions revisions_;
  double radius_scale_ = 0.0;
  Buffer<std::uint32_t> order_;
  Buffer<float> metaballs_, boxes_;
  SupportTreeView view_;
};

}  // namespace sherd
