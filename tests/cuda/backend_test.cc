// One source for every backend of this machine: each scene against the double-precision reference.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "cuda/cuda_renderer.h"
#include "cuda/host_loop.h"
#include "cuda/renderers.h"
#include "datasets_synthetic/stiff_cases.h"
#include "metaball/error.h"
#include "metaball/frame_difference.h"
#include "scenes.h"

namespace sherd {
namespace {

const std::vector<CheckScene>& Scenes() {
  static const std::vector<CheckScene> scenes = MakeCheckScenes(4000, 96, 64);
  return scenes;
}

std::vector<std::string> SceneNames() {
  std::vector<std::string> names;
  for (const CheckScene& scene : Scenes()) names.push_back(scene.name);
  return names;
}

// Those of this machine.
std::vector<std::string> Backends() {
  std::vector<std::string> names{"host-loop"};
  if (QueryCuda().available) names.push_back("cuda");
  return names;
}

std::unique_ptr<Renderer> RendererNamed(const std::string& name) {
  return name == "cuda" ? std::unique_ptr<Renderer>(MakeCudaRenderer(FirstUsableGpu()))
                        : MakeHostLoopRenderer();
}

// By name, so that a scene's reference is computed once for all backends.
const ReferenceFrame& ReferenceOf(const CheckScene& scene) {
  static std::vector<std::pair<std::string, ReferenceFrame>> known;
  for (const auto& [name, frame] : known) {
    if (name == scene.name) return frame;
  }
  known.emplace_back(scene.name, ReferenceRender(scene.scene, scene.camera));
  return known.back().second;
}

class BackendTest : public ::testing::TestWithParam<std::tuple<std::string, std::string>> {
 protected:
  void SetUp() override { renderer_ = RendererNamed(std::get<0>(GetParam())); }
  static const CheckScene& Named(const std::string& name) {
    for (const CheckScene& scene : Scenes()) {
      if (scene.name == name) return scene;
    }
    throw Error("no scene " + name);
  }
  std::unique_ptr<Renderer> renderer_;
};

TEST_P(BackendTest, AgreesWithTheReference) {
  const CheckScene& scene = Named(std::get<1>(GetParam()));
  RenderSettings settings;
  settings.planes = {true, true, true};
  settings.supersample = scene.supersample;
  const Frame frame = renderer_->Render(scene.scene, scene.camera, settings);
  EXPECT_EQ(frame.stats.metaballs, scene.scene.cloud->size());
  for (const Vec3f& n : frame.normal) ASSERT_TRUE(IsFinite(n));
  for (const Pixel& p : frame.color) {
    ASSERT_TRUE(p.r >= 0 && p.g >= 0 && p.b >= 0 && p.a >= 0);
    ASSERT_TRUE(p.r <= 1 && p.g <= 1 && p.b <= 1 && p.a <= 1.00001f);
  }
  EXPECT_EQ(frame.stats.unresolved, 0u);
  if (scene.supersample > 1) {
    // The CPU renderer does the same sampling, and agrees with the reference ray by ray.
    const Frame cpu = MakeCpuRenderer()->Render(scene.scene, scene.camera, settings);
    for (std::size_t i = 0; i < cpu.color.size(); ++i) {
      ASSERT_NEAR(frame.color[i].r, cpu.color[i].r, 1e-4);
      ASSERT_NEAR(frame.color[i].a, cpu.color[i].a, 1e-6);
      ASSERT_NEAR(frame.depth[i], cpu.depth[i], 1e-5);
    }
    return;
  }
  const ReferenceFrame& reference = ReferenceOf(scene);
  const FrameDifference d = CompareToReference(frame, reference, scene.scene.cloud->frame.unit);
  EXPECT_EQ(WhyOff(scene, frame, d), "") << d.Describe();
  std::uint64_t hits = 0, wrong_id = 0;
  for (std::size_t i = 0; i < frame.id.size(); ++i) {
    const bool hit = frame.color[i].a > 0;
    hits += hit;
    ASSERT_EQ(hit, frame.depth[i] > 0);
    ASSERT_EQ(hit, frame.id[i] >= 0);
    // Where two metaballs are equally strong either may be named.
    wrong_id += hit && frame.id[i] != reference.pixels[i].id;
  }
  EXPECT_EQ(frame.stats.hits, hits);
  bool ambiguous = scene.creased || scene.jumps;
  for (const char* part : {"one_place", "one_cell", "bridge", "cancelling"}) {
    ambiguous = ambiguous || scene.name.find(part) != std::string::npos;
  }
  if (!ambiguous) {
    EXPECT_LE(wrong_id, 2 + hits / 1000);
  }
}

// The rest of the table: what must come out is not the reference's picture but nothing, a count or
// a refusal.
TEST(StiffCases, ComeOutAsTheyMustWhereThereIsNoReference) {
  for (const StiffCase& stiff : MakeStiffCases()) {
    if (stiff.expect == StiffCase::Expect::kReference) continue;
    for (const std::string& name : Backends()) {
      const StiffOutcome outcome = RunStiffCase(stiff, RendererNamed(name).get());
      EXPECT_TRUE(outcome.passed) << name << ", " << stiff.name << ": " << outcome.what
                                  << "\nexpected: " << stiff.expects;
    }
  }
}

TEST(CudaDevice, IsAmongTheBackendsWhereThereIsOne) {
  const CudaStatus status = QueryCuda();
  if (!status.available) GTEST_SKIP() << "the scenes run on the host loop alone: " << status.reason;
  EXPECT_EQ(Backends().back(), "cuda");
}

INSTANTIATE_TEST_SUITE_P(Scenes, BackendTest,
                         ::testing::Combine(::testing::ValuesIn(Backends()),
                                            ::testing::ValuesIn(SceneNames())),
                         [](const auto& param_info) {
                           std::string name =
                               std::get<0>(param_info.param) + "_" + std::get<1>(param_info.param);
                           for (char& c : name) {
                             if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
                           }
                           return name;
                         });

}  // namespace
}  // namespace sherd
