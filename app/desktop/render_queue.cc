#include "app/desktop/render_queue.h"

#include <algorithm>
#include <exception>
#include <new>
#include <utility>

#include "metaball/color.h"
#include "metaball/error.h"

namespace sherd {
namespace {

constexpr int kCoarsest = 8;
// A preview that has run this many times its share is given up for a coarser one.
constexpr double kOverrun = 4.0;

}  // namespace

QImage imageFromFrame(const Frame& frame, const Vec3f& background_srgb) {
  QImage image(frame.width, frame.height, QImage::Format_RGB32);
  if (image.isNull()) throw ResourceError("no memory for the picture on the screen", 0, 0);
  const Vec3f back = {LinearFromSrgb(background_srgb.x), LinearFromSrgb(background_srgb.y),
                      LinearFromSrgb(background_srgb.z)};
  for (int y = 0; y < frame.height; ++y) {
    auto* line = reinterpret_cast<QRgb*>(image.scanLine(y));
    const Pixel* pixels = frame.color.data() + static_cast<std::size_t>(y) * frame.width;
    for (int x = 0; x < frame.width; ++x) {
      const Pixel& p = pixels[x];
      const float rest = 1.0f - p.a;
      line[x] = qRgb(EncodeSrgb8(p.r + rest * back.x), EncodeSrgb8(p.g + rest * back.y),
                     EncodeSrgb8(p.b + rest * back.z));
    }
  }
  return image;
}

std::unique_ptr<Renderer> rendererOrAutomatic(const RendererFactory& factory,
                                              const DeviceChoice& choice, std::string* why) {
  try {
    return factory(choice, why);
  } catch (const DeviceError& error) {
    if (choice.backend != Backend::kCuda) throw;
    std::string instead;
    auto renderer = factory({}, &instead);
    if (why) *why = std::string(error.what()) + "; automatic: " + instead;
    return renderer;
  }
}

void PreviewCost::Record(double fixed_seconds, double pixel_seconds, std::uint64_t pixels) {
  if (pixels == 0) return;
  const double per_pixel = pixel_seconds / static_cast<double>(pixels);
  // Half of the old estimate stays: a single slow frame must not coarsen the next ten.
  const double keep = known_ ? 0.5 : 0.0;
  fixed_ = keep * fixed_ + (1 - keep) * fixed_seconds;
  per_pixel_ = keep * per_pixel_ + (1 - keep) * per_pixel;
  known_ = true;
}

int PreviewCost::DivisorFor(std::uint64_t full_pixels, double budget) const {
  if (!known_) return 4;
  for (int divisor = 1; divisor < kCoarsest; divisor *= 2) {
    const double pixels = static_cast<double>(full_pixels) / (divisor * divisor);
    if (fixed_ + per_pixel_ * pixels <= budget) return divisor;
  }
  return kCoarsest;
}

RenderQueue::RenderQueue(RendererFactory factory, QObject* parent)
    : QObject(parent), factory_(std::move(factory)) {
  worker_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

RenderQueue::~RenderQueue() {
  worker_.request_stop();
  {
    const std::lock_guard lock(mutex_);
    running_stop_.request_stop();
  }
  worker_.join();
}

int RenderQueue::addPane() {
  const std::lock_guard lock(mutex_);
  const int pane = next_pane_++;
  panes_[pane];
  return pane;
}

void RenderQueue::removePane(int pane) {
  const std::lock_guard lock(mutex_);
  panes_.erase(pane);
  if (running_.pane == pane) running_stop_.request_stop();
  wake_.notify_all();
}

void RenderQueue::request(int pane, RenderRequest request) {
  const std::lock_guard lock(mutex_);
  const auto it = panes_.find(pane);
  if (it == panes_.end()) return;
  Pane& p = it->second;
  // Photographs are sampled once a pixel: more rays would only cost time there.
  p.goal = request.final_supersample > 1 && !request.photos ? Stage::kSmooth : Stage::kFull;
  p.request = std::move(request);
  p.done = Stage::kNone;
  ++p.version;
  // A refinement, of whichever pane, gives way to the new preview. A preview that is about to be
  // shown is better than none: it is stopped only where it takes far longer than it should.
  if (running_.pane >= 0) {
    const bool refinement = running_.stage > Stage::kPreview;
    const double elapsed = static_cast<double>(running_since_.elapsed()) * 1e-3;
    const bool overrun = running_.pane == pane && running_.divisor < kCoarsest &&
                         elapsed > kOverrun * kPreviewSeconds;
    if (refinement || overrun) running_stop_.request_stop();
    if (overrun && !refinement) {
      const auto pixels = static_cast<std::uint64_t>(running_.request.camera.width) *
                          running_.request.camera.height / (running_.divisor * running_.divisor);
      p.cost.Record(0.0, elapsed, pixels);
    }
  }
  wake_.notify_all();
}

void RenderQueue::clear(int pane) {
  const std::lock_guard lock(mutex_);
  const auto it = panes_.find(pane);
  if (it == panes_.end()) return;
  it->second.request.reset();
  ++it->second.version;
  if (running_.pane == pane) running_stop_.request_stop();
}

void RenderQueue::setActivePane(int pane) {
  const std::lock_guard lock(mutex_);
  active_pane_ = pane;
}

void RenderQueue::setDevice(const DeviceChoice& choice) {
  const std::lock_guard lock(mutex_);
  choice_ = choice;
  renderers_stale_ = true;
  running_stop_.request_stop();
  for (auto& [id, pane] : panes_) {
    pane.done = Stage::kNone;
    ++pane.version;
    pane.cost = {};
  }
  wake_.notify_all();
}

bool RenderQueue::isIdle() const {
  const std::lock_guard lock(mutex_);
  if (running_.pane >= 0) return false;
  return std::all_of(panes_.begin(), panes_.end(), [](const auto& entry) {
    return !entry.second.request || entry.second.done >= entry.second.goal;
  });
}

// Panes that share the time of one round: those that wait and those that had their turn lately.
int RenderQueue::panesThatMove() const {
  return static_cast<int>(std::count_if(panes_.begin(), panes_.end(), [](const auto& entry) {
    return entry.second.request && (entry.second.done == Stage::kNone || entry.second.served > 0);
  }));
}

// Called with the mutex held. False when there is nothing to do.
bool RenderQueue::nextTask(Task* task) {
  const auto order = [this](int id) { return id == active_pane_ ? -1 : id; };
  int best = -1;
  for (const auto& [id, pane] : panes_) {
    if (!pane.request || pane.done >= pane.goal) continue;
    if (best < 0) {
      best = id;
      continue;
    }
    const Pane& other = panes_.at(best);
    if (pane.done != other.done) {
      if (pane.done < other.done) best = id;
    } else if (pane.done == Stage::kNone && pane.served != other.served) {
      // Everybody in turn, or the pane under the mouse would leave the linked ones behind.
      if (pane.served < other.served) best = id;
    } else if (order(id) < order(best)) {
      best = id;
    }
  }
  if (best < 0) return false;
  Pane& pane = panes_.at(best);
  task->pane = best;
  task->version = pane.version;
  task->request = *pane.request;
  task->divisor = 1;
  if (pane.done == Stage::kNone) {
    const Camera& camera = pane.request->camera;
    const std::uint64_t pixels = static_cast<std::uint64_t>(camera.width) * camera.height;
    task->divisor = pane.cost.DivisorFor(pixels, kPreviewSeconds / panesThatMove());
    task->stage = task->divisor == 1 ? Stage::kFull : Stage::kPreview;
  } else {
    task->stage = pane.done == Stage::kPreview ? Stage::kFull : Stage::kSmooth;
  }
  return true;
}

void RenderQueue::run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    Task task;
    if (!nextTask(&task)) {
      for (auto& [id, pane] : panes_) pane.served = 0;
      wake_.wait(lock, stop, [this] {
        Task waiting;
        return nextTask(&waiting);
      });
      continue;
    }
    running_ = task;
    if (panes_.at(task.pane).done == Stage::kNone) panes_.at(task.pane).served = ++clock_;
    running_since_.start();
    running_stop_ = std::stop_source();
    const bool start_over = std::exchange(renderers_stale_, false);
    if (start_over) shader_gpu_.reset();
    for (auto it = renderers_.begin(); it != renderers_.end();) {
      it = panes_.count(it->first) == 0 || start_over ? renderers_.erase(it) : std::next(it);
    }
    lock.unlock();
    serve(task);
    lock.lock();
    running_ = Task();
  }
}

