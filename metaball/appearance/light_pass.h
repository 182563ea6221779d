// Light on a finished frame: several lights, shadows and ambient occlusion.
#pragma once

#include <cstdint>
#include <vector>

#include "metaball/appearance/light_view.h"
#include "metaball/camera.h"
#include "metaball/control.h"
#include "metaball/frame.h"
#include "metaball/scene.h"
#include "metaball/vec.h"

namespace sherd {

// The scene's lights seen by the camera, without shadows; none for an unlit scene.
std::vector<PreparedLight> PrepareLights(const Scene& scene, const Camera& camera);

// The scene's light, without what ambient occlusion takes from it. lights: of PrepareLights; they
// must live on.
LightView MakeLightView(const Scene& scene, const std::vector<PreparedLight>& lights);

// The directions that ambient light is asked for along, unit; none where occlusion is off.
std::vector<Vec3d> AmbientDirections(const AmbientOcclusion& occlusion);
// How far, in local units; > 0. The scene's cloud must not be empty.
double AmbientReach(const Scene& scene);

class LightPass {
 public:
  // Casts the rays of shadows and ambient occlusion. frame: with depth and normal planes, and with
  // ids where either is asked for.
  LightPass(const Scene& scene, const Camera& camera, const Frame& frame, int threads,
            const Control& control);
  LightPass(const LightPass&) = delete;  // lights point into it
  LightPass& operator=(const LightPass&) = delete;

  // Valid while the pass lives.
  const LightView& view() const { return view_; }
  // Rays that the march could not decide (RenderStats::unresolved); taken as open.
  std::uint64_t unresolved() const { return unresolved_; }

 private:
  // Rays from one group of points, cast together.
  class RayBatch;

  void CastRays(const Scene& scene, const Camera& camera, const Frame& frame, int threads,
                const Control& control);

  std::vector<PreparedLight> lights_;
  // By light and pixel; empty for those without shadows, and all of it where there are none.
  std::vector<std::vector<std::uint8_t>> visible_;
  std::vector<float> ambient_share_;  // by pixel; empty: 1
  LightView view_;
  std::uint64_t unresolved_ = 0;
};

}  // namespace sherd
