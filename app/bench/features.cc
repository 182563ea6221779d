#include "app/bench/features.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <utility>

#include "app/bench/measure.h"
#include "app/project/format.h"
#include "datasets_synthetic/peer_scenes.h"
#include "metaball/error.h"

namespace sherd {
namespace {

// Values that differ from metaball to metaball but are the same on every run.
float Varied(std::size_t i) { return static_cast<float>(i * 2654435761u % 1024u) / 1023.0f; }

void AddRadii(Cloud* cloud) {
  cloud->radius.reserve(cloud->size());
  for (std::size_t i = 0; i < cloud->size(); ++i) {
    cloud->radius.push_back(cloud->uniform_radius * (0.9f + 0.2f * Varied(i)));
  }
}
void AddVectors(const char* name, Cloud* cloud) {
  Channel channel(name, ChannelType::kOctahedral, 3, cloud->size());
  for (std::size_t i = 0; i < cloud->size(); ++i) {
    channel.Set(i, {{Varied(i) - 0.5f, 1.0f, Varied(i + 7) - 0.5f, 0.0f}});
  }
  cloud->channels.push_back(std::move(channel));
}
// The plan of the height field: its box from above is the image.
void AddUv(Cloud* cloud) {
  Channel channel("uv", ChannelType::kUnorm16, 2, cloud->size());
  for (std::size_t i = 0; i < cloud->size(); ++i) {
    const Vec3d p = cloud->frame.WorldFromLocal(cloud->center[i]);
    channel.Set(i, {{static_cast<float>(p.x), static_cast<float>(p.z), 0.0f, 0.0f}});
  }
  cloud->channels.push_back(std::move(channel));
}

std::shared_ptr<const ImagePyramid> Chequers() {
  Image image;
  image.width = image.height = 1024;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const bool light = (x / 32 + y / 32) % 2 == 0;
      image.bytes.push_back(light ? Rgb8{220, 210, 190} : Rgb8{120, 60, 40});
    }
  }
  return std::make_shared<ImagePyramid>(std::move(image));
}

// One feature added to the plain scene.
struct Feature {
  std::string name;
  // cloud: the scene's own copy, already the scene's cloud.
  std::function<void(Scene*, Cloud* cloud, RenderSettings*)> add;
};

std::vector<Feature> Features() {
  std::vector<Feature> list;
  list.push_back({"own radii", [](Scene*, Cloud* cloud, RenderSettings*) { AddRadii(cloud); }});
  list.push_back({"own colours", [](Scene*, Cloud* cloud, RenderSettings*) {
                    cloud->color = MakeHeightField(cloud->size(), 8, 8).scene.cloud->color;
                  }});
  list.push_back({"own thresholds, blended", [](Scene* scene, Cloud* cloud, RenderSettings*) {
                    SpreadThresholds(scene->surface.threshold, 0.1, cloud);
                    scene->surface.mode = ThresholdMode::kBlended;
                  }});
  list.push_back({"one channel as a plane", [](Scene*, Cloud* cloud, RenderSettings* settings) {
                    Channel channel("value", ChannelType::kFloat32, 1, cloud->size());
                    for (std::size_t i = 0; i < cloud->size(); ++i) {
                      channel.Set(i, {{Varied(i), 0.0f, 0.0f, 0.0f}});
                    }
                    cloud->channels.push_back(std::move(channel));
                    settings->planes.channels = {"value"};
                  }});
  list.push_back({"texture by uv", [](Scene* scene, Cloud* cloud, RenderSettings*) {
                    AddUv(cloud);
                    scene->appearance.color = ColorSource::kTexture;
                    scene->appearance.texture.image = Chequers();
                    scene->appearance.texture.coordinates = TextureCoordinates::kChannel;
                  }});
  list.push_back({"normals by influence", [](Scene* scene, Cloud*, RenderSettings*) {
                    scene->appearance.normal = NormalSource::kInfluence;
                  }});
  const auto two_lights = [](Scene* scene) {
    Light sun{.kind = LightKind::kDirectional, .to_light = {-0.5, 1, -0.6}};
    Light lamp{.kind = LightKind::kPoint, .position = {0.2, 0.6, 0.3}, .color = {1, 0.8f, 0.6f}};
    scene->appearance.lights = {sun, lamp};
  };
  list.push_back({"two lights", [=](Scene* scene, Cloud*, RenderSettings*) { two_lights(scene); }});
  list.push_back({"shadows of one light", [](Scene* scene, Cloud*, RenderSettings*) {
                    scene->appearance.lights = {
                        {.kind = LightKind::kDirectional, .to_light = {-0.5, 1, -0.6}}};
                    scene->appearance.shadows.enabled = true;
                  }});
  list.push_back({"box filter, 5 pixels",
                  [](Scene* scene, Cloud*, RenderSettings*) { scene->appearance.filter = 5; }});
  return list;
}

