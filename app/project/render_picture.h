// Pictures of any size, with the colours of the metaballs or of the photographs.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <utility>

#include "metaball/renderer.h"
#include "reconstruction/level.h"
#include "reconstruction/photographs.h"

namespace sherd {

// A shader of the survey's photographs that works where `renderer` draws: on its GPU, if it has
// one, and what each photograph sees is drawn by it. Both must outlive it.
PhotographShader MakePhotographShader(const Survey& survey, Renderer* renderer,
                                      const PhotoShadingOptions& options = {});

// A renderer that gives every hit the colour the photographs show there. The scene it is given must
// hold the level's cloud.
class PhotographRenderer final : public Renderer {
 public:
  // `inner` and `shader` must outlive it.
  PhotographRenderer(Renderer* inner, PhotographShader* shader, std::shared_ptr<const Level> level)
      : inner_(inner), shader_(shader), level_(std::move(level)) {}

  Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
               const Control& control = {}) override;
  std::string backend() const override { return inner_->backend(); }
  std::string device() const override { return inner_->device(); }
  int gpu() const override { return inner_->gpu(); }
  void Recycle(Frame frame) override { inner_->Recycle(std::move(frame)); }

  // Sums over all pictures so far.
  const PhotoShadingStats& photo_stats() const { return stats_; }

 private:
  Renderer* inner_;
  PhotographShader* shader_;
  std::shared_ptr<const Level> level_;
  PhotoShadingStats stats_;
};

// The rows of a picture that are rendered at once so that a strip's planes stay below max_bytes: at
// least one row.
int StripRows(const Camera& camera, const Planes& planes, std::size_t max_bytes);

inline constexpr std::size_t kStripBytes = std::size_t{384} << 20;

// Renders from the top in strips as StripRows says; `sink` receives each. Returns the sums of the
// strips' figures. Throws as Renderer::Render and what `sink` throws.
RenderStats RenderInStrips(Renderer* renderer, const Scene& scene, const Camera& camera,
                           const RenderSettings& settings,
                           const std::function<void(Frame&& strip)>& sink,
                           const Control& control = {}, std::size_t max_bytes = kStripBytes);

}  // namespace sherd
