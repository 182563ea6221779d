// Nearest neighbours by a k-d tree (nanoflann). Internal to reconstruction/.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "metaball/vec.h"

namespace sherd {

// A frame in which floats resolve 1e-7 of a survey wherever in the world it lies, and squares of
// distances neither overflow nor vanish however large its unit is: the centre of the central 98 %
// of the points is the origin, and half their extent the unit. Points farther than 1e4 units out
// are moved in to there (they are strays, and stay far from everything).
struct SearchFrame {
  Vec3d origin{};
  double unit = 1.0;  // world length

  static SearchFrame For(const std::vector<Vec3d>& positions);
  Vec3f Local(const Vec3d& p) const;
  // Of one coordinate.
  static double Local(double world, double origin, double inverse_unit) {
    constexpr double kFarthest = 1e4;
    return std::clamp((world - origin) * inverse_unit, -kFarthest, kFarthest);
  }
};

class NeighborSearch {
 public:
  // positions: finite, less than 2^31; they stay as they are for as long as this is used. Beside
  // them it holds 10 to 15 bytes for each.
  explicit NeighborSearch(const std::vector<Vec3d>& positions);
  explicit NeighborSearch(std::vector<Vec3d>&& positions) = delete;
  ~NeighborSearch();

  // The k nearest points to point i, nearest first, itself included (at distance 0, but not always
  // first where points coincide). Fewer where there are fewer points. Returns their number.
  // Thread-safe; the same on every call.
  int Nearest(std::size_t i, int k, int* idx, float* distance) const;
  int Nearest(const Vec3d& p, int k, int* idx, float* distance) const;  // to p, any place
  // The same within `radius`, at most k.
  int Within(std::size_t i, double radius, int k, int* idx, float* distance) const;
  // The nearest point to p; -1 where there are none.
  int NearestTo(const Vec3d& p) const;
  // Points within `radius` of point i, itself included.
  int CountWithin(std::size_t i, double radius) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sherd