Feature AmbientOcclusionFeature() {
  return {"ambient occlusion, 32 directions", [](Scene* scene, Cloud*, RenderSettings*) {
            scene->appearance.occlusion.enabled = true;
          }};
}

// The plain scene: one radius, one colour, one threshold, one light, colour alone.
PeerScene PlainScene(const FeatureOptions& options, int width, int height) {
  PeerScene peer = MakeHeightField(options.metaballs, width, height);
  auto cloud = std::make_shared<Cloud>(*peer.scene.cloud);
  cloud->color = {};
  peer.scene.cloud = cloud;
  return peer;
}

FeatureRow MeasureOne(const Feature& feature, const PeerScene& plain, Renderer* renderer,
                      const FeatureOptions& options, const Control& control) {
  FeatureRow row;
  row.feature = feature.name;
  row.backend = renderer->backend();
  row.width = plain.camera.width;
  row.height = plain.camera.height;
  RenderSettings plain_settings;
  plain_settings.threads = options.threads;
  try {
    Scene scene = plain.scene;
    RenderSettings settings = plain_settings;
    auto cloud = std::make_shared<Cloud>(*scene.cloud);
    scene.cloud = cloud;
    feature.add(&scene, cloud.get(), &settings);
    const auto time_plain = [&] {
      return TimeFrame(renderer, plain.scene, plain.camera, plain_settings, options.repeat, control)
          .wall;
    };
    // Before and after: what else the machine does changes while the features are gone through.
    const double before = time_plain();
    row.seconds = TimeFrame(renderer, scene, plain.camera, settings, options.repeat, control).wall;
    row.plain_seconds = (before + time_plain()) / 2;
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    row.error = error.what();
  }
  return row;
}

}  // namespace

std::vector<BytesRow> MeasureBytes(const FeatureOptions& options, const Control& control) {
  std::vector<BytesRow> rows;
  const PeerScene plain = PlainScene(options, options.width, options.height);
  const auto n = static_cast<double>(plain.scene.cloud->size());
  const auto bytes_of = [&](const std::function<void(Cloud*)>& add) {
    Cloud cloud = *plain.scene.cloud;
    cloud.center.shrink_to_fit();
    add(&cloud);
    return static_cast<double>(cloud.MemoryBytes()) / n;
  };
  const auto colors = [](Cloud* cloud) { cloud->color.assign(cloud->size(), Rgb8{}); };
  const auto thresholds = [](Cloud* cloud) { SpreadThresholds(0.7, 0.1, cloud); };
  const auto normals = [](Cloud* cloud) { AddVectors("normal", cloud); };
  const auto map = [](Cloud* cloud) { AddVectors("normal_map", cloud); };
  const double centre = bytes_of([](Cloud*) {});
  rows.push_back({"centre", centre});
  const auto extra = [&](const char* what, const std::function<void(Cloud*)>& add) {
    rows.push_back({std::string("+ ") + what, bytes_of(add) - centre});
  };
  extra("radius", AddRadii);
  extra("colour, sRGB", colors);
  extra("threshold", thresholds);
  extra("normal, octahedral", normals);
  extra("normal map, octahedral", map);
  extra("texture coordinates, 2 x 16 bits", AddUv);
  rows.push_back({"all of these", bytes_of([&](Cloud* cloud) {
                    AddRadii(cloud);
                    colors(cloud);
                    thresholds(cloud);
                    normals(cloud);
                    map(cloud);
                    AddUv(cloud);
                  })});
  rows.push_back(
      {"centre, radius, threshold, normal, texture coordinates", bytes_of([&](Cloud* cloud) {
         AddRadii(cloud);
         thresholds(cloud);
         normals(cloud);
         AddUv(cloud);
       })});
  rows.push_back({"the same in the thesis (table 4.1)", kThesisBytesPerMetaball});
  RenderSettings settings;
  settings.threads = options.threads;
  const auto renderer = MakeCpuRenderer();
  const Frame frame = renderer->Render(plain.scene, plain.camera, settings, control);
  rows.push_back(
      {"working memory of the CPU renderer", static_cast<double>(frame.stats.bytes) / n});
  return rows;
}

