// The metaballs that one ray may meet, from the tree of a cloud's supports: on the CPU and on the
// GPU.
#pragma once

#include <cstdint>

#include "metaball/appearance/occlusion_rays.h"
#include "metaball/appearance/support_tree_view.h"
#include "metaball/bits.h"
#include "metaball/density/scalar_math.h"
#include "metaball/hostdevice.h"
#include "metaball/tile_entry.h"
#include "metaball/vec.h"

namespace sherd {
namespace ray_walk {

#define SHERD_FORMULA SHERD_HD
#include "metaball/appearance/beam-inl.h"
#undef SHERD_FORMULA

template <class Take>
struct Visitor {
  const SupportTreeView& tree;
  const Beam& beam;
  const Take& take;

  SHERD_HD std::uint32_t Boxes(const SupportTreeLevelView& level, std::uint32_t first) const {
    std::uint32_t met = 0;
    for (std::uint32_t b = 0; b < SupportTreeView::kWidth; ++b) {
      const std::uint32_t k = first + b;
      met |= static_cast<std::uint32_t>(BeamMeetsBox(beam, level.min_x[k], level.min_y[k],
                                                     level.min_z[k], level.max_x[k], level.max_y[k],
                                                     level.max_z[k]))
             << b;
    }
    return met;
  }
  SHERD_HD void Metaballs(std::uint32_t first) const {
    for (std::uint32_t k = first; k < first + SupportTreeView::kWidth; ++k) {
      float front = 0.0f, exit = 0.0f;
      if (BeamMeetsSupport(beam, tree.x[k], tree.y[k], tree.z[k], tree.radius[k], &front, &exit)) {
        take(TileEntry{tree.IndexOf(k), front});
      }
    }
  }
};

}  // namespace ray_walk

// Calls take(TileEntry) for every metaball whose support the ray may pass between its begin and its
// end, in no order. Fronts count from the ray's begin, local units.
template <class Take>
SHERD_HD void ForEachOnRay(const SupportTreeView& tree, const OcclusionRay& ray, const Take& take) {
  const double length = ray.end - ray.begin;
  if (!(length > 0.0)) return;
  const Beam beam =
      tree.BeamAlong(ray.origin + ray.direction * ray.begin, ray.direction, 0.0, 0.0, length);
  ray_walk::Visitor<Take> visitor{tree, beam, take};
  ray_walk::WalkTree(tree, &visitor);
}

// The order of a list that is marched through: nearest front first.
SHERD_HD bool IsBefore(const TileEntry& a, const TileEntry& b) {
  return a.front < b.front || (a.front == b.front && a.metaball < b.metaball);
}

}  // namespace sherd
