// Nearest neighbours by PCL's k-d tree. Internal to reconstruction/; no PCL type shows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "metaball/vec.h"

namespace sherd {

// Positions as floats in a frame of their own (PCL has no other): the centre of the central 98 % of
// the points is the origin, and half their extent the unit, so that a float resolves 1e-7 of the
// survey wherever in the world it lies. Points farther than 1e4 units out are moved in to there
// (they are strays, and stay far from everything).
struct SearchFrame {
  Vec3d origin{};
  double unit = 1.0;  // world length

  static SearchFrame For(const std::vector<Vec3d>& positions);
  Vec3f Local(const Vec3d& p) const;
};

class NeighborSearch {
 public:
  explicit NeighborSearch(const std::vector<Vec3d>& positions);
  ~NeighborSearch();

  // The k nearest points to point i, nearest first, itself included (at distance 0, but not always
  // first where points coincide). Fewer where there are fewer points. distance in world units.
  // Returns their number. Thread-safe; the same on every call.
  int Nearest(std::size_t i, int k, int* idx, float* distance) const;
  int Nearest(const Vec3d& p, int k, int* idx, float* distance) const;  // to p, any place
  // The same within `radius` (world units), at most k.
  int Within(std::size_t i, double radius, int k, int* idx, float* distance) const;
  // The nearest point to p; -1 where there are none.
  int NearestTo(const Vec3d& p) const;
  // Points within `radius` (world units) of point i, itself included.
  int CountWithin(std::size_t i, double radius) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sherd