std::vector<FeatureRow> MeasureFeatures(const FeatureOptions& options, const Control& control) {
  std::vector<std::unique_ptr<Renderer>> renderers;
  renderers.push_back(MakeCpuRenderer());
  if (auto gpu = MakeGpuRenderer(options.gpu)) renderers.push_back(std::move(gpu));
  const std::vector<Feature> features = Features();
  const PeerScene plain = PlainScene(options, options.width, options.height);
  // Ambient occlusion casts dozens of rays a pixel: a quarter of each side says as much.
  const PeerScene small =
      PlainScene(options, std::max(1, options.width / 4), std::max(1, options.height / 4));
  std::vector<FeatureRow> rows;
  for (const auto& renderer : renderers) {
    for (const Feature& feature : features) {
      control.Report(feature.name, static_cast<double>(rows.size() % features.size()) /
                                       static_cast<double>(features.size()));
      rows.push_back(MeasureOne(feature, plain, renderer.get(), options, control));
    }
    rows.push_back(MeasureOne(AmbientOcclusionFeature(), small, renderer.get(), options, control));
  }
  return rows;
}

FigureTable FiguresOf(const std::vector<BytesRow>& rows) {
  FigureTable table{{"what", "bytes_per_metaball"}, {}};
  for (const BytesRow& row : rows) table.rows.push_back({row.what, row.bytes});
  return table;
}

FigureTable FiguresOf(const std::vector<FeatureRow>& rows) {
  FigureTable table{
      {"feature", "backend", "error", "width", "height", "seconds", "plain_seconds", "ratio"}, {}};
  for (const FeatureRow& row : rows) {
    const auto drawn = [&](double v) { return row.error.empty() ? Figure{v} : Figure{}; };
    table.rows.push_back({row.feature, row.backend, row.error, static_cast<double>(row.width),
                          static_cast<double>(row.height), drawn(row.seconds),
                          drawn(row.plain_seconds), drawn(row.ratio())});
  }
  return table;
}

std::vector<std::vector<std::string>> ScreenTable(const std::vector<BytesRow>& rows) {
  std::vector<std::vector<std::string>> table = {{"what", "bytes a metaball"}};
  for (const BytesRow& row : rows) table.push_back({row.what, FormatNumber(row.bytes, 3)});
  return table;
}

std::vector<std::vector<std::string>> ScreenTable(const std::vector<FeatureRow>& rows) {
  std::vector<std::vector<std::string>> table = {
      {"feature", "backend", "size", "frame", "plain frame", "ratio"}};
  for (const FeatureRow& row : rows) {
    const std::string size = std::to_string(row.width) + "x" + std::to_string(row.height);
    if (!row.error.empty()) {
      table.push_back({row.feature, row.backend, size, "refused: " + row.error, "-", "-"});
      continue;
    }
    table.push_back({row.feature, row.backend, size, FormatSeconds(row.seconds),
                     FormatSeconds(row.plain_seconds), FormatNumber(row.ratio(), 3)});
  }
  return table;
}

}  // namespace sherd
