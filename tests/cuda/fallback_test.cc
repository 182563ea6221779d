// What happens when a GPU fails in the middle.
#include "cuda/fallback.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "datasets_synthetic/peer_scenes.h"
#include "metaball/error.h"

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

}  // namespace
}  // namespace sherd
