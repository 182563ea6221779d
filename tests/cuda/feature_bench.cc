#include "feature_bench.h"

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <utility>
#include <vector>

#include "appearance_scenes.h"
#include "frame_times.h"
#include "metaball/appearance/projection.h"
#include "metaball/lod_renderer.h"

namespace sherd {
namespace {

struct Feature {
  std::string name;
  PeerScene peer;
  RenderSettings settings = {};
  bool level_of_detail = false;
  std::string beside = "plain";  // whose frame its own is divided by
};

class Features {
 public:
  Features(std::uint64_t count, const PictureSize& size)
      : plain_(Sized(MakeHeightField(count), size)) {}

  std::vector<Feature> Make() {
    Add("plain");
    Metaballs();
    Looks();
    Add("supersample_2").settings.supersample = 2;
    FromAfar();
    return std::move(features_);
  }

 private:
  Feature& Add(const std::string& name) {
    features_.push_back({name, plain_});
    return features_.back();
  }
  Appearance& AddLook(const std::string& name) { return Add(name).peer.scene.appearance; }
  std::shared_ptr<Cloud> CopyOfCloud() const {
    return std::make_shared<Cloud>(*plain_.scene.cloud);
  }

  void Metaballs() {
    const auto radii = CopyOfCloud();
    const std::size_t n = radii->size();
    for (std::size_t i = 0; i < n; ++i) {
      const double phase = static_cast<double>(i) * 0.618;
      radii->radius.push_back(radii->uniform_radius *
                              static_cast<float>(0.9 + 0.2 * (phase - std::floor(phase))));
    }
    Add("own_radii").peer.scene.cloud = radii;

    const auto thresholds = CopyOfCloud();
    SpreadThresholds(plain_.scene.surface.threshold, 0.3, thresholds.get());
    Scene& blended = Add("blended_thresholds").peer.scene;
    blended.cloud = thresholds;
    blended.surface.mode = ThresholdMode::kBlended;

    const auto colored = CopyOfCloud();
    Channel height("height", ChannelType::kFloat32, 1, n);
    for (std::size_t i = 0; i < n; ++i) height.Set(i, {{colored->center[i].y}});
    colored->channels = {height};
    Scene& channel = Add("channel_through_a_colour_map").peer.scene;
    channel.cloud = colored;
    channel.appearance.color = ColorSource::kQuantity;
    channel.appearance.pseudo.quantity = Quantity::kChannel;
    channel.appearance.pseudo.channel = "height";
  }

  void Looks() {
    Appearance& texture = AddLook("texture");
    texture.color = ColorSource::kTexture;
    texture.texture.image = MakeRampImage(ImageEncoding::kSrgb8);
    texture.texture.projection =
        FitProjection(*plain_.scene.cloud, ProjectionKind::kPlanar, {0, -1, 0}, {0, 0, 1});
    Appearance& shadows = AddLook("shadows_of_one_light");
    shadows.lights = {Light{.kind = LightKind::kDirectional, .to_light = {-0.5, 1, -0.6}}};
    shadows.shadows.enabled = true;
    AddLook("ambient_occlusion_of_32_directions").occlusion = {.enabled = true, .directions = 32};
    AddLook("filter_5").filter = 5;
  }

  void FromAfar() {
    constexpr double kTimesAsFar = 20;
    PeerScene far = plain_;
    const Vec3d middle{0.5, 0, 0.5};
    far.camera.eye = middle + (plain_.camera.eye - middle) * kTimesAsFar;
    features_.push_back({"plain_from_afar", far});
    features_.push_back({"level_of_detail", far, {}, true, "plain_from_afar"});
  }

  PeerScene plain_;
  std::vector<Feature> features_;
};

FrameTimes TimeFeature(const BenchBackend& backend, const Feature& feature,
                       const BenchOptions& options) {
  auto renderer = backend.MakeRenderer();
  ProfilingRenderer* const profile = renderer.get();
  std::unique_ptr<Renderer> draws = std::move(renderer);
  if (feature.level_of_detail) draws = MakeLodRenderer(std::move(draws));
  return TimeFrames(feature.peer, feature.settings, options, draws.get(), profile);
}

}  // namespace

void MeasureFeatures(const BenchBackend& backend, std::uint64_t count, const BenchOptions& options,
                     const MeasureOne& measure, JsonWriter* json) {
  std::vector<std::pair<std::string, double>> measured;
  for (const Feature& feature : Features(count, options.sizes.front()).Make()) {
    measure(feature.name, [&] {
      const FrameTimes times = TimeFeature(backend, feature, options);
      measured.emplace_back(feature.name, times.frame);
      double over = NAN;
      for (const auto& [name, frame] : measured) {
        if (name == feature.beside) over = times.frame / frame;
      }
      const RenderStats& stats = times.stats;
      std::printf("feature      %-36s %5.2f x  ", feature.name.c_str(), over);
      PrintTimes(times);
      json->BeginObject()
          .Field("name", feature.name)
          .Field("metaballs", stats.metaballs)
          .Field("width", feature.peer.camera.width)
          .Field("height", feature.peer.camera.height)
          .Field("frames", options.frames)
          .Field("frame_over_that_of", feature.beside)
          .Field("frame_over_it", over)
          .Field("hits", stats.hits)
          .Field("unresolved", stats.unresolved);
      if (feature.level_of_detail) {
        json->Field("metaballs_drawn",
                    stats.lod_metaballs > 0 ? stats.lod_metaballs : stats.metaballs)
            .Field("error_bound_px", stats.lod_error_px);
      }
      WriteTimes(times, json);
      json->EndObject();
    });
  }
}

}  // namespace sherd
