// What the metaballs say about a point of their surface. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <vector>

#include "metaball/vec.h"
#include "reconstruction/level.h"
#include "reconstruction/support_index.h"

namespace sherd {

struct SurfacePoint {
  Vec3d position{};  // world: on the sheet the metaballs stand for
  Vec3f normal{};    // unit, world
  struct PhotoShare {
    std::uint16_t photo = 0;
    float weight = 0;  // share of the field that comes from metaballs this photograph sees
  };
  std::vector<PhotoShare> photos;
};

class SurfaceSampler {
 public:
  explicit SurfaceSampler(const Cloud& cloud);

  // level: whose cloud it was made for. hit: a point of the field's surface, world; ray: unit
  // direction it was found along; id: its strongest metaball; shading_normal: of the field, unit.
  // Thread-safe.
  void Sample(const Level& level, const Vec3d& hit, const Vec3d& ray, std::int32_t id,
              const Vec3f& shading_normal, SurfacePoint* out) const;

 private:
  SupportIndex index_;
};

}  // namespace sherd