void RenderQueue::serve(const Task& task) {
  Control control;
  {
    const std::lock_guard lock(mutex_);
    control.stop = running_stop_.get_token();
  }
  QElapsedTimer since_report;
  since_report.start();
  if (task.stage > Stage::kPreview) {
    control.progress = [this, &since_report, pane = task.pane](std::string_view, double fraction) {
      // Not worth showing for what is over at once.
      if (since_report.elapsed() < 200) return;
      since_report.restart();
      Q_EMIT progressed(pane, fraction);
    };
  }
  std::shared_ptr<RenderedView> view;
  QString failure;
  try {
    view = draw(task, control);
  } catch (const Cancelled&) {
    return;
  } catch (const std::bad_alloc&) {
    failure = tr("There is not enough memory for this view.");
  } catch (const std::exception& error) {
    failure = QString::fromUtf8(error.what());
  }
  {
    const std::lock_guard lock(mutex_);
    const auto it = panes_.find(task.pane);
    if (it == panes_.end()) return;
    Pane& pane = it->second;
    const bool current = pane.version == task.version;
    if (!view) {
      // The same request would fail the same way: wait for another one.
      if (current) pane.done = pane.goal;
    } else {
      const RenderStats& s = view->stats;
      const double fixed = std::min(s.seconds_prepare + s.seconds_bin, view->seconds);
      if (task.stage != Stage::kSmooth) {
        pane.cost.Record(fixed, view->seconds - fixed,
                         static_cast<std::uint64_t>(view->camera.width) * view->camera.height);
      }
      if (current) pane.done = task.stage;
      view->final = current && task.stage >= pane.goal;
    }
    if (!view && !current) return;
  }
  if (view) {
    Q_EMIT viewRendered(task.pane, std::move(view));
  } else {
    Q_EMIT renderFailed(task.pane, failure);
  }
}

