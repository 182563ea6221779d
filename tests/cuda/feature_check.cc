#include "feature_check.h"

#include <cmath>
#include <cstdio>
#include <exception>

#include "backends.h"

namespace sherd {

RenderSettings SettingsOf(const FeatureScene& feature, int supersample) {
  RenderSettings settings;
  settings.planes = feature.planes;
  settings.supersample = supersample;
  return settings;
}

FeatureCheck JudgeFeature(const FeatureScene& feature, int supersample, const Frame& cpu,
                          const std::function<Frame()>& draw) {
  FeatureCheck check;
  check.name = feature.name;
  check.supersample = supersample;
  try {
    const Frame frame = draw();
    check.seconds = frame.stats.seconds_total;
    const PictureDifference d = ComparePictures(cpu, frame, {.depth = feature.depth_tolerance});
    check.difference = d;
    check.allowed =
        static_cast<std::uint64_t>(std::ceil(feature.colors_off * static_cast<double>(d.pixels)));
    check.planes_allowed = 1 + d.drawn / 500;
    check.ids_allowed = 2 + d.drawn / 1000;
    if (!d.shape.empty()) {
      check.error = "the picture has another set of " + d.shape;
    } else if (d.drawn == 0) {
      check.error = "nothing is to be seen";
    } else if (frame.stats.unresolved != 0) {
      check.error = "rays were given up";
    } else if (d.color_off > check.allowed) {
      check.error = "colours are off";
    } else if (d.elsewhere + d.planes_off > check.planes_allowed) {
      check.error = "planes are off";
    } else if (d.ids_off > check.ids_allowed) {
      check.error = "metaballs' ids are off";
    }
  } catch (const std::exception& error) {
    check.error = error.what();
  }
  check.passed = check.error.empty();
  return check;
}

std::vector<FeatureCheck> CheckFeature(const FeatureScene& feature,
                                       const std::vector<std::string>& backends) {
  std::vector<FeatureCheck> checks;
  for (const int supersample : {1, 2}) {
    const RenderSettings settings = SettingsOf(feature, supersample);
    const Frame cpu = MakeCpuRenderer()->Render(feature.scene, feature.camera, settings);
    for (const std::string& backend : backends) {
      checks.push_back(JudgeFeature(feature, supersample, cpu, [&] {
        return MakeBackend(backend)->Render(feature.scene, feature.camera, settings);
      }));
      checks.back().backend = backend;
    }
  }
  return checks;
}

void Print(const FeatureCheck& check) {
  const PictureDifference& d = check.difference;
  const std::uint64_t planes_off = d.elsewhere + d.planes_off;
  const std::string name = check.name + (check.supersample > 1 ? ", 2 x 2 samples" : "");
  std::printf("%-4s feature: %-56s %-9s ", check.passed ? "ok" : "FAIL", name.c_str(),
              check.backend.c_str());
  if (!check.error.empty()) std::printf("%s: ", check.error.c_str());
  std::printf(
      "of %llu off %llu (%llu allowed), planes %llu, ids %llu, %.1f ms\n",
      static_cast<unsigned long long>(d.pixels), static_cast<unsigned long long>(d.color_off),
      static_cast<unsigned long long>(check.allowed), static_cast<unsigned long long>(planes_off),
      static_cast<unsigned long long>(d.ids_off), check.seconds * 1e3);
  std::fflush(stdout);
}

void Write(const FeatureCheck& check, JsonWriter* json) {
  const PictureDifference& d = check.difference;
  json->BeginObject()
      .Field("name", check.name)
      .Field("backend", check.backend)
      .Field("supersample", check.supersample)
      .Field("passed", check.passed);
  if (!check.error.empty()) json->Field("error", check.error);
  json->Field("pixels", d.pixels)
      .Field("pixels_drawn_by_the_cpu", d.drawn)
      .Field("pixels_off", d.color_off)
      .Field("allowed", check.allowed)
      .Field("planes_off", d.elsewhere + d.planes_off)
      .Field("planes_allowed", check.planes_allowed)
      .Field("ids_off", d.ids_off)
      .Field("ids_allowed", check.ids_allowed)
      .Field("seconds", check.seconds)
      .EndObject();
}

}  // namespace sherd
