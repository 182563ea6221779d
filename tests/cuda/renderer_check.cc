#include "renderer_check.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <numbers>
#include <utility>

#include "backends.h"
#include "cuda/cuda_renderer.h"
#include "cuda/device_query.h"
#include "cuda/host_loop.h"
#include "cuda/shared_renderer.h"
#include "datasets_synthetic/peer_scenes.h"
#include "datasets_synthetic/random.h"
#include "metaball/lod_renderer.h"
#include "metaball/moving.h"

namespace sherd {
namespace {

bool Holds(const std::string& name, const CheckFilter& filter) {
  return name.find(filter) != std::string::npos;
}

void Fail(const std::string& why, FeatureCheck* check) {
  if (!check->passed) return;  // the first fault is the one to look at
  check->passed = false;
  check->error = why;
}

// ---- clouds that move -----------------------------------------------------------------------

// A wavy sheet under a lump of metaballs, both of which change.
class MovingScene {
 public:
  explicit MovingScene(bool lit) : input_(MakeInput()), moving_(input_) {
    feature_.camera = Camera::LookAt({0.5, 1.4, -2.4}, {0, 0, 0}, {0, 1, 0}, 0.8, 84, 60);
    feature_.scene.cloud = moving_.cloud();
    feature_.scene.surface.mode = ThresholdMode::kBlended;
    feature_.colors_off = 0.004;
    if (!lit) {
      feature_.planes.depth = feature_.planes.normal = feature_.planes.id = true;
      feature_.planes.channels = {"height"};
      return;
    }
    Appearance& appearance = feature_.scene.appearance;
    appearance.color = ColorSource::kQuantity;
    appearance.pseudo.quantity = Quantity::kChannel;
    appearance.pseudo.channel = "height";
    appearance.pseudo.range = ColorRange{0, 2};
    appearance.lights = {Light{.kind = LightKind::kDirectional, .to_light = {0.6, 1, -0.3}}};
    appearance.shadows.enabled = true;
    appearance.occlusion = {.enabled = true, .directions = 8};
    feature_.colors_off = 0.03;
  }

  FeatureScene& feature() { return feature_; }

  void MoveAll() {
    for (Vec3d& p : input_.center) p.x += 0.15 * std::sin(4 * p.z);
    moving_.SetPositions(input_.center);
  }
  void MoveTheLump() {
    const auto first = input_.center.begin() + kSheet;
    std::for_each(first, input_.center.end(), [](Vec3d& p) { p = p + Vec3d{-0.3, 0.15, 0.1}; });
    moving_.SetPositions({first, input_.center.end()}, kSheet);
  }
  // So far that the cloud takes another frame for its floats; seen from a little higher, so that
  // the picture is another one.
  void MoveOutOfTheFrame() {
    for (Vec3d& p : input_.center) p = p + Vec3d{40, 10, 0};
    moving_.SetPositions(input_.center);
    feature_.camera.eye = feature_.camera.eye + Vec3d{40, 10.2, 0};
  }
  void SetOneRadius() { moving_.SetUniformRadius(0.1); }
  void SetRadii() {
    std::vector<double> radii;
    for (const Vec3d& p : input_.center) radii.push_back(0.11 + 0.05 * std::cos(7 * p.z));
    moving_.SetRadii(radii);
  }
  void SetThresholds() {
    std::vector<double> thresholds;
    for (const Vec3d& p : input_.center) thresholds.push_back(0.8 + 0.5 * std::sin(9 * p.z));
    moving_.SetThresholds(thresholds);
  }
  void SetColors() {
    std::vector<Rgb8> colors;
    for (std::size_t i = 0; i < input_.center.size(); ++i) {
      colors.push_back({30, static_cast<std::uint8_t>(i % 200), 220});
    }
    moving_.SetColors(colors);
  }
  void SetChannel() { moving_.SetChannel(Height(input_, 1.5)); }

 private:
  static constexpr int kSide = 40, kSheet = kSide * kSide;

