// One picture by several renderers: the same as by one, whatever happens to some of them.
#include "cuda/shared_renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <mutex>
#include <numeric>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "cuda/band_balance.h"
#include "cuda/host_loop.h"
#include "datasets_synthetic/peer_scenes.h"
#include "metaball/error.h"

namespace sherd {
namespace {

// ---- the same picture ---------------------------------------------------------------------------

std::unique_ptr<Renderer> HostLoops(int count) {
  std::vector<std::unique_ptr<Renderer>> renderers;
  for (int i = 0; i < count; ++i) renderers.push_back(MakeHostLoopRenderer());
  return MakeSharedRenderer(std::move(renderers));
}

// Pixels that differ by more than the last bits of a ray can make: none inside, a few on rims.
std::size_t PixelsOff(const Frame& a, const Frame& b) {
  std::size_t off = 0;
  for (std::size_t i = 0; i < a.color.size(); ++i) {
    const Pixel &p = a.color[i], &q = b.color[i];
    bool same = std::abs(p.r - q.r) < 1e-3f && std::abs(p.g - q.g) < 1e-3f &&
                std::abs(p.b - q.b) < 1e-3f && std::abs(p.a - q.a) < 1e-3f;
    if (!a.depth.empty()) same = same && std::abs(a.depth[i] - b.depth[i]) < 1e-4f;
    if (!a.normal.empty()) same = same && Length(a.normal[i] - b.normal[i]) < 1e-2f;
    if (!a.id.empty()) same = same && a.id[i] == b.id[i];
    off += !same;
  }
  return off;
}

TEST(SharedRenderer, ThePictureIsThatOfOneRenderer) {
  RenderSettings settings;
  settings.planes = {true, true, true};
  for (const int supersample : {1, 3}) {
    settings.supersample = supersample;
    // A height that is no multiple of the step, and a picture that has fewer steps than renderers.
    for (const auto& [width, height] : {std::pair{90, 61}, {40, 11}}) {
      const PeerScene field = MakeHeightField(3000, width, height);
      const Frame one = MakeHostLoopRenderer()->Render(field.scene, field.camera, settings);
      const auto shared = HostLoops(3);
      for (int frame = 0; frame < 4; ++frame) {  // borders move from frame to frame
        const Frame whole = shared->Render(field.scene, field.camera, settings);
        ASSERT_EQ(whole.width, width);
        ASSERT_EQ(whole.height, height);
        ASSERT_EQ(whole.color.size(), one.color.size());
        ASSERT_EQ(whole.depth.size(), one.depth.size());
        ASSERT_EQ(whole.normal.size(), one.normal.size());
        ASSERT_EQ(whole.id.size(), one.id.size());
        EXPECT_LE(PixelsOff(whole, one), one.color.size() / 500);
        EXPECT_EQ(whole.stats.rays, one.stats.rays);
        EXPECT_EQ(whole.stats.metaballs, one.stats.metaballs);
        EXPECT_NEAR(static_cast<double>(whole.stats.hits), static_cast<double>(one.stats.hits), 9);
        EXPECT_EQ(whole.stats.backend, "host-loop");
        EXPECT_GT(whole.stats.seconds_total, 0);
      }
    }
  }
}

TEST(SharedRenderer, PlanesThatNobodyWantsStayEmpty) {
  const PeerScene field = MakeHeightField(500, 40, 32);
  const Frame frame = HostLoops(2)->Render(field.scene, field.camera, {});
  EXPECT_TRUE(frame.depth.empty() && frame.normal.empty() && frame.id.empty());
  EXPECT_TRUE(frame.channels.empty() && frame.uv.empty() && frame.weight.empty());
}

TEST(SharedRenderer, JoinsEveryPlane) {
  PeerScene field = MakeHeightField(800, 50, 40);
  auto cloud = std::make_shared<Cloud>(*field.scene.cloud);
  const std::size_t n = cloud->size();
  for (const auto& [name, components] : {std::pair{"uv", 2}, {"relief", 3}}) {
    Channel channel(name, ChannelType::kFloat32, components, n);
    for (std::size_t i = 0; i < n; ++i) {
      const float value = static_cast<float>(i % 97) / 97.0f;
      channel.Set(i, {{value, 1 - value, 0.5f * value, 0}});
    }
    cloud->channels.push_back(std::move(channel));
  }
  field.scene.cloud = cloud;
  RenderSettings settings;
  Planes& planes = settings.planes;
  planes.depth = planes.normal = planes.id = true;
  planes.weight = planes.intensity = planes.influence = planes.light = true;
  planes.channels = {"relief"};
  planes.uv = {{"uv", false}};
  const Frame one = MakeCpuRenderer()->Render(field.scene, field.camera, settings);
  std::vector<std::unique_ptr<Renderer>> cpus;
  for (int i = 0; i < 3; ++i) cpus.push_back(MakeCpuRenderer());
  const Frame whole =
      MakeSharedRenderer(std::move(cpus))->Render(field.scene, field.camera, settings);
  const std::size_t few = one.color.size() / 200;
  EXPECT_LE(PixelsOff(whole, one), few);
  const auto off = [](const auto& a, const auto& b, const auto& distance) {
    if (a.size() != b.size()) return a.size() + b.size();
    std::size_t count = 0;
    for (std::size_t i = 0; i < a.size(); ++i) count += !(distance(a[i], b[i]) < 1e-2);
    return count;
  };
  const auto apart = [](float a, float b) { return std::abs(a - b) / (1 + std::abs(a)); };
  ASSERT_FALSE(one.weight.empty() || one.intensity.empty() || one.influence.empty());
  EXPECT_LE(off(one.weight, whole.weight, apart), few);
  EXPECT_LE(off(one.intensity, whole.intensity, apart), few);
  EXPECT_LE(off(one.influence, whole.influence,
                [](const Vec3f& a, const Vec3f& b) { return Length(a - b); }),
            few);
  ASSERT_EQ(whole.channels.size(), 1u);
  EXPECT_EQ(whole.channels[0].name, "relief");
  EXPECT_EQ(whole.channels[0].components, 3);
  EXPECT_LE(off(one.channels[0].values, whole.channels[0].values, apart), 3 * few);
  ASSERT_EQ(whole.uv.size(), 1u);
  EXPECT_EQ(whole.uv[0].channel, "uv");
  EXPECT_LE(off(one.uv[0].values, whole.uv[0].values,
                [](const SurfaceUv& a, const SurfaceUv& b) {
                  return std::abs(a.u - b.u) + std::abs(a.v - b.v);
                }),
            few);
}

// The filter of a band must see the rows of its neighbours.
TEST(SharedRenderer, FilteredAppearancesHaveNoSeams) {
  PeerScene field = MakeHeightField(3000, 80, 64);
  Appearance& appearance = field.scene.appearance;
  appearance.lights = {Light{.kind = LightKind::kDirectional, .to_light = {1, 1, 2}}};
  appearance.filter = 7;
  RenderSettings settings;
  settings.planes.depth = true;
  const Frame one = MakeHostLoopRenderer()->Render(field.scene, field.camera, settings);
  const Frame whole = HostLoops(4)->Render(field.scene, field.camera, settings);
  // A rim's pixel that flips is spread over 49: none may be off by more than a few of those.
  std::size_t off = 0;
  for (std::size_t i = 0; i < one.color.size(); ++i) {
    EXPECT_NEAR(one.color[i].g, whole.color[i].g, 0.05) << i / 80 << ", " << i % 80;
    off += std::abs(one.color[i].g - whole.color[i].g) > 1e-3f;
  }
  EXPECT_LE(off, one.color.size() / 50);
  EXPECT_EQ(whole.depth.size(), one.depth.size());
}

// ---- bands --------------------------------------------------------------------------------------

TEST(BandRows, AreWholeStepsNearTheShares) {
  EXPECT_EQ(BandRows(80, {1, 1}), (std::vector<int>{40, 40}));
  EXPECT_EQ(BandRows(80, {3, 1}), (std::vector<int>{64, 16}));
  EXPECT_EQ(BandRows(83, {0.5, 0.5}), (std::vector<int>{48, 35}));
  EXPECT_EQ(BandRows(1, {1, 1}), (std::vector<int>{1, 0}));
  EXPECT_EQ(BandRows(24, {1e-9, 1, 1e-9}), (std::vector<int>{8, 8, 8}));  // one step each
  EXPECT_EQ(BandRows(7, {1}), (std::vector<int>{7}));
  for (int height = 1; height < 200; ++height) {
    for (const std::vector<double>& shares :
         {std::vector<double>{1, 1, 1}, {1, 1000, 1}, {1e-12, 1, 7, 1}, {5, 1}}) {
      const std::vector<int> rows = BandRows(height, shares);
      ASSERT_EQ(rows.size(), shares.size());
      EXPECT_EQ(std::accumulate(rows.begin(), rows.end(), 0), height);
      int below = 0;
      for (std::size_t i = 0; i < rows.size(); ++i) {
        EXPECT_GE(rows[i], 0);
        if (height > 8 * static_cast<int>(shares.size() - 1)) {
          EXPECT_GT(rows[i], 0) << height;
        }
        if (below < height) {
          EXPECT_EQ(below % kBandStep, 0);
        }
        below += rows[i];
      }
    }
  }
}

// A renderer of a given speed that notes what it is given, and fails when it is told to.
struct Worker {
  enum class Failure { kNone, kDevice, kMemory, kCancelled, kOther };
  double rows_per_second = 100;
  std::function<double(double y)> cost;  // of a row at y in [0, 1) of the picture; empty: 1
  std::atomic<Failure> next{Failure::kNone};
  std::vector<std::pair<int, int>> drawn;  // first row and count of each band
  std::vector<int> threads;
  bool destroyed = false;
};

class FakeWorker final : public Renderer {
 public:
  FakeWorker(Worker* worker, int gpu, int height) : worker_(worker), gpu_(gpu), height_(height) {}
  ~FakeWorker() override { worker_->destroyed = true; }

  Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
               const Control& control) override {
    const int y0 = static_cast<int>(std::lround(0.5 * height_ - camera.cy));
    worker_->threads.push_back(settings.threads);
    control.Report("drawing", 0.5);
    switch (worker_->next.load()) {
      case Worker::Failure::kDevice:
        throw DeviceError("the work up to Trace", 719, "unspecified launch failure");
      case Worker::Failure::kMemory:
        throw ResourceError("the GPU's memory is full", 2, 1);
      case Worker::Failure::kOther:
        throw Error("the light must not be negative");
      case Worker::Failure::kCancelled:
        while (!control.stopped()) std::this_thread::yield();
        throw Cancelled();
      case Worker::Failure::kNone:
        break;
    }
    worker_->drawn.emplace_back(y0, camera.height);
    Frame frame;
    frame.width = camera.width;
    frame.height = camera.height;
    for (int y = y0; y < y0 + camera.height; ++y) {  // each row has its number's colour
      frame.color.insert(frame.color.end(), static_cast<std::size_t>(camera.width),
                         {static_cast<float>(y), 0, 0, 1});
      const double cost = worker_->cost ? worker_->cost((y + 0.5) / height_) : 1.0;
      frame.stats.seconds_trace += cost / worker_->rows_per_second;
    }
    frame.stats.metaballs = scene.cloud->size();
    frame.stats.rays = frame.color.size();
    frame.stats.bytes = 1000;
    frame.stats.seconds_prepare = 5;  // a transfer, which must not count
    frame.stats.seconds_total = frame.stats.seconds_trace + frame.stats.seconds_prepare;
    control.Report("drawing", 1);
    return frame;
  }
  std::string backend() const override { return "cuda"; }
  std::string device() const override { return gpu_ == 2 ? "Fake B" : "Fake A"; }
  int gpu() const override { return gpu_; }

