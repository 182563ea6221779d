// Rendering off the interface thread: one worker serves all panes in turn.
//
// A pane asks for a view; the worker first draws a preview at a reduced resolution chosen from the
// last times so that all panes together keep up with the mouse, then, when nothing newer is asked
// for, the view at full resolution, then, where wanted, with several rays a pixel. A new view stops
// a running refinement at once. Previews take turns, refinements start with the active pane.
#pragma once

#include <QElapsedTimer>
#include <QImage>
#include <QObject>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <vector>

#include "app/project/picture.h"
#include "cuda/renderers.h"
#include "metaball/renderer.h"
#include "reconstruction/photographs.h"

namespace sherd {

using RendererFactory =
    std::function<std::unique_ptr<Renderer>(const DeviceChoice&, std::string* why)>;

// The renderer of a choice; where a GPU that was chosen is not there or cannot be used, that of the
// automatic choice. `why`, when given, says in one line what draws and why.
std::unique_ptr<Renderer> rendererOrAutomatic(const RendererFactory& factory,
                                              const DeviceChoice& choice, std::string* why);

struct RenderRequest {
  std::shared_ptr<const Level> level;
  Surface surface;
  Lighting lighting;
  Camera camera;                         // at full resolution, device pixels
  std::shared_ptr<const Survey> photos;  // colours from its photographs; null: blended colours
  Vec3f background_srgb{};
  int final_supersample = 1;
};

struct RenderedView {
  QImage image;   // opaque, sRGB, RGB32
  Camera camera;  // of the image; smaller than the request's by `divisor`
  std::shared_ptr<const Level> level;
  std::vector<float> depth;      // world units along the ray, 0 where nothing is hit
  std::vector<std::int32_t> id;  // -1 for none
  RenderStats stats;
  std::optional<PhotoShadingStats> photo_stats;
  double seconds = 0;  // all of it: rendering, photographs, conversion
  int divisor = 1;     // 1: full resolution
  int samples = 1;     // rays a side of each pixel
  bool final = false;  // nothing better follows unless something changes
};

// What a pane's pictures have cost, to choose the next preview's resolution.
class PreviewCost {
 public:
  void Record(double fixed_seconds, double pixel_seconds, std::uint64_t pixels);
  // The smallest of 1, 2, 4, 8 whose expected time for full_pixels / divisor^2 is within `budget`
  // seconds; 8 when none is. Without any record: 4.
  int DivisorFor(std::uint64_t full_pixels, double budget) const;

 private:
  bool known_ = false;
  double fixed_ = 0, per_pixel_ = 0;
};

class RenderQueue : public QObject {
  Q_OBJECT

 public:
  // About 25 pictures a second over all panes that move.
  static constexpr double kPreviewSeconds = 0.040;

  explicit RenderQueue(RendererFactory factory, QObject* parent = nullptr);
  ~RenderQueue() override;

  // Ids are not used again.
  int addPane();
  void removePane(int pane);
  // Replaces what the pane shows. Returns at once.
  void request(int pane, RenderRequest request);
  // Forgets what was asked for.
  void clear(int pane);
  void setActivePane(int pane);
  // Starts over with renderers of another choice, or by default of the automatic one.
  void setDevice(const DeviceChoice& choice);
  // True when every pane has what it asked for.
  bool isIdle() const;

 Q_SIGNALS:
  // Emitted from the worker: connect to objects of the interface thread.
  void viewRendered(int pane, std::shared_ptr<const sherd::RenderedView> view);
  // 0..1 while a full-resolution picture takes long.
  void progressed(int pane, double fraction);
  void renderFailed(int pane, const QString& message);
  // What draws from now on, also where a renderer changed by itself. `backend` is "cpu" or "cuda",
  // `why` one line for people.
  void deviceChosen(const QString& backend, const QString& device, const QString& why);

 private:
  enum class Stage { kNone, kPreview, kFull, kSmooth };
  struct Pane {
    std::optional<RenderRequest> request;
    std::uint64_t version = 0;
    Stage done = Stage::kNone;
    Stage goal = Stage::kNone;
    std::uint64_t served = 0;  // when its last preview began; 0: not since the queue was idle
    PreviewCost cost;
  };
  struct Task {
    int pane = -1;
    std::uint64_t version = 0;
    Stage stage = Stage::kNone;
    int divisor = 1;
    RenderRequest request;
  };

  void run(const std::stop_token& stop);
  bool nextTask(Task* task);
  int panesThatMove() const;
  void serve(const Task& task);
  std::shared_ptr<RenderedView> draw(const Task& task, const Control& control);
  Renderer& rendererFor(int pane);
  // Tells where the pane's renderer is another than it was.
  void tellDevice(int pane);
  // Its photographs are looked up where `renderer` draws.
  PhotographShader& shaderFor(const std::shared_ptr<const Survey>& survey, Renderer& renderer);

  RendererFactory factory_;
  mutable std::mutex mutex_;  // guards everything down to the renderers
  std::condition_variable_any wake_;
  std::map<int, Pane> panes_;
  int next_pane_ = 0;
  int active_pane_ = -1;
  std::uint64_t clock_ = 0;  // counts previews
  Task running_;
  QElapsedTimer running_since_;
  std::stop_source running_stop_;
  DeviceChoice choice_;
  bool renderers_stale_ = false;

  // The worker's own.
  struct PaneRenderer {
    std::unique_ptr<Renderer> renderer;
    std::string told;  // its device, when it was last told
  };
  std::map<int, PaneRenderer> renderers_;
  std::shared_ptr<const Survey> shader_survey_;
  std::unique_ptr<PhotographShader> shader_;
  std::optional<int> shader_gpu_;  // for which it was given a device last

  std::jthread worker_;  // last: started when everything else is there, joined first
};

// The frame over an opaque background, as a window shows it: sRGB bytes.
QImage imageFromFrame(const Frame& frame, const Vec3f& background_srgb);

}  // namespace sherd

Q_DECLARE_METATYPE(std::shared_ptr<const sherd::RenderedView>)