  // Values within 0.4 of the offset, in waves.
  static Channel Height(const CloudInput& input, double offset) {
    Channel height("height", ChannelType::kFloat32, 1, input.center.size());
    for (std::size_t i = 0; i < input.center.size(); ++i) {
      height.Set(i, {{static_cast<float>(offset + 0.4 * std::sin(5 * input.center[i].z))}});
    }
    return height;
  }
  static CloudInput MakeInput() {
    synthetic::Rng random(11);
    CloudInput input;
    for (int i = 0; i < kSide; ++i) {
      for (int k = 0; k < kSide; ++k) {
        const double x = -1 + 2.0 * i / kSide, z = -1 + 2.0 * k / kSide;
        input.center.push_back({x, 0.08 * std::sin(6 * x) * std::cos(5 * z), z});
      }
    }
    for (int i = 0; i < 300; ++i) {
      const Vec3d d{random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1)};
      input.center.push_back(Vec3d{0.2, 0.5, 0} + Normalized(d, {0, 1, 0}) * 0.2);
    }
    for (std::size_t i = 0; i < input.center.size(); ++i) {
      input.radius.push_back(random.Uniform(0.12, 0.18));
      input.threshold.push_back(random.Uniform(0.5, 0.8));
      input.color.push_back({static_cast<std::uint8_t>(random.Index(256)), 150, 60});
    }
    input.channels = {Height(input, 0.3)};
    return input;
  }

