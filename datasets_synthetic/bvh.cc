#include "datasets_synthetic/bvh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace sherd::synthetic {
namespace {

using Float4 = float __attribute__((vector_size(16)));
using Double2 = double __attribute__((vector_size(16)));
using Mask2 = std::int64_t __attribute__((vector_size(16)));

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::uint32_t kLeafSize = 4;
constexpr int kBins = 16;
constexpr int kStackSize = 256;
constexpr std::int32_t kEmpty = std::numeric_limits<std::int32_t>::min();
constexpr std::uint32_t kNoTriangle = std::numeric_limits<std::uint32_t>::max();
// Coordinates up to 100 m are rounded to 4e-6 m in single precision, and a slab test adds three
// such roundings.
constexpr float kMargin = 3e-5f;

Float4 Load(const float* v) { return Float4{v[0], v[1], v[2], v[3]}; }
Double2 Widen(const float* v) {
  return Double2{static_cast<double>(v[0]), static_cast<double>(v[1])};
}
Float4 Splat(float v) { return Float4{v, v, v, v}; }
Float4 Min(Float4 a, Float4 b) { return a < b ? a : b; }
Float4 Max(Float4 a, Float4 b) { return a > b ? a : b; }

struct Box {
  Vec3f low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};

  void Add(const Vec3f& p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  void Add(const Box& b) {
    Add(b.low);
    Add(b.high);
  }
  float HalfArea() const {
    const Vec3f d = high - low;
    return d.x < 0 ? 0 : d.x * d.y + d.y * d.z + d.z * d.x;
  }
};

float Axis(const Vec3f& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

}  // namespace

// Top-down build with binned surface-area heuristic (Wald 2007); two levels become one wide node.
class BvhBuilder {
 public:
  BvhBuilder(const TriangleMesh& mesh, Bvh* bvh) : bvh_(bvh) {
    const std::size_t n = mesh.triangles.size();
    order_.resize(n);
    std::iota(order_.begin(), order_.end(), 0u);
    boxes_.resize(n);
    centers_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      for (int k = 0; k < 3; ++k) boxes_[i].Add(mesh.Corner(i, k).cast<float>());
      centers_[i] = (boxes_[i].low + boxes_[i].high) * 0.5f;
    }
    if (n == 0) return;
    mesh_ = &mesh;
    BuildWide({0, static_cast<std::uint32_t>(n)});
  }

 private:
  struct Range {
    std::uint32_t begin, end;
    std::uint32_t size() const { return end - begin; }
  };

  Box BoxOf(const Range& r) const {
    Box box;
    for (std::uint32_t i = r.begin; i < r.end; ++i) box.Add(boxes_[order_[i]]);
    return box;
  }

