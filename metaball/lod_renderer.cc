#include "metaball/lod_renderer.h"

#include <chrono>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "metaball/appearance/deferred.h"
#include "metaball/cloud_version.h"
#include "metaball/error.h"
#include "metaball/level_of_detail.h"
#include "metaball/supersample.h"

namespace sherd {
namespace {

class LodRenderer final : public Renderer {
 public:
  LodRenderer(std::unique_ptr<Renderer> inner, double pixels)
      : inner_(std::move(inner)), pixels_(pixels) {}

  std::string backend() const override { return inner_->backend(); }
  std::string device() const override { return inner_->device(); }
  void Recycle(Frame frame) override { inner_->Recycle(std::move(frame)); }
  int gpu() const override { return inner_->gpu(); }

  Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
               const Control& control) override {
    CheckRenderInput(scene, camera, settings);
    const auto start = std::chrono::steady_clock::now();
    std::string note = WhyNot(scene, settings.planes);
    LevelChoice choice;
    if (note.empty()) {
      LevelsOfDetail& levels = LevelsOf(scene, settings.threads);
      note = levels.why_not();
      choice = levels.For(camera, pixels_, control);
    }
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

    Frame frame;
    if (choice.level) {
      Scene coarse = scene;
      coarse.cloud = choice.level->cloud;
      frame = inner_->Render(coarse, camera, settings, control);
      for (std::int32_t& id : frame.id) {
        if (id >= 0) id = static_cast<std::int32_t>(choice.level->representative[id]);
      }
      frame.stats.metaballs = scene.cloud->size();
      frame.stats.lod_metaballs = choice.level->metaballs;
      frame.stats.lod_error_px = choice.error_px;
    } else {
      frame = inner_->Render(scene, camera, settings, control);
    }
    frame.stats.lod_seconds = seconds;
    frame.stats.seconds_total += seconds;
    frame.stats.lod_bytes = levels_ ? levels_->MemoryBytes() : 0;
    frame.stats.lod_note = std::move(note);
    return frame;
  }

 private:
  static std::string WhyNot(const Scene& scene, const Planes& planes) {
    if (planes.weight || planes.intensity || planes.influence || !planes.uv.empty()) {
      return "a plane is wanted that shows the single metaballs";
    }
    if (NeedsDeferredPasses(scene, {})) return "the appearance looks at the single metaballs";
    return {};
  }

  LevelsOfDetail& LevelsOf(const Scene& scene, int threads) {
    if (!levels_ || !cloud_.Is(scene.cloud) || surface_ != scene.surface) {
      levels_.reset();
      levels_.emplace(*scene.cloud, scene.surface, threads);
      cloud_ = CloudVersion(scene.cloud);
      surface_ = scene.surface;
    }
    return *levels_;
  }

  std::unique_ptr<Renderer> inner_;
  double pixels_;
  std::optional<LevelsOfDetail> levels_;
  CloudVersion cloud_;
  Surface surface_;
};

}  // namespace

std::unique_ptr<Renderer> MakeLodRenderer(std::unique_ptr<Renderer> inner, double pixels) {
  if (!(pixels > 0) || !std::isfinite(pixels)) {
    throw Error("the level of detail's error must be a positive number of pixels");
  }
  return std::make_unique<LodRenderer>(std::move(inner), pixels);
}

}  // namespace sherd
