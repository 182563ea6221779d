// Which GPUs a choice comes to on a machine: on invented machines, and on this one.
#include "cuda/device_choice.h"

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "cuda/device_query.h"
#include "cuda/renderers.h"
#include "datasets_synthetic/peer_scenes.h"
#include "metaball/error.h"
#include "metaball/lod_renderer.h"

namespace sherd {
namespace {

class FakeGpu final : public Renderer {
 public:
  FakeGpu(const CudaDevice& device, const bool* fails) : device_(device), fails_(fails) {}

  Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
               const Control& control) override {
    if (*fails_) throw DeviceError("the work up to Trace", 719, "unspecified launch failure");
    Frame frame = MakeCpuRenderer()->Render(scene, camera, settings, control);
    frame.stats.backend = backend();
    frame.stats.device = device();
    return frame;
  }
  std::string backend() const override { return "cuda"; }
  std::string device() const override { return device_.Describe(); }
  int gpu() const override { return device_.idx; }

 private:
  CudaDevice device_;
  const bool* fails_;
};

// A machine with GPUs that do as they are told.
class DeviceChoiceTest : public ::testing::Test {
 protected:
  void SetGpus(int count) {
    gpus_ = {};
    gpus_.driver_version = gpus_.toolkit_version = 13000;
    for (int idx = 0; idx < count; ++idx) {
      gpus_.devices.push_back(
          {idx, std::string("Fake ") + static_cast<char>('A' + idx), 9, 0, 8ull << 30, ""});
    }
    if (count == 0) gpus_.reason = "no NVIDIA GPU in this machine";
  }
  std::unique_ptr<Renderer> Choose(const char* choice) {
    asked_.clear();
    return ChooseRenderer(
        ParseDeviceChoice(choice), gpus_,
        [this](const CudaDevice& device) -> std::unique_ptr<Renderer> {
          asked_.push_back(device.idx);
          if (refuses_.count(device.idx) > 0) throw Error(refuses_.at(device.idx));
          return std::make_unique<FakeGpu>(device, &fails_[device.idx]);
        },
        &why_);
  }
  std::string ErrorOf(const char* choice) {
    try {
      Choose(choice);
    } catch (const DeviceError& error) {
      return error.what();
    }
    return "";
  }

