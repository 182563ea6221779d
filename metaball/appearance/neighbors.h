// The nearest metaballs of a metaball, for what is derived from a cloud once (gradients of texture
// coordinates, local spacing). The renderer itself needs no such index.
#pragma once

#include <cstdint>
#include <vector>

#include "metaball/vec.h"

namespace sherd {

// A k-d tree over points that must outlive it. Safe from several threads.
class NeighborIndex {
 public:
  explicit NeighborIndex(const std::vector<Vec3f>& points);

  struct Neighbor {
    float distance2;
    std::uint32_t idx;
  };
  // The k points nearest to `query`, nearest first, equal distances by index; fewer where there are
  // fewer. Reuses `found`.
  void Nearest(const Vec3f& query, int k, std::vector<Neighbor>* found) const;

 private:
  void Split(std::size_t begin, std::size_t end);
  void Search(const Vec3f& query, std::size_t k, std::size_t begin, std::size_t end,
              std::vector<Neighbor>* heap) const;

  const std::vector<Vec3f>& points_;
  std::vector<std::uint32_t> order_;  // leaves of the tree side by side; a node is its middle
  std::vector<std::uint8_t> axis_;    // by position in order_: the axis its node splits
};

}  // namespace sherd
