// The one interface in front of every backend.
#pragma once

#include <memory>
#include <string>

#include "metaball/camera.h"
#include "metaball/control.h"
#include "metaball/frame.h"
#include "metaball/scene.h"

namespace sherd {

struct RenderSettings {
  Planes planes;
  int supersample =
      1;  // n x n rays a pixel, averaged in linear light; 1..8. Planes take the first ray.
  int threads = 0;  // CPU threads; 0: all
};

class Renderer {
 public:
  static constexpr int kNoGpu = -1;

  virtual ~Renderer() = default;

  // Draws `scene` seen by `camera`. Background pixels are (0, 0, 0, 0). An empty cloud gives an
  // empty picture. Throws Cancelled when control.stop is set, Error for a camera or surface out of
  // range, ResourceError for a picture that does not fit in memory. Not thread-safe: one call at a
  // time on one Renderer, which keeps its buffers between calls. Different Renderers may work at
  // once.
  virtual Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
                       const Control& control = {}) = 0;

  // Takes a frame that is no longer needed, or what is left of one: the next Render may write into
  // its memory. Fresh memory is paid for page by page, which for a picture of many megapixels takes
  // longer than drawing it. Nothing else depends on it.
  virtual void Recycle(Frame frame) { (void)frame; }

  virtual std::string backend() const = 0;  // "cpu" or "cuda"
  virtual std::string device() const = 0;   // what it runs on, for people
  // The GPU it draws on, as CUDA numbers them, of several the first; kNoGpu where the CPU draws.
  // What works beside it on the same picture belongs there.
  virtual int gpu() const { return kNoGpu; }
};

std::unique_ptr<Renderer> MakeCpuRenderer();

}  // namespace sherd
