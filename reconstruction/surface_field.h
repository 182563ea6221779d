// The field that metaballs make, where levels are built. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <vector>

#include "metaball/cloud.h"
#include "metaball/support_index.h"

namespace sherd {

// Murakami's density (thesis 2.4), for which levels are made: the sum over all metaballs of
// (1 - d^2 / r^2)^2 where d < r. Lengths in the cloud's local units. The cloud must outlive this;
// its centres may move by up to `margin` after it was made, its radii not grow. Thread-safe for
// reading.
class SurfaceField {
 public:
  explicit SurfaceField(const Cloud& cloud, float margin = 0.0f)
      : cloud_(cloud), index_(cloud, margin) {}

  struct Value {
    float field = 0;
    Vec3f gradient{};  // per local unit; points inwards where the surface is
  };
  Value At(const Vec3f& p) const;

  // Calls visit(metaball, its density) for each metaball whose support holds p.
  template <class Visit>
  void ForEach(const Vec3f& p, const Visit& visit) const {
    const SupportIndex::Range range = index_.At(p);
    for (const std::uint32_t* i = range.begin; i != range.end; ++i) {
      const Vec3f d = p - cloud_.center[*i];
      const float r = cloud_.RadiusOf(*i);
      const float x = 1 - Dot(d, d) / (r * r);
      if (x > 0) visit(*i, x * x);
    }
  }

  // The metaballs that may hold p; a superset.
  SupportIndex::Range Around(const Vec3f& p) const { return index_.At(p); }

  // How far p lies from the surface field = threshold: the length of a way to a point of the
  // surface, found by Newton steps along the gradient; where these lead nowhere (p in an open place
  // or outside every support), on the straight line to the nearest inside point near `anchor`, a
  // metaball. So it is never less than the distance, and near the surface equal to it to second
  // order. Negative where p lies inside. Infinite where neither way meets the surface. outward:
  // unit, where to turn from a place without a slope.
  float SignedDistance(const Vec3f& p, const Vec3f& outward, float threshold,
                       std::uint32_t anchor) const;

  const Cloud& cloud() const { return cloud_; }

 private:
  const Cloud& cloud_;
  SupportIndex index_;
};

}  // namespace sherd
