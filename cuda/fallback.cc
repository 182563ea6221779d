#include "cuda/fallback.h"

#include <string>
#include <utility>

#include "metaball/error.h"

namespace sherd {
namespace {

class FallbackRenderer final : public Renderer {
 public:
  FallbackRenderer(std::unique_ptr<Renderer> primary, RendererFactory make_primary,
                   RendererFactory make_secondary)
      : primary_(std::move(primary)),
        make_primary_(std::move(make_primary)),
        make_secondary_(std::move(make_secondary)) {}

  std::string backend() const override {
    return primary_ || !secondary_ ? PrimaryName() : secondary_->backend();
  }
  std::string device() const override {
    if (primary_) return primary_->device();
    return secondary_ ? secondary_->device() + After() : "";
  }
  int gpu() const override { return primary_ ? primary_->gpu() : kNoGpu; }

  void Recycle(Frame frame) override {
    if (Renderer* drawing = primary_ ? primary_.get() : secondary_.get()) {
      drawing->Recycle(std::move(frame));
    }
  }

  Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
               const Control& control) override {
    if (!primary_ && failures_ < kFailuresAllowed) Restart();
    if (primary_) {
      try {
        Frame frame = primary_->Render(scene, camera, settings, control);
        failures_ = 0;
        return frame;
      } catch (const DeviceError& error) {
        // Its context may be lost for good: what it holds is given back before the CPU begins.
        ++failures_;
        reason_ = error.what();
        primary_.reset();
      } catch (const ResourceError& error) {
        reason_ = error.what();  // this frame is too much for it; the next may not be
      }
    }
    if (!secondary_) secondary_ = make_secondary_();
    Frame frame = secondary_->Render(scene, camera, settings, control);
    frame.stats.device += After();
    return frame;
  }

 private:
  static constexpr int kFailuresAllowed = 2;

  std::string PrimaryName() const { return primary_ ? primary_->backend() : ""; }
  std::string After() const { return " (after the GPU failed: " + reason_ + ")"; }

  void Restart() {
    try {
      primary_ = make_primary_();
    } catch (const Error& error) {
      failures_ = kFailuresAllowed;
      reason_ = error.what();
    }
  }

  std::unique_ptr<Renderer> primary_, secondary_;
  RendererFactory make_primary_, make_secondary_;
  int failures_ = 0;
  std::string reason_;
};

}  // namespace

std::unique_ptr<Renderer> MakeFallbackRenderer(std::unique_ptr<Renderer> primary,
                                               RendererFactory make_primary,
                                               RendererFactory make_secondary) {
  return std::make_unique<FallbackRenderer>(std::move(primary), std::move(make_primary),
                                            std::move(make_secondary));
}

}  // namespace sherd