  // Parts the range in two; both are non-empty. The range has at least two triangles.
  std::uint32_t Split(const Range& r) {
    Box centers;
    for (std::uint32_t i = r.begin; i < r.end; ++i) centers.Add(centers_[order_[i]]);
    float best_cost = kInfinity;
    int best_axis = -1, best_bin = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const float low = Axis(centers.low, axis), extent = Axis(centers.high, axis) - low;
      if (!(extent > 0)) continue;
      std::array<Box, kBins> box;
      std::array<std::uint32_t, kBins> count{};
      for (std::uint32_t i = r.begin; i < r.end; ++i) {
        const int bin = BinOf(Axis(centers_[order_[i]], axis), low, extent);
        box[static_cast<std::size_t>(bin)].Add(boxes_[order_[i]]);
        ++count[static_cast<std::size_t>(bin)];
      }
      std::array<float, kBins> right_cost{};
      Box right;
      std::uint32_t right_count = 0;
      for (std::size_t b = kBins - 1; b > 0; --b) {
        right.Add(box[b]);
        right_count += count[b];
        right_cost[b] = right_count ? right.HalfArea() * static_cast<float>(right_count) : 0;
      }
      Box left;
      std::uint32_t left_count = 0;
      for (std::size_t b = 0; b + 1 < kBins; ++b) {
        left.Add(box[b]);
        left_count += count[b];
        if (left_count == 0 || left_count == r.size()) continue;
        const float cost = left.HalfArea() * static_cast<float>(left_count) + right_cost[b + 1];
        if (cost < best_cost) {
          best_cost = cost;
          best_axis = axis;
          best_bin = static_cast<int>(b);
        }
      }
    }
    if (best_axis < 0) return r.begin + r.size() / 2;  // all centres coincide
    const float low = Axis(centers.low, best_axis), extent = Axis(centers.high, best_axis) - low;
    const auto middle =
        std::partition(order_.begin() + r.begin, order_.begin() + r.end, [&](std::uint32_t i) {
          return BinOf(Axis(centers_[i], best_axis), low, extent) <= best_bin;
        });
    return static_cast<std::uint32_t>(middle - order_.begin());
  }

  static int BinOf(float center, float low, float extent) {
    return std::min(kBins - 1, static_cast<int>((center - low) / extent * kBins));
  }

  // Adds a node with up to four children; returns its index.
  std::int32_t BuildWide(const Range& range) {
    std::array<Range, 4> parts{range};
    std::size_t count = 1;
    while (count < 4) {
      // The part with the most triangles is split next.
      std::size_t largest = 0;
      for (std::size_t i = 1; i < count; ++i) {
        if (parts[i].size() > parts[largest].size()) largest = i;
      }
      if (parts[largest].size() <= kLeafSize) break;
      const std::uint32_t middle = Split(parts[largest]);
      parts[count++] = {middle, parts[largest].end};
      parts[largest].end = middle;
    }
    const auto index = static_cast<std::int32_t>(bvh_->nodes_.size());
    bvh_->nodes_.emplace_back();
    for (std::size_t i = 0; i < 4; ++i) {
      Box box;
      std::int32_t child = kEmpty;
      if (i < count) {
        box = BoxOf(parts[i]);
        child = parts[i].size() <= kLeafSize ? AddBlock(parts[i]) : BuildWide(parts[i]);
      }
      Bvh::Node& node = bvh_->nodes_[static_cast<std::size_t>(index)];
      for (int axis = 0; axis < 3; ++axis) {
        node.bound[axis][i] = Axis(box.low, axis) - kMargin;
        node.bound[axis + 3][i] = Axis(box.high, axis) + kMargin;
      }
      node.child[i] = child;
    }
    return index;
  }

  std::int32_t AddBlock(const Range& range) {
    Bvh::Block block{};
    std::fill(std::begin(block.index), std::end(block.index), kNoTriangle);
    for (std::uint32_t i = 0; i < range.size(); ++i) {
      const std::uint32_t triangle = order_[range.begin + i];
      for (int k = 0; k < 3; ++k) {
        const Vec3f corner = mesh_->Corner(triangle, k).cast<float>();
        for (int axis = 0; axis < 3; ++axis) block.corner[k][axis][i] = Axis(corner, axis);
      }
      block.index[i] = triangle;
    }
    bvh_->blocks_.push_back(block);
    return -static_cast<std::int32_t>(bvh_->blocks_.size());
  }

  const TriangleMesh* mesh_ = nullptr;
  Bvh* bvh_;
  std::vector<std::uint32_t> order_;
  std::vector<Box> boxes_;
  std::vector<Vec3f> centers_;
};

Bvh::Bvh(const TriangleMesh& mesh) { BvhBuilder(mesh, this); }

