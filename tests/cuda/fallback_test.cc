// The choice of a backend, and what happens when a GPU fails in the middle.
#include "cuda/fallback.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "cuda/cuda_renderer.h"
#include "cuda/renderers.h"
#include "datasets_synthetic/peer_scenes.h"
#include "metaball/error.h"
#ifdef SHERD_HAVE_CUDA
#include "cuda/device_query.h"
#endif

namespace sherd {
namespace {

// A GPU that fails on the frames it is told to.
class FailingRenderer final : public Renderer {
 public:
  enum class Failure { kNone, kDevice, kMemory, kCancelled };
  explicit FailingRenderer(const Failure* next) : next_(next), cpu_(MakeCpuRenderer()) {}

  Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
               const Control& control) override {
    switch (*next_) {
      case Failure::kDevice:
        throw DeviceError("the work up to Trace", 719, "unspecified launch failure");
      case Failure::kMemory:
        throw ResourceError("the GPU's memory is full", 2, 1);
      case Failure::kCancelled:
        throw Cancelled();
      case Failure::kNone:
        break;
    }
    Frame frame = cpu_->Render(scene, camera, settings, control);
    frame.stats.backend = backend();
    frame.stats.device = device();
    return frame;
  }
  std::string backend() const override { return "cuda"; }
  std::string device() const override { return "a GPU"; }

 private:
  const Failure* next_;
  std::unique_ptr<Renderer> cpu_;
};

class FallbackTest : public ::testing::Test {
 protected:
  using Failure = FailingRenderer::Failure;

  Frame Render() { return renderer_->Render(peer_.scene, peer_.camera, {}); }