std::shared_ptr<RenderedView> RenderQueue::draw(const Task& task, const Control& control) {
  QElapsedTimer timer;
  timer.start();
  const RenderRequest& request = task.request;
  if (shader_survey_.use_count() == 1) {
    // A project that was closed: nobody else knows this survey any more.
    shader_.reset();
    shader_survey_.reset();
  }
  auto view = std::make_shared<RenderedView>();
  view->divisor = task.divisor;
  view->level = request.level;
  view->camera = request.camera;
  if (task.divisor > 1) {
    view->camera = request.camera.Resized(std::max(1, request.camera.width / task.divisor),
                                          std::max(1, request.camera.height / task.divisor));
  }
  Scene scene;
  scene.cloud = std::shared_ptr<const Cloud>(request.level, &request.level->cloud);
  scene.surface = request.surface;
  scene.lighting = request.lighting;
  RenderSettings settings;
  settings.planes.depth = settings.planes.id = true;
  settings.planes.normal = request.photos != nullptr;
  settings.planes.light = request.photos && !request.lighting.unlit;
  if (task.stage == Stage::kSmooth) settings.supersample = request.final_supersample;
  view->samples = settings.supersample;
  Frame frame;
  try {
    frame = rendererFor(task.pane).Render(scene, view->camera, settings, control);
  } catch (const DeviceError& error) {
    // The GPU was lost or is full: go on without it rather than not at all.
    {
      const std::lock_guard lock(mutex_);
      if (choice_.backend == Backend::kCpu) throw;
      choice_ = {Backend::kCpu};
    }
    renderers_.clear();
    Renderer& renderer = rendererFor(task.pane);
    Q_EMIT deviceChosen(
        QString::fromStdString(renderer.backend()), QString::fromStdString(renderer.device()),
        tr("the GPU failed (%1): using the CPU").arg(QString::fromUtf8(error.what())));
    frame = renderer.Render(scene, view->camera, settings, control);
  }
  tellDevice(task.pane);
  if (request.photos) {
    view->photo_stats = shaderFor(request.photos, rendererFor(task.pane))
                            .Shade(request.level, request.surface, view->camera, &frame, control);
  }
  view->image = imageFromFrame(frame, request.background_srgb);
  view->depth = std::move(frame.depth);
  view->id = std::move(frame.id);
  view->stats = std::move(frame.stats);
  rendererFor(task.pane).Recycle(std::move(frame));
  view->seconds = static_cast<double>(timer.nsecsElapsed()) * 1e-9;
  return view;
}

Renderer& RenderQueue::rendererFor(int pane) {
  PaneRenderer& own = renderers_[pane];
  if (!own.renderer) {
    DeviceChoice choice;
    {
      const std::lock_guard lock(mutex_);
      choice = choice_;
    }
    std::string why;
    own.renderer = rendererOrAutomatic(factory_, choice, &why);
    own.told = own.renderer->device();
    Q_EMIT deviceChosen(QString::fromStdString(own.renderer->backend()),
                        QString::fromStdString(own.told), QString::fromStdString(why));
  }
  return *own.renderer;
}

void RenderQueue::tellDevice(int pane) {
  PaneRenderer& own = renderers_.at(pane);
  std::string device = own.renderer->device();
  if (device == own.told) return;
  own.told = std::move(device);
  Q_EMIT deviceChosen(QString::fromStdString(own.renderer->backend()),
                      QString::fromStdString(own.told), {});
}

PhotographShader& RenderQueue::shaderFor(const std::shared_ptr<const Survey>& survey,
                                         Renderer& renderer) {
  if (shader_survey_ != survey) {
    shader_ = std::make_unique<PhotographShader>(*survey);
    shader_survey_ = survey;
    shader_gpu_.reset();
  }
  if (shader_gpu_ != renderer.gpu()) {
    shader_->ShadeOn(MakePhotoShader(renderer));
    shader_gpu_ = renderer.gpu();
  }
  shader_->DrawWith(&renderer);
  return *shader_;
}

}  // namespace sherd