template <bool kAnyHit>
bool Bvh::Traverse(const RayD& ray, double max_distance, MeshHit* hit) const {
  if (nodes_.empty()) return false;
  // A ray from far away starts where it comes near: single precision holds there.
  double skipped = 0;
  Vec3d origin = ray.origin;
  if (const double far = Length(origin); far > 200.0) {
    const double along = -Dot(origin, ray.direction);
    skipped = std::max(0.0, along - 150.0);
    origin += ray.direction * skipped;
    max_distance -= skipped;
    if (Length(origin) > 200.0) return false;  // passes more than 100 m away
  }
  const auto inverse = [](double d) {
    return std::abs(d) > 1e-30 ? static_cast<float>(std::clamp(1.0 / d, -1e30, 1e30)) : 1e30f;
  };
  const double direction[3] = {ray.direction.x, ray.direction.y, ray.direction.z};
  const double start[3] = {origin.x, origin.y, origin.z};
  Float4 inverse4[3], start4[3];
  int near_bound[3], far_bound[3];
  Double2 direction2[3], start2[3];
  for (int a = 0; a < 3; ++a) {
    const float inv = inverse(direction[a]);
    inverse4[a] = Splat(inv);
    start4[a] = Splat(static_cast<float>(start[a]));
    near_bound[a] = inv > 0 ? a : a + 3;
    far_bound[a] = inv > 0 ? a + 3 : a;
    direction2[a] = Double2{direction[a], direction[a]};
    start2[a] = Double2{start[a], start[a]};
  }
  double nearest = max_distance;
  bool found = false;
  struct Entry {
    std::int32_t child;
    float t;
  };
  Entry stack[kStackSize];
  int top = 0;
  stack[top++] = {0, 0.0f};
  while (top > 0) {
    const Entry entry = stack[--top];
    if (static_cast<double>(entry.t) > nearest + 1e-4) continue;
    if (entry.child < 0) {
      // Moller and Trumbore 1997, two triangles at a time; a hair beyond the edges, so that no ray
      // slips between two neighbours.
      constexpr double kEdge = 1e-12;
      const Block& block = blocks_[static_cast<std::size_t>(-1 - entry.child)];
      for (int half = 0; half < 4; half += 2) {
        Double2 ab[3], ac[3], s[3];
        for (int a = 0; a < 3; ++a) {
          const Double2 corner = Widen(block.corner[0][a] + half);
          ab[a] = Widen(block.corner[1][a] + half) - corner;
          ac[a] = Widen(block.corner[2][a] + half) - corner;
          s[a] = start2[a] - corner;
        }
        const Double2 p[3] = {direction2[1] * ac[2] - direction2[2] * ac[1],
                              direction2[2] * ac[0] - direction2[0] * ac[2],
                              direction2[0] * ac[1] - direction2[1] * ac[0]};
        const Double2 det = ab[0] * p[0] + ab[1] * p[1] + ab[2] * p[2];
        const Double2 inv = 1.0 / det;  // no extent: infinite or NaN, and no hit below
        const Double2 u = (s[0] * p[0] + s[1] * p[1] + s[2] * p[2]) * inv;
        const Double2 q[3] = {s[1] * ab[2] - s[2] * ab[1], s[2] * ab[0] - s[0] * ab[2],
                              s[0] * ab[1] - s[1] * ab[0]};
        const Double2 v =
            (direction2[0] * q[0] + direction2[1] * q[1] + direction2[2] * q[2]) * inv;
        const Double2 t = (ac[0] * q[0] + ac[1] * q[1] + ac[2] * q[2]) * inv;
        const Mask2 met =
            (u >= -kEdge) & (v >= -kEdge) & (u + v <= 1 + kEdge) & (t > 0.0) & (t < nearest);
        for (int i = 0; i < 2; ++i) {
          if (!met[i] || !(t[i] < nearest) || block.index[half + i] == kNoTriangle) continue;
          if (kAnyHit) return true;
          nearest = t[i];
          found = true;
          *hit = {t[i] + skipped, u[i], v[i], block.index[half + i]};
        }
      }
      continue;
    }
    const Node& node = nodes_[static_cast<std::size_t>(entry.child)];
    Float4 enter = Splat(0.0f);
    Float4 leave = Splat(std::min(1e30f, static_cast<float>(nearest) * 1.000001f + 1e-4f));
    for (int a = 0; a < 3; ++a) {
      enter = Max(enter, (Load(node.bound[near_bound[a]]) - start4[a]) * inverse4[a]);
      leave = Min(leave, (Load(node.bound[far_bound[a]]) - start4[a]) * inverse4[a]);
    }
    // The children that are met, nearest on top of the stack.
    const int base = top;
    for (int i = 0; i < 4; ++i) {
      if (!(enter[i] <= leave[i])) continue;
      int at = top++;
      if (!kAnyHit) {
        while (at > base && stack[at - 1].t < enter[i]) {
          stack[at] = stack[at - 1];
          --at;
        }
      }
      stack[at] = {node.child[i], enter[i]};
    }
  }
  return found;
}