  Failure next_ = Failure::kNone;
  int made_ = 0;
  bool can_restart_ = true;
  PeerScene peer_ = MakeHeightField(1000, 60, 40);
  std::unique_ptr<Renderer> renderer_ = MakeFallbackRenderer(
      std::make_unique<FailingRenderer>(&next_),
      [this]() -> std::unique_ptr<Renderer> {
        ++made_;
        if (!can_restart_) throw DeviceError("cudaStreamCreate", 46, "device is unavailable");
        return std::make_unique<FailingRenderer>(&next_);
      },
      [] { return MakeCpuRenderer(); });
};

TEST_F(FallbackTest, AFrameThatGoesWellIsTheFirstOnes) {
  const Frame frame = Render();
  EXPECT_EQ(frame.stats.backend, "cuda");
  EXPECT_EQ(frame.stats.device, "a GPU");
  EXPECT_EQ(renderer_->backend(), "cuda");
}

TEST_F(FallbackTest, AFailedFrameIsFinishedOnTheCpuAndSaysSo) {
  const Frame good = Render();
  next_ = Failure::kDevice;
  const Frame frame = Render();
  EXPECT_EQ(frame.stats.backend, "cpu");
  EXPECT_NE(frame.stats.device.find("after the GPU failed: the work up to Trace: unspecified"),
            std::string::npos)
      << frame.stats.device;
  EXPECT_EQ(frame.stats.hits, good.stats.hits);
  EXPECT_EQ(renderer_->backend(), "cpu");
  // The GPU is tried again, made anew.
  next_ = Failure::kNone;
  EXPECT_EQ(Render().stats.backend, "cuda");
  EXPECT_EQ(made_, 1);
}

TEST_F(FallbackTest, AGpuThatKeepsFailingIsLeftAlone) {
  next_ = Failure::kDevice;
  for (int i = 0; i < 5; ++i) EXPECT_EQ(Render().stats.backend, "cpu");
  EXPECT_EQ(made_, 1);
  EXPECT_NE(renderer_->device().find("after the GPU failed"), std::string::npos);
}

TEST_F(FallbackTest, AGpuThatIsGoneIsNotAskedForTwice) {
  next_ = Failure::kDevice;
  Render();
  can_restart_ = false;
  for (int i = 0; i < 3; ++i) {
    const Frame frame = Render();
    EXPECT_EQ(frame.stats.backend, "cpu");
    EXPECT_NE(frame.stats.device.find("device is unavailable"), std::string::npos);
  }
  EXPECT_EQ(made_, 1);
}

TEST_F(FallbackTest, FullMemoryCostsOneFrameNotTheGpu) {
  next_ = Failure::kMemory;
  EXPECT_EQ(Render().stats.backend, "cpu");
  next_ = Failure::kNone;
  EXPECT_EQ(Render().stats.backend, "cuda");
  EXPECT_EQ(made_, 0);
}

TEST_F(FallbackTest, CancellingIsNoFailure) {
  next_ = Failure::kCancelled;
  EXPECT_THROW(Render(), Cancelled);
  EXPECT_EQ(renderer_->backend(), "cuda");
}

TEST(ParseBackend, KnowsItsThreeNames) {
  EXPECT_EQ(ParseBackend("auto"), Backend::kAuto);
  EXPECT_EQ(ParseBackend("cpu"), Backend::kCpu);
  EXPECT_EQ(ParseBackend("cuda"), Backend::kCuda);
  for (const char* name : {"", "gpu", "CUDA", "auto "}) {
    EXPECT_THROW(ParseBackend(name), InputError) << name;
  }
}

TEST(MakeRenderer, AutomaticChoiceSaysWhatAndWhyInOneLine) {
  std::string why;
  const auto renderer = MakeRenderer(Backend::kAuto, &why);
  const CudaStatus status = QueryCuda();
  EXPECT_EQ(renderer->backend(), status.available ? "cuda" : "cpu");
  EXPECT_EQ(why.find('\n'), std::string::npos);
  EXPECT_NE(why.find(renderer->device()), std::string::npos) << why;
  if (!status.available) {
    EXPECT_FALSE(status.reason.empty());
    EXPECT_TRUE(status.device.empty());
    EXPECT_NE(why.find(status.reason), std::string::npos) << why;
  }
#ifndef SHERD_HAVE_CUDA
  EXPECT_EQ(status.reason, "built without CUDA");
#endif
  const PeerScene field = MakeHeightField(500, 40, 30);
  EXPECT_GT(renderer->Render(field.scene, field.camera, {}).stats.hits, 0u);
}

TEST(MakeRenderer, TheCpuIsAlwaysThere) {
  std::string why;
  EXPECT_EQ(MakeRenderer(Backend::kCpu, &why)->backend(), "cpu");
  EXPECT_FALSE(why.empty());
  EXPECT_EQ(MakeRenderer(Backend::kCpu)->backend(), "cpu");
}

TEST(MakeRenderer, DemandingAGpuThatIsNotThereIsAnErrorWithTheReason) {
  const CudaStatus status = QueryCuda();
  if (status.available) {
    EXPECT_EQ(MakeRenderer(Backend::kCuda)->backend(), "cuda");
    return;
  }
  try {
    MakeRenderer(Backend::kCuda);
    FAIL();
  } catch (const DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find(status.reason), std::string::npos) << error.what();
  }
  EXPECT_THROW(MakeCudaRenderer(), DeviceError);
}

#ifdef SHERD_HAVE_CUDA
TEST(ExplainNoDevices, NamesTheCause) {
  constexpr int kNoDevice = 100, kInsufficientDriver = 35, kUnknown = 999;
  EXPECT_EQ(ExplainNoDevices(0, 1, 13000), "");
  EXPECT_EQ(ExplainNoDevices(kInsufficientDriver, 0, 0), "no NVIDIA driver");
  const std::string old = ExplainNoDevices(kInsufficientDriver, 0, 12020);
  EXPECT_NE(old.find("too old: it supports CUDA 12.2"), std::string::npos) << old;
  EXPECT_EQ(ExplainNoDevices(kNoDevice, 0, 13000), "no NVIDIA GPU in this machine");
  EXPECT_EQ(ExplainNoDevices(0, 0, 13000), "no NVIDIA GPU in this machine");
  EXPECT_NE(ExplainNoDevices(kUnknown, 0, 13000).find("does not answer"), std::string::npos);
}
#endif

}  // namespace
}  // namespace sherd
