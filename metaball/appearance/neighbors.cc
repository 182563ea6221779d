#include "metaball/appearance/neighbors.h"

#include <algorithm>
#include <numeric>

namespace sherd {
namespace {

constexpr std::size_t kLeaf = 16;

float Axis(const Vec3f& p, int axis) { return axis == 0 ? p.x : axis == 1 ? p.y : p.z; }

bool Nearer(const NeighborIndex::Neighbor& a, const NeighborIndex::Neighbor& b) {
  return a.distance2 != b.distance2 ? a.distance2 < b.distance2 : a.idx < b.idx;
}

}  // namespace

NeighborIndex::NeighborIndex(const std::vector<Vec3f>& points) : points_(points) {
  order_.resize(points.size());
  axis_.assign(points.size(), 0);
  std::iota(order_.begin(), order_.end(), 0u);
  Split(0, order_.size());
}

void NeighborIndex::Split(std::size_t begin, std::size_t end) {
  if (end - begin <= kLeaf) return;
  Vec3f lo = points_[order_[begin]], hi = lo;
  for (std::size_t k = begin; k < end; ++k) {
    const Vec3f& p = points_[order_[k]];
    lo = {std::min(lo.x, p.x), std::min(lo.y, p.y), std::min(lo.z, p.z)};
    hi = {std::max(hi.x, p.x), std::max(hi.y, p.y), std::max(hi.z, p.z)};
  }
  const Vec3f size = hi - lo;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::size_t middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + static_cast<std::ptrdiff_t>(begin),
                   order_.begin() + static_cast<std::ptrdiff_t>(middle),
                   order_.begin() + static_cast<std::ptrdiff_t>(end),
                   [&](std::uint32_t a, std::uint32_t b) {
                     const float va = Axis(points_[a], axis), vb = Axis(points_[b], axis);
                     return va != vb ? va < vb : a < b;
                   });
  axis_[middle] = static_cast<std::uint8_t>(axis);
  Split(begin, middle);
  Split(middle + 1, end);
}

void NeighborIndex::Search(const Vec3f& query, std::size_t k, std::size_t begin, std::size_t end,
                           std::vector<Neighbor>* heap) const {
  const auto visit = [&](std::uint32_t idx) {
    const Vec3f offset = points_[idx] - query;
    const Neighbor found{Dot(offset, offset), idx};
    if (heap->size() == k) {
      if (!Nearer(found, heap->front())) return;
      std::pop_heap(heap->begin(), heap->end(), Nearer);
      heap->back() = found;
    } else {
      heap->push_back(found);
    }
    std::push_heap(heap->begin(), heap->end(), Nearer);
  };
  if (end - begin <= kLeaf) {
    for (std::size_t i = begin; i < end; ++i) visit(order_[i]);
    return;
  }
  const std::size_t middle = begin + (end - begin) / 2;
  const int axis = axis_[middle];
  const float side = Axis(query, axis) - Axis(points_[order_[middle]], axis);
  visit(order_[middle]);
  if (side < 0.0f) {
    Search(query, k, begin, middle, heap);
  } else {
    Search(query, k, middle + 1, end, heap);
  }
  if (heap->size() == k && side * side > heap->front().distance2) return;
  if (side < 0.0f) {
    Search(query, k, middle + 1, end, heap);
  } else {
    Search(query, k, begin, middle, heap);
  }
}

void NeighborIndex::Nearest(const Vec3f& query, int k, std::vector<Neighbor>* found) const {
  found->clear();
  if (k < 1) return;
  Search(query, static_cast<std::size_t>(k), 0, order_.size(), found);
  std::sort_heap(found->begin(), found->end(), Nearer);
}

}  // namespace sherd