bool Bvh::Intersect(const RayD& ray, double max_distance, MeshHit* hit) const {
  return Traverse<false>(ray, max_distance, hit);
}

bool Bvh::Occluded(const RayD& ray, double max_distance) const {
  return Traverse<true>(ray, max_distance, nullptr);
}

namespace {

// Squared distance of p to the triangle a, a + ab, a + ac (Ericson 2005, 5.1.5).
double SquaredDistance(const Vec3d& p, const Vec3d& a, const Vec3d& ab, const Vec3d& ac) {
  const Vec3d ap = p - a;
  const double d1 = Dot(ab, ap), d2 = Dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return Dot(ap, ap);
  const Vec3d bp = ap - ab;
  const double d3 = Dot(ab, bp), d4 = Dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return Dot(bp, bp);
  const double vc = d1 * d4 - d3 * d2;
  Vec3d nearest;  // from a
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    nearest = ab * (d1 / (d1 - d3));
  } else {
    const Vec3d cp = ap - ac;
    const double d5 = Dot(ab, cp), d6 = Dot(ac, cp);
    if (d6 >= 0 && d5 <= d6) return Dot(cp, cp);
    const double vb = d5 * d2 - d1 * d6;
    const double va = d3 * d6 - d5 * d4;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) {
      nearest = ac * (d2 / (d2 - d6));
    } else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
      nearest = ab + (ac - ab) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    } else {
      const double sum = va + vb + vc;
      if (!(sum > 0)) return Dot(ap, ap);  // no area: an edge case was taken above, or a point
      nearest = ab * (vb / sum) + ac * (vc / sum);
    }
  }
  const Vec3d d = ap - nearest;
  return Dot(d, d);
}

}  // namespace

double Bvh::Distance(const Vec3d& p) const {
  if (nodes_.empty()) return std::numeric_limits<double>::infinity();
  const double point[3] = {p.x, p.y, p.z};
  double best = std::numeric_limits<double>::infinity();  // squared
  struct Entry {
    std::int32_t child;
    double bound;
  };
  Entry stack[kStackSize];
  int top = 0;
  stack[top++] = {0, 0.0};
  while (top > 0) {
    const Entry entry = stack[--top];
    if (entry.bound >= best) continue;
    if (entry.child < 0) {
      const Block& block = blocks_[static_cast<std::size_t>(-1 - entry.child)];
      for (std::size_t i = 0; i < 4 && block.index[i] != kNoTriangle; ++i) {
        const auto corner = [i](const float(&from)[3][4]) {
          return Vec3f{from[0][i], from[1][i], from[2][i]}.cast<double>();
        };
        const Vec3d a = corner(block.corner[0]);
        best = std::min(
            best, SquaredDistance(p, a, corner(block.corner[1]) - a, corner(block.corner[2]) - a));
      }
      continue;
    }
    const Node& node = nodes_[static_cast<std::size_t>(entry.child)];
    const int base = top;
    for (int i = 0; i < 4; ++i) {
      if (node.child[i] == kEmpty) continue;
      double bound = 0;
      for (int a = 0; a < 3; ++a) {
        const double d = std::max({static_cast<double>(node.bound[a][i]) - point[a],
                                   point[a] - static_cast<double>(node.bound[a + 3][i]), 0.0});
        bound += d * d;
      }
      if (bound >= best) continue;
      int at = top++;
      while (at > base && stack[at - 1].bound < bound) {
        stack[at] = stack[at - 1];
        --at;
      }
      stack[at] = {node.child[i], bound};
    }
  }
  return std::sqrt(best);
}

}  // namespace sherd::synthetic
