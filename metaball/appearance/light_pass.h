// Light on a finished frame: several lights (thesis 3.7 for each, summed, then clamped), shadows
// and ambient occlusion.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "metaball/camera.h"
#include "metaball/control.h"
#include "metaball/frame.h"
#include "metaball/scene.h"
#include "metaball/vec.h"

namespace sherd {

class LightPass {
 public:
  // Casts the rays of shadows and ambient occlusion. frame: with depth and normal planes, and with
  // ids where either is asked for.
  LightPass(const Scene& scene, const Camera& camera, const Frame& frame, int threads,
            const Control& control);

  // min(1, C (ambient a + diffuse sum_i color_i intensity_i max(0, n . l_i) v_i)), a and v_i the
  // shares of ambient light and of light i that reach the point; C itself in an unlit scene.
  Vec3f Lit(std::size_t pixel, const Vec3f& color, const Vec3d& point, const Vec3f& normal,
            const Vec3f& to_viewer) const;
  // Rays that the march could not decide (RenderStats::unresolved); taken as open.
  std::uint64_t unresolved() const { return unresolved_; }

 private:
  struct PreparedLight {
    enum class Kind { kViewer, kDirection, kPlace } kind;
    Vec3d place{};  // the direction or the position, world
    Vec3f strength{};
    std::vector<std::uint8_t> visible;  // by pixel; empty: everywhere
  };
  // Rays from one group of points, cast together.
  class RayBatch;

  void CastRays(const Scene& scene, const Camera& camera, const Frame& frame, int threads,
                const Control& control);

  bool unlit_;
  float ambient_, diffuse_;
  std::vector<PreparedLight> lights_;
  std::vector<float> ambient_share_;  // by pixel; empty: 1
  std::uint64_t unresolved_ = 0;
};

}  // namespace sherd