  GpuList gpus_;
  std::map<int, std::string> refuses_;
  std::map<int, bool> fails_;
  std::vector<int> asked_;  // to start, in this order
  std::string why_;
};

TEST(ParseDeviceChoice, ReadsWhatTextWrites) {
  const std::map<std::string, DeviceChoice> known = {
      {"auto", {Backend::kAuto}},        {"cpu", {Backend::kCpu}},
      {"cuda", {Backend::kCuda}},        {"cuda:0", {Backend::kCuda, 0}},
      {"cuda:12", {Backend::kCuda, 12}}, {"cuda:all", {Backend::kCuda, DeviceChoice::kAll}}};
  for (const auto& [text, choice] : known) {
    EXPECT_EQ(ParseDeviceChoice(text), choice) << text;
    EXPECT_EQ(choice.Text(), text);
  }
  for (const char* bad : {"", "gpu", "CUDA", "auto ", "cuda:", "cuda:-1", "cuda:-2", "cuda:1x",
                          "cuda: 1", "cuda:0.5", "cuda:99999999999", "cuda:ALL", "cpu:0"}) {
    EXPECT_THROW(ParseDeviceChoice(bad), InputError) << bad;
  }
}

TEST_F(DeviceChoiceTest, AutomaticTakesTheFirstThatCanBeUsedAndAsksNoOther) {
  SetGpus(3);
  EXPECT_EQ(Choose("auto")->gpu(), 0);
  EXPECT_EQ(asked_, std::vector<int>{0});
  EXPECT_EQ(why_, "GPU 0 (Fake A, 9.0, 8 GB)");
  gpus_.devices[0].why_not = "its architecture 6.1 is older than 7.5";
  refuses_[1] = "this build has no code for its architecture 9.0";
  EXPECT_EQ(Choose("auto")->gpu(), 2);
  EXPECT_EQ(asked_, (std::vector<int>{1, 2}));  // what is known to be of no use is left in peace
  EXPECT_EQ(
      why_,
      "GPU 2 (Fake C, 9.0, 8 GB); not used: GPU 0 (Fake A): its architecture 6.1 is older than "
      "7.5; GPU 1 (Fake B): this build has no code for its architecture 9.0");
  EXPECT_EQ(Choose("cuda")->gpu(), 2);
}

TEST_F(DeviceChoiceTest, AutomaticGoesToTheCpuWithTheReasonOfEachGpu) {
  SetGpus(2);
  refuses_ = {{0, "it cannot be used: busy"}, {1, "it cannot be used: full"}};
  const auto renderer = Choose("auto");
  EXPECT_EQ(renderer->backend(), "cpu");
  EXPECT_EQ(renderer->gpu(), Renderer::kNoGpu);
  EXPECT_NE(why_.find("GPU 0 (Fake A): it cannot be used: busy; GPU 1 (Fake B): it cannot be used: "
                      "full"),
            std::string::npos)
      << why_;
  EXPECT_EQ(ErrorOf("cuda"),
            "CUDA: no GPU can be used: GPU 0 (Fake A): it cannot be used: busy; GPU 1 (Fake B): it "
            "cannot be used: full; auto and cpu draw without one");
}

TEST_F(DeviceChoiceTest, ANumberIsThatGpuAndNoOther) {
  SetGpus(3);
  const auto renderer = Choose("cuda:1");
  EXPECT_EQ(renderer->gpu(), 1);
  EXPECT_EQ(asked_, std::vector<int>{1});
  EXPECT_EQ(why_, "GPU 1 (Fake B, 9.0, 8 GB), as asked for");
  refuses_[1] = "it cannot be used: busy";
  EXPECT_EQ(ErrorOf("cuda:1"),
            "CUDA: no GPU can be used: GPU 1 (Fake B): it cannot be used: busy; auto and cpu draw "
            "without one");
}

TEST_F(DeviceChoiceTest, ANumberThatDoesNotExistIsToldThoseThatDo) {
  SetGpus(2);
  EXPECT_EQ(ErrorOf("cuda:2"),
            "CUDA: there is no GPU 2: this machine has GPU 0 (Fake A) and GPU 1 (Fake B)");
  gpus_.devices[1].name.clear();
  gpus_.devices[1].why_not = "it does not answer: unknown error";
  EXPECT_EQ(ErrorOf("cuda:7"),
            "CUDA: there is no GPU 7: this machine has GPU 0 (Fake A) and GPU 1");
  SetGpus(0);
  EXPECT_EQ(ErrorOf("cuda:0"), "CUDA: there is no GPU 0: no NVIDIA GPU in this machine");
  EXPECT_TRUE(asked_.empty());
}

TEST_F(DeviceChoiceTest, AllAreThoseThatCanBeUsed) {
  SetGpus(3);
  refuses_[1] = "it cannot be used: busy";
  const auto renderer = Choose("cuda:all");
  EXPECT_EQ(asked_, (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(renderer->gpu(), 0);
  EXPECT_EQ(renderer->device(), "Fake A, 9.0, 8 GB and Fake C, 9.0, 8 GB");
  EXPECT_EQ(
      why_,
      "GPU 0, 2 (Fake A, 9.0, 8 GB and Fake C, 9.0, 8 GB), as asked for; not used: GPU 1 (Fake "
      "B): it cannot be used: busy");
  // One is enough.
  refuses_[0] = "it cannot be used: busy";
  EXPECT_EQ(Choose("cuda:all")->device(), "Fake C, 9.0, 8 GB");
  refuses_[2] = "it cannot be used: busy";
  EXPECT_NE(ErrorOf("cuda:all"), "");
  SetGpus(0);
  EXPECT_EQ(ErrorOf("cuda:all"),
            "CUDA: no GPU can be used: no NVIDIA GPU in this machine; auto and cpu draw without "
            "one");
}

TEST_F(DeviceChoiceTest, TheCpuAsksNoGpu) {
  SetGpus(2);
  EXPECT_EQ(Choose("cpu")->backend(), "cpu");
  EXPECT_TRUE(asked_.empty());
  EXPECT_NE(why_.find(", as asked for"), std::string::npos) << why_;
}

// A GPU that is lost in the middle: the frame ends on the CPU, the next begins on what is left.
TEST_F(DeviceChoiceTest, AfterALostGpuTheChoiceIsMadeAnew) {
  SetGpus(2);
  const PeerScene field = MakeHeightField(500, 40, 32);
  const auto renderer = Choose("auto");
  fails_[0] = true;
  refuses_[0] = "it cannot be used: lost";
  EXPECT_EQ(renderer->Render(field.scene, field.camera, {}).stats.backend, "cpu");
  EXPECT_EQ(renderer->gpu(), Renderer::kNoGpu);
  EXPECT_EQ(renderer->Render(field.scene, field.camera, {}).stats.device, "Fake B, 9.0, 8 GB");
  EXPECT_EQ(renderer->gpu(), 1);
}

TEST_F(DeviceChoiceTest, OfAllALostOneCostsNoPicture) {
  SetGpus(2);
  const PeerScene field = MakeHeightField(500, 40, 32);
  const auto renderer = Choose("cuda:all");
  fails_[1] = true;
  EXPECT_EQ(renderer->Render(field.scene, field.camera, {}).stats.device,
            "Fake A, 9.0, 8 GB (without GPU 1: the work up to Trace: unspecified launch failure)");
  fails_[0] = true;
  EXPECT_EQ(renderer->Render(field.scene, field.camera, {}).stats.backend, "cpu");
}

// What works beside a renderer must find its GPU through whatever is around it.
TEST_F(DeviceChoiceTest, RenderersAroundARendererNameItsGpu) {
  SetGpus(2);
  EXPECT_EQ(MakeLodRenderer(Choose("cuda:1"))->gpu(), 1);
  EXPECT_EQ(MakeLodRenderer(Choose("cpu"))->gpu(), Renderer::kNoGpu);
}

TEST(GpuList, SpeaksForPeople) {
  EXPECT_EQ(CudaVersionText(13000), "13.0");
  EXPECT_EQ(CudaVersionText(12020), "12.2");
  EXPECT_EQ(CudaVersionText(0), "none");
  EXPECT_EQ(LabelsOf({}), "");
  EXPECT_EQ(LabelsOf({{0, "A"}, {1, "B"}, {2, ""}}), "GPU 0 (A), GPU 1 (B) and GPU 2");
}

// ---- this machine -------------------------------------------------------------------------------

TEST(MakeRenderer, AutomaticChoiceSaysWhatAndWhyInOneLine) {
  std::string why;
  const auto renderer = MakeRenderer({}, &why);
  const CudaStatus status = QueryCuda();
  EXPECT_EQ(renderer->backend(), status.available ? "cuda" : "cpu");
  EXPECT_EQ(renderer->gpu() != Renderer::kNoGpu, status.available);
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
  EXPECT_EQ(MakeRenderer({Backend::kCpu}, &why)->backend(), "cpu");
  EXPECT_FALSE(why.empty());
  EXPECT_EQ(MakeRenderer({Backend::kCpu})->backend(), "cpu");
}

TEST(MakeRenderer, DemandingAGpuThatIsNotThereIsAnErrorWithTheReason) {
  EXPECT_THROW(MakeRenderer({Backend::kCuda, 1000}), DeviceError);
  const CudaStatus status = QueryCuda();
  if (status.available) {
    EXPECT_EQ(MakeRenderer({Backend::kCuda})->backend(), "cuda");
    return;
  }
  try {
    MakeRenderer({Backend::kCuda});
    FAIL();
  } catch (const DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find(status.reason), std::string::npos) << error.what();
  }
  EXPECT_THROW(FirstUsableGpu(), DeviceError);
}

TEST(ListGpus, HasAReasonOrGpus) {
  const GpuList gpus = ListGpus();
  EXPECT_EQ(gpus.reason.empty(), !gpus.devices.empty());
  for (std::size_t i = 0; i < gpus.devices.size(); ++i) {
    EXPECT_EQ(gpus.devices[i].idx, static_cast<int>(i));
  }
#ifdef SHERD_HAVE_CUDA
  EXPECT_GT(gpus.toolkit_version, 12000);
#else
  EXPECT_EQ(gpus.toolkit_version, 0);
#endif
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

TEST(ExplainUnusable, NamesTheCauseOfEachGpu) {
  constexpr int kInvalidFunction = 98, kNoImage = 209, kUnsupportedPtx = 222, kUnavailable = 46;
  const CudaDevice gpu{0, "A", 9, 0, 0, ""}, old{1, "B", 6, 1, 0, ""}, oldest{2, "C", 7, 5, 0, ""};
  EXPECT_EQ(ExplainUnusable(gpu, 0), "");
  EXPECT_EQ(ExplainUnusable(oldest, 0), "");
  EXPECT_EQ(ExplainUnusable(old, 0), "its architecture 6.1 is older than 7.5");
  EXPECT_EQ(ExplainUnusable(old, kNoImage), "its architecture 6.1 is older than 7.5");
  for (const int code : {kInvalidFunction, kNoImage, kUnsupportedPtx}) {
    EXPECT_EQ(ExplainUnusable(gpu, code), "this build has no code for its architecture 9.0");
  }
  EXPECT_TRUE(ExplainUnusable(gpu, kUnavailable).starts_with("it cannot be used: "));
}
#endif

}  // namespace
}  // namespace sherd
