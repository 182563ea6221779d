// A renderer that fills the picture at once, or waits, or fails, as a test wants it.
#pragma once

#include <QSize>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <semaphore>
#include <string>
#include <thread>
#include <vector>

#include "app/desktop/render_queue.h"
#include "metaball/error.h"

namespace sherd {

class FakeRendererLog {
 public:
  std::counting_semaphore<> holding{0};  // released by pictures that begin to last until stopped
  std::atomic<int> cancelled{0};
  std::mutex gate;                                 // pictures begin when it can be taken
  std::atomic<QSize> hold_full_size{QSize(0, 0)};  // pictures of this size last until stopped
  std::string fail_with;                           // set only while nothing is drawn
  std::atomic<bool> device_fails{false};
  std::atomic<bool> ailing{false};  // the device calls itself by another name

  std::vector<int> supersamples() const {
    const std::lock_guard lock(mutex_);
    return supersamples_;
  }
  std::vector<DeviceChoice> choices() const {
    const std::lock_guard lock(mutex_);
    return choices_;
  }
  void choose(const DeviceChoice& choice) {
    const std::lock_guard lock(mutex_);
    choices_.push_back(choice);
  }
  void drawn(const RenderSettings& settings) {
    const std::lock_guard lock(mutex_);
    supersamples_.push_back(settings.supersample);
  }

 private:
  mutable std::mutex mutex_;
  std::vector<int> supersamples_;
  std::vector<DeviceChoice> choices_;
};

class FakeRenderer : public Renderer {
 public:
  FakeRenderer(std::shared_ptr<FakeRendererLog> log, const DeviceChoice& choice)
      : log_(std::move(log)), backend_(choice.backend) {}

  Frame Render(const Scene&, const Camera& camera, const RenderSettings& settings,
               const Control& control) override {
    { const std::lock_guard wait(log_->gate); }
    if (log_->device_fails && backend_ != Backend::kCpu) {
      throw DeviceError("trace", 2, "out of memory");
    }
    if (!log_->fail_with.empty()) throw Error(log_->fail_with);
    if (log_->hold_full_size.load() == QSize(camera.width, camera.height)) {
      log_->holding.release();
      while (!control.stopped()) std::this_thread::yield();
      ++log_->cancelled;
      throw Cancelled();
    }
    log_->drawn(settings);
    Frame frame;
    frame.width = camera.width;
    frame.height = camera.height;
    const auto pixels = static_cast<std::size_t>(camera.width) * camera.height;
    frame.color.assign(pixels, {0.2f, 0.3f, 0.4f, 1.0f});
    frame.depth.assign(pixels, 2.0f);
    frame.id.assign(pixels, 0);
    frame.stats.rays = frame.stats.hits = pixels;
    return frame;
  }
  std::string backend() const override { return backend_ == Backend::kCpu ? "cpu" : "cuda"; }
  std::string device() const override { return log_->ailing ? "an ailing fake" : "a fake"; }

 private:
  std::shared_ptr<FakeRendererLog> log_;
  Backend backend_;
};

inline RendererFactory FakeRendererFactory(std::shared_ptr<FakeRendererLog> log) {
  return [log](const DeviceChoice& choice, std::string* why) -> std::unique_ptr<Renderer> {
    log->choose(choice);
    if (choice.gpu > 0) throw DeviceError("CUDA", 0, "there is no such GPU");
    if (why) *why = "because";
    return std::make_unique<FakeRenderer>(log, choice);
  };
}

}  // namespace sherd
