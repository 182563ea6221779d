// The information vector V at a surface point: every channel that is wanted, blended by the weights
// f_i / sum f (thesis 2.1.1, 3.1). The tracers call it for a hit only where planes ask for it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "metaball/appearance/gather_sums.h"
#include "metaball/channel.h"
#include "metaball/cloud.h"
#include "metaball/density/model.h"
#include "metaball/frame.h"
#include "metaball/scene.h"
#include "metaball/vec.h"

namespace sherd {

// A metaball whose support may hold the hit; centre relative to the tracer's reference point.
struct GatherSphere {
  Vec3f center;
  float inverse_radius;  // of the support
  std::uint32_t idx;     // in the cloud
};

// This thread's list of them, emptied: filled by the tracers for one hit or one packet of hits.
std::vector<GatherSphere>& GatherScratch();

class SurfaceGather {
 public:
  // Allocates the planes. The cloud and the frame must outlive it. Throws as AllocateGatherPlanes.
  SurfaceGather(const Cloud& cloud, const Surface& surface, const Planes& planes, Frame* frame);

  // Fills the planes of one pixel. point: local units, relative to the same reference point as the
  // spheres. Safe from several threads for different pixels.
  void AtHit(std::size_t pixel, const Vec3f& point, const std::vector<GatherSphere>& spheres) const;

 private:
  struct Source {
    ChannelView channel;
    ChannelPlane* plane;
  };
  struct UvSource {
    UvChannel channel;
    UvPlane* plane;
  };

  // The density at the point over its amplitude; 0 outside the support, and where it is negative.
  float WeightAt(const Vec3f& point, const GatherSphere& sphere) const;
  // The one whose sphere the point lies on (ThresholdMode::kGated).
  GatherSphere OwnerOf(const Vec3f& point, const std::vector<GatherSphere>& spheres) const;
  void Blend(std::size_t pixel, const Vec3f& point, const std::vector<GatherSphere>& spheres) const;
  SurfaceUv BlendUv(const UvChannel& channel, const Vec3f& point,
                    const std::vector<GatherSphere>& spheres) const;

  const Cloud& cloud_;
  const Surface surface_;
  ResolvedDensity density_;
  Frame* frame_;
  std::vector<Source> sources_;
  std::vector<UvSource> uv_sources_;
};

// The channel of that name; throws Error naming the channels there are.
const Channel& ChannelNamed(const Cloud& cloud, const std::string& name);
// The same for texture coordinates: throws Error where it has not two components.
const Channel& UvChannelNamed(const Cloud& cloud, const std::string& name);

// The planes in `frame` that Planes::NeedGather speaks of, all zero. Throws Error for a channel
// that the cloud does not have and for texture coordinates without two components.
void AllocateGatherPlanes(const Cloud& cloud, const Planes& planes, Frame* frame);

}  // namespace sherd