  CloudInput input_;
  MovingCloud moving_;
  FeatureScene feature_;
};

std::vector<FeatureCheck> CheckMovingCloud(const std::string& backend, bool lit,
                                           const CheckFilter& filter) {
  using Change = void (MovingScene::*)();
  std::vector<std::pair<std::string, Change>> changes{
      {"as_it_was", nullptr},
      {"positions", &MovingScene::MoveAll},
      {"some_positions", &MovingScene::MoveTheLump},
      {"one_radius", &MovingScene::SetOneRadius},
      {"radii", &MovingScene::SetRadii},
      {"thresholds", &MovingScene::SetThresholds},
      {"channel", &MovingScene::SetChannel},
      {"another_frame", &MovingScene::MoveOutOfTheFrame}};
  if (!lit) changes.emplace_back("colours", &MovingScene::SetColors);
  const std::string prefix = lit ? "moving_lit_cloud_" : "moving_cloud_";
  const bool wanted = std::any_of(changes.begin(), changes.end(), [&](const auto& change) {
    return Holds(prefix + change.first, filter);
  });
  std::vector<FeatureCheck> checks;
  if (!wanted) return checks;

  MovingScene moving(lit);
  FeatureScene& feature = moving.feature();
  const RenderSettings settings = SettingsOf(feature, 1);
  const auto renderer = MakeBackend(backend);
  Frame before;
  for (const auto& [name, change] : changes) {
    feature.name = prefix + name;
    if (change) (moving.*change)();
    const Frame cpu = MakeCpuRenderer()->Render(feature.scene, feature.camera, settings);
    FeatureCheck check = JudgeFeature(
        feature, 1, cpu, [&] { return renderer->Render(feature.scene, feature.camera, settings); });
    check.backend = backend;
    if (change) {
      const PictureDifference shown = ComparePictures(before, cpu);
      if (shown.color_off + shown.elsewhere + shown.planes_off < shown.pixels / 20) {
        Fail("the change is not to be seen", &check);
      }
    }
    before = cpu;
    if (Holds(check.name, filter)) checks.push_back(std::move(check));
  }
  return checks;
}

// ---- several renderers ----------------------------------------------------------------------

std::vector<std::unique_ptr<Renderer>> RenderersToShare(const std::string& backend) {
  constexpr std::size_t kAtLeast = 3;
  std::vector<std::unique_ptr<Renderer>> renderers;
  if (backend == "cuda") {
    for (const CudaDevice& device : ListGpus().devices) {
      if (WhyUnusable(device).empty()) renderers.push_back(MakeCudaRenderer(device));
    }
  }
  while (renderers.size() < kAtLeast) renderers.push_back(MakeBackend(backend));
  return renderers;
}

// ---- levels of detail -----------------------------------------------------------------------

// From so far above that a pixel holds many metaballs.
FeatureScene FarHeightField(int width, int height) {
  PeerScene peer = MakeHeightField(40'000, width, height);
  auto cloud = std::make_shared<Cloud>(*peer.scene.cloud);
  Channel across("across", ChannelType::kFloat32, 1, cloud->size());
  for (std::size_t i = 0; i < cloud->size(); ++i) across.Set(i, {{cloud->center[i].x}});
  cloud->channels = {across};
  FeatureScene feature{.name = "level_of_detail",
                       .scene = peer.scene,
                       .camera = Camera::LookAt({0.5, 20, 0.5}, {0.5, 0, 0.5}, {0, 0, 1},
                                                6 * std::numbers::pi / 180, width, height),
                       .planes = {}};
  feature.scene.cloud = cloud;
  feature.planes.depth = feature.planes.normal = feature.planes.id = true;
  feature.planes.channels = {"across"};
  return feature;
}

}  // namespace

std::vector<FeatureCheck> CheckMovingClouds(const std::string& backend, const CheckFilter& filter) {
  std::vector<FeatureCheck> checks = CheckMovingCloud(backend, false, filter);
  for (FeatureCheck& check : CheckMovingCloud(backend, true, filter)) {
    checks.push_back(std::move(check));
  }
  return checks;
}

std::vector<FeatureCheck> CheckParts(const std::vector<FeatureScene>& features,
                                     const std::string& backend, const CheckFilter& filter) {
  std::vector<FeatureCheck> checks;
  if (backend != "host-loop") return checks;
  for (FeatureScene feature : features) {
    feature.name = "in_parts_" + feature.name;
    if (!Holds(feature.name, filter)) continue;
    const RenderSettings settings = SettingsOf(feature, 2);
    const Frame cpu = MakeCpuRenderer()->Render(feature.scene, feature.camera, settings);
    const std::uint64_t whole =
        MakeHostLoopRenderer()->Render(feature.scene, feature.camera, settings).stats.bytes;
    HostLoopOptions options;
    options.memory_bytes = feature.scene.cloud->MemoryBytes() + whole * 6 / 10;
    std::uint64_t bytes = 0;
    checks.push_back(JudgeFeature(feature, 2, cpu, [&] {
      Frame frame = MakeHostLoopRenderer(options)->Render(feature.scene, feature.camera, settings);
      bytes = frame.stats.bytes;
      return frame;
    }));
    checks.back().backend = backend;
    if (bytes > whole * 3 / 4) Fail("the picture was drawn at once", &checks.back());
  }
  return checks;
}

std::vector<FeatureCheck> CheckSharing(const std::vector<FeatureScene>& features,
                                       const std::string& backend, const CheckFilter& filter) {
  std::vector<FeatureCheck> checks;
  std::unique_ptr<Renderer> shared;
  for (FeatureScene feature : features) {
    feature.name = "shared_" + feature.name;
    if (!Holds(feature.name, filter)) continue;
    const RenderSettings settings = SettingsOf(feature, 1);
    const Frame cpu = MakeCpuRenderer()->Render(feature.scene, feature.camera, settings);
    checks.push_back(JudgeFeature(feature, 1, cpu, [&] {
      if (!shared) shared = MakeSharedRenderer(RenderersToShare(backend));
      shared->Recycle(shared->Render(feature.scene, feature.camera, settings));
      return shared->Render(feature.scene, feature.camera, settings);
    }));
    checks.back().backend = backend;
  }
  return checks;
}

std::vector<FeatureCheck> CheckLevelsOfDetail(const std::string& backend,
                                              const CheckFilter& filter) {
  std::vector<FeatureCheck> checks;
  FeatureScene feature = FarHeightField(84, 60);
  constexpr double kErrorPx = 2;
  const auto cpu_lod = MakeLodRenderer(MakeCpuRenderer(), kErrorPx);
  std::unique_ptr<Renderer> lod;
  const auto check_it = [&](const std::string& name, bool coarser) {
    feature.name = "level_of_detail_" + name;
    if (!Holds(feature.name, filter)) return;
    const RenderSettings settings = SettingsOf(feature, 2);
    const Frame cpu = cpu_lod->Render(feature.scene, feature.camera, settings);
    RenderStats stats;
    checks.push_back(JudgeFeature(feature, 2, cpu, [&] {
      if (!lod) lod = MakeLodRenderer(MakeBackend(backend), kErrorPx);
      Frame frame = lod->Render(feature.scene, feature.camera, settings);
      stats = frame.stats;
      return frame;
    }));
    checks.back().backend = backend;
    if ((stats.lod_metaballs > 0) != coarser) {
      Fail(coarser ? "all metaballs were drawn" : "a level was drawn", &checks.back());
    } else if (stats.lod_metaballs != cpu.stats.lod_metaballs) {
      Fail("another level than the CPU's was drawn", &checks.back());
    }
  };
  check_it("from_afar", true);
  feature.scene.surface.radius_scale = 1.5;
  check_it("of_larger_radii", true);
  // What looks at the single metaballs is drawn from all of them.
  feature.scene.appearance.lights = {
      Light{.kind = LightKind::kDirectional, .to_light = {0.4, 1, 0}}};
  feature.scene.appearance.shadows.enabled = true;
  feature.colors_off = 0.03;
  check_it("not_for_shadows", false);
  return checks;
}

}  // namespace sherd