 private:
  Worker* worker_;
  int gpu_, height_;
};

class SharedRendererTest : public ::testing::Test {
 protected:
  static constexpr int kHeight = 800;
  using Failure = Worker::Failure;

  Frame Render(const Control& control = {}) {
    Frame frame = shared_->Render(peer_.scene, peer_.camera, {}, control);
    EXPECT_EQ(frame.color.size(), static_cast<std::size_t>(frame.width) * kHeight);
    for (int y = 0; y < kHeight; ++y) {
      EXPECT_EQ(frame.color[static_cast<std::size_t>(y) * frame.width].r, static_cast<float>(y));
    }
    return frame;
  }
  int Last(int worker) const { return workers_[worker].drawn.back().second; }
  double SecondsOf(int worker) const {
    double seconds = 0;
    const auto [y0, rows] = workers_[worker].drawn.back();
    for (int y = y0; y < y0 + rows; ++y) {
      const Worker& w = workers_[worker];
      seconds += (w.cost ? w.cost((y + 0.5) / kHeight) : 1.0) / w.rows_per_second;
    }
    return seconds;
  }

  Worker workers_[3];
  PeerScene peer_ = MakeHeightField(100, 4, kHeight);
  std::unique_ptr<Renderer> shared_ = [this] {
    std::vector<std::unique_ptr<Renderer>> renderers;
    for (int i = 0; i < 3; ++i) {
      renderers.push_back(std::make_unique<FakeWorker>(&workers_[i], i, kHeight));
    }
    return MakeSharedRenderer(std::move(renderers));
  }();
};

TEST_F(SharedRendererTest, TheFirstPictureIsDividedEvenly) {
  const Frame frame = Render();
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(Last(i), kHeight / 3.0, kBandStep);
  EXPECT_EQ(frame.stats.rays, frame.color.size());
  EXPECT_EQ(frame.stats.metaballs, peer_.scene.cloud->size());
  EXPECT_EQ(frame.stats.bytes, 3000u);
  EXPECT_EQ(frame.stats.seconds_prepare, 5);  // all at once
  EXPECT_EQ(frame.stats.backend, "cuda");
  EXPECT_EQ(frame.stats.device, "2 x Fake A and Fake B");
  EXPECT_EQ(shared_->gpu(), 0);
}

TEST_F(SharedRendererTest, FasterOnesGetMoreSoThatAllEndTogether) {
  workers_[0].rows_per_second = 400;
  workers_[2].rows_per_second = 300;
  for (int i = 0; i < 8; ++i) Render();
  EXPECT_NEAR(Last(0), 400, kBandStep);
  EXPECT_NEAR(Last(1), 100, kBandStep);
  EXPECT_NEAR(Last(2), 300, kBandStep);
  // One that grows slow, such as one that others use too, is relieved.
  workers_[0].rows_per_second = 100;
  for (int i = 0; i < 8; ++i) Render();
  EXPECT_NEAR(Last(0), 160, kBandStep);
  EXPECT_NEAR(Last(1), 160, kBandStep);
  EXPECT_NEAR(Last(2), 480, kBandStep);
}

TEST_F(SharedRendererTest, BandsSettleWhereThePicturesCostIsNarrow) {
  workers_[1].rows_per_second = 200;
  for (Worker& worker : workers_) {
    worker.cost = [](double y) { return y > 0.45 && y < 0.6 ? 10.0 : 0.1; };
  }
  for (int i = 0; i < 20; ++i) Render();
  for (int frame = 0; frame < 4; ++frame) {
    Render();
    const auto [least, most] = std::minmax({SecondsOf(0), SecondsOf(1), SecondsOf(2)});
    EXPECT_LT(most, 1.6 * least);  // a step costs a fifth of a band
  }
}

TEST_F(SharedRendererTest, ThreadsOfTheCpuAreDivided) {
  RenderSettings settings;
  settings.threads = 6;
  shared_->Render(peer_.scene, peer_.camera, settings);
  for (const Worker& worker : workers_) EXPECT_EQ(worker.threads, std::vector<int>{2});
}

TEST_F(SharedRendererTest, ProgressOfAllIsOneThatNeverGoesBack) {
  workers_[1].next = Failure::kDevice;
  std::vector<double> shown;
  std::mutex one_at_a_time;
  Control control;
  control.progress = [&](std::string_view, double fraction) {
    ASSERT_TRUE(one_at_a_time.try_lock());
    shown.push_back(fraction);
    one_at_a_time.unlock();
  };
  Render(control);
  EXPECT_TRUE(std::is_sorted(shown.begin(), shown.end()));
  ASSERT_FALSE(shown.empty());
  EXPECT_DOUBLE_EQ(shown.back(), 1);
  EXPECT_GT(shown.front(), 0);
}

// ---- failures -----------------------------------------------------------------------------------

TEST_F(SharedRendererTest, OthersDrawTheBandOfOneThatIsLostAndItIsNotAskedAgain) {
  workers_[1].next = Failure::kDevice;
  const Frame frame = Render();
  EXPECT_EQ(frame.stats.rays, frame.color.size());
  EXPECT_EQ(frame.stats.device,
            "Fake A and Fake B (without GPU 1: the work up to Trace: unspecified launch failure)");
  EXPECT_EQ(workers_[0].drawn.size(), 2u);
  EXPECT_EQ(workers_[2].drawn.size(), 2u);
  EXPECT_TRUE(workers_[1].destroyed);  // its memory is free
  workers_[1].next = Failure::kNone;
  EXPECT_EQ(Render().stats.device, frame.stats.device);
  EXPECT_TRUE(workers_[1].drawn.empty());
  EXPECT_NEAR(Last(0), kHeight / 2.0, kBandStep);
}

TEST_F(SharedRendererTest, OneAloneDrawsAllOfIt) {
  workers_[0].next = workers_[1].next = Failure::kDevice;
  Render();
  EXPECT_EQ(shared_->gpu(), 2);
  Render();
  EXPECT_EQ(Last(2), kHeight);
}

TEST_F(SharedRendererTest, OnlyWhenNoneIsLeftTheErrorGoesOn) {
  for (Worker& worker : workers_) worker.next = Failure::kDevice;
  EXPECT_THROW(Render(), DeviceError);
  for (Worker& worker : workers_) worker.next = Failure::kNone;
  EXPECT_THROW(Render(), DeviceError);  // what is lost stays lost
  EXPECT_EQ(shared_->backend(), "cuda");
  EXPECT_EQ(shared_->gpu(), Renderer::kNoGpu);
}

TEST_F(SharedRendererTest, ACloudThatDoesNotFitInOneIsDrawnByTheOthers) {
  workers_[0].next = Failure::kMemory;
  EXPECT_EQ(Render().stats.device,
            "2 x Fake A and Fake B (without GPU 0: the GPU's memory is full)");
  Render();
  EXPECT_EQ(workers_[0].threads.size(), 1u);  // not asked again for the same cloud
  // It may have room for another cloud, or for the same one with smaller radii.
  workers_[0].next = Failure::kNone;
  Surface& surface = peer_.scene.surface;
  surface.radius_scale = 0.5;
  EXPECT_EQ(Render().stats.device, "2 x Fake A and Fake B");
  EXPECT_EQ(workers_[0].drawn.size(), 1u);
  peer_.scene.cloud = std::make_shared<Cloud>(*peer_.scene.cloud);
  surface.radius_scale = 2;
  Render();
  EXPECT_EQ(workers_[0].drawn.size(), 2u);
}

TEST_F(SharedRendererTest, ACloudThatFitsInNoneIsRefusedOnceAndTriedAgain) {
  for (Worker& worker : workers_) worker.next = Failure::kMemory;
  EXPECT_THROW(Render(), ResourceError);
  EXPECT_THROW(Render(), ResourceError);
  for (Worker& worker : workers_) worker.next = Failure::kNone;
  EXPECT_EQ(Render().stats.device, "2 x Fake A and Fake B");
}

TEST_F(SharedRendererTest, WhereOneIsLostAndOneIsFullTheRestIsRefused) {
  workers_[0].next = workers_[1].next = Failure::kDevice;
  workers_[2].next = Failure::kMemory;
  EXPECT_THROW(Render(), ResourceError);
  workers_[2].next = Failure::kNone;
  Render();
  EXPECT_EQ(Last(2), kHeight);
}

TEST_F(SharedRendererTest, WhatAllWouldRefuseEndsThePictureAtOnce) {
  workers_[0].next = workers_[2].next = Failure::kCancelled;  // would last until stopped
  workers_[1].next = Failure::kOther;
  try {
    Render();
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "the light must not be negative");
  }
  for (Worker& worker : workers_) worker.next = Failure::kNone;
  EXPECT_EQ(Render().stats.device, "2 x Fake A and Fake B");
}

TEST_F(SharedRendererTest, CancellingStopsAllAndLosesNone) {
  for (Worker& worker : workers_) worker.next = Failure::kCancelled;
  std::stop_source source;
  Control control;
  control.stop = source.get_token();
  std::jthread stopper([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    source.request_stop();
  });
  EXPECT_THROW(Render(control), Cancelled);
  for (Worker& worker : workers_) worker.next = Failure::kNone;
  EXPECT_THROW(Render(control), Cancelled);  // stopped before it begins
  EXPECT_EQ(Render().stats.device, "2 x Fake A and Fake B");
}

}  // namespace
}  // namespace sherd
