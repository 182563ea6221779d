// Fidelity: photographs are left out, their views are rendered and compared with them.
//
//   sherd_fidelity_benchmark WORKSPACE [--hold-out NAME,... | --every N] [--sources all|originals]
//       [--levels 63k,126k,252k,full] [--colors blend,metaballs,photo] [--side 1024] [--json F]
//       [--pictures D]
//
// What is compared, and where, is described in docs/fidelity.md.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "app/project/picture.h"
#include "metaball/error.h"
#include "metaball/parallel.h"
#include "metaball/renderer.h"
#include "reconstruction/level.h"
#include "reconstruction/photo_colors.h"
#include "reconstruction/photo_pyramid.h"
#include "reconstruction/photo_view.h"
#include "reconstruction/photographs.h"
#include "reconstruction/workspace.h"
#include "tests/benchmarks/benchmark_main.h"
#include "tests/benchmarks/picture_metrics.h"

namespace sherd::benchmarks {
namespace {

using Json = nlohmann::ordered_json;

// The mask loses what is thinner than twice this, and then a rim, pixels at a side of 1024.
constexpr int kThin = 8, kRim = 4;

struct Options {
  std::string workspace, sources = "all", json, pictures;
  std::vector<std::string> hold_out, levels = {"63k", "126k", "252k", "full"},
                                     colors = {"blend", "metaballs", "photo"};
  std::uint32_t every = 5;
  int side = 1024, memory_mb = 1024;
  std::optional<double> dense_offset;
  bool keep_noise = false, keep_holes = false;
};

struct HeldOut {
  std::uint32_t photo = 0;
  Camera camera;
  Picture reference;
  std::vector<char> mask;
};

// The photograph as the camera would have taken it: every pixel the mean of 4 x 4 places of it,
// looked up in the file (distortion included).
Picture Undistorted(const Survey& plain, std::uint32_t photo, const Camera& camera) {
  const PhotoView view(plain, photo);
  const PhotoPyramid pyramid = ReadPhotoPyramid(view.path(), 0);
  // Samples a quarter of a pixel apart; coarser levels where that is more than a file's pixel.
  const double file_pixels = static_cast<double>(view.width()) / camera.width;
  const auto level = static_cast<float>(std::max(0.0, std::log2(file_pixels / 4)));
  Picture out{camera.width, camera.height, {}};
  out.pixels.resize(static_cast<std::size_t>(camera.width) * camera.height);
  ParallelFor(camera.height, 0, [&](std::int64_t y, int) {
    for (int x = 0; x < camera.width; ++x) {
      Vec3f sum{};
      for (int s = 0; s < 16; ++s) {
        const RayD ray =
            RayThrough(camera, x + (s % 4 + 0.5) / 4, static_cast<double>(y) + (s / 4 + 0.5) / 4);
        double u = 0, v = 0;
        view.Project(ray.origin + ray.direction, &u, &v);
        sum += pyramid.Sample(static_cast<float>(u), static_cast<float>(v), level);
      }
      sum = sum * (1.0f / 16);
      out.pixels[static_cast<std::size_t>(y) * camera.width + x] = {
          SrgbFromLinear(sum.x), SrgbFromLinear(sum.y), SrgbFromLinear(sum.z)};
    }
  });
  return out;
}

Picture Encoded(const Frame& frame) {
  Picture out{frame.width, frame.height, {}};
  for (const Pixel& p : frame.color) {
    out.pixels.push_back({SrgbFromLinear(p.r), SrgbFromLinear(p.g), SrgbFromLinear(p.b)});
  }
  return out;
}

Frame ToFrame(const Picture& picture) {
  Frame frame;
  frame.width = picture.width;
  frame.height = picture.height;
  for (const Vec3f& c : picture.pixels) {
    frame.color.push_back({LinearFromSrgb(c.x), LinearFromSrgb(c.y), LinearFromSrgb(c.z), 1});
  }
  return frame;
}

Frame RenderLevel(const Level& level, const Camera& camera) {
  Scene scene;
  scene.cloud = std::shared_ptr<const Cloud>(&level.cloud, [](const Cloud*) {});
  scene.surface.threshold = level.stats.threshold;
  scene.lighting.unlit = true;
  RenderSettings settings;
  settings.planes.depth = settings.planes.normal = settings.planes.id = true;
  return MakeCpuRenderer()->Render(scene, camera, settings);
}

// The photographs that are left out.
std::vector<std::uint32_t> Chosen(const Survey& survey, const Options& options) {
  std::vector<std::uint32_t> out;
  std::uint32_t with_original = 0;
  for (std::uint32_t i = 0; i < survey.photographs.size(); ++i) {
    const Photograph& photo = survey.photographs[i];
    if (!options.hold_out.empty()) {
      for (const std::string& name : options.hold_out) {
        if (photo.name.ends_with(name)) out.push_back(i);
      }
    } else if (!photo.original_path.empty() || !survey.dense) {
      if (with_original++ % options.every == options.every / 2) out.push_back(i);
    }
  }
  if (out.empty()) throw Error("no photograph is left out: give --hold-out or --every");
  return out;
}

int Run(int argc, char** argv) {
  Options options;
  CLI::App app("Left-out photographs against renders of their views");
  app.add_option("workspace", options.workspace, "COLMAP workspace with a dense cloud")->required();
  app.add_option("--hold-out", options.hold_out, "names (or their ends) of what is left out")
      ->delimiter(',');
  app.add_option("--every", options.every, "without --hold-out: every n-th that has an original");
  app.add_option("--sources", options.sources,
                 "what colours come from: all other photographs, or only those with an original")
      ->check(CLI::IsMember({"all", "originals"}));
  app.add_option("--levels", options.levels, "densities; full: every point")->delimiter(',');
  app.add_option(
         "--colors", options.colors,
         "blend: the points' colours; metaballs: each one's from the photographs; photo: the "
         "photographs looked up at every pixel")
      ->delimiter(',')
      ->check(CLI::IsMember({"blend", "metaballs", "photo"}));
  app.add_option("--side", options.side, "pixels of the longer side of each view");
  app.add_option("--memory", options.memory_mb, "MiB for photographs");
  app.add_option("--dense-offset", options.dense_offset,
                 "instead of the survey's offset of dense points, pixels");
  app.add_flag("--keep-noise", options.keep_noise, "points as they were surveyed");
  app.add_flag("--keep-holes", options.keep_holes, "holes of the survey are not closed");
  app.add_option("--json", options.json, "write the figures here");
  app.add_option("--pictures", options.pictures, "folder for the compared pictures");
  CLI11_PARSE(app, argc, argv);

  Survey survey = LoadSurvey(InspectWorkspace(options.workspace), {});
  if (options.dense_offset) survey.dense_pixel_offset = *options.dense_offset;
  LevelOptions full;
  full.smooth_noise = !options.keep_noise;
  full.close_holes = false;
  full.radius_factor = 1.8;  // so that what is compared does not follow the levels' default
  PreparedPoints points = PrepareForLevels(std::move(survey.points), survey, full);
  full.target_count = points.points.size();
  const Level reference_level = BuildLevel(points, survey, full);
  if (!options.keep_holes) CloseHoles(survey, &points);

  Survey plain;  // a photograph shows itself where its camera says, whatever the points' offset
  plain.cameras = survey.cameras;
  plain.photographs = survey.photographs;
  std::vector<HeldOut> held_out;
  for (const std::uint32_t photo : Chosen(survey, options)) {
    const Camera own = CameraOfPhotograph(survey, photo);
    const double scale = static_cast<double>(options.side) / std::max(own.width, own.height);
    HeldOut view;
    view.photo = photo;
    view.camera = own.Resized(static_cast<int>(std::lround(own.width * scale)),
                              static_cast<int>(std::lround(own.height * scale)));
    view.reference = Undistorted(
        plain, photo,
        CameraOfPhotograph(plain, photo).Resized(view.camera.width, view.camera.height));
    const Frame frame = RenderLevel(reference_level, view.camera);
    view.mask.resize(frame.depth.size());
    for (std::size_t i = 0; i < view.mask.size(); ++i) view.mask[i] = frame.depth[i] > 0;
    // Without thin parts (noise along outlines) and without the rim.
    view.mask = Dilated(Eroded(view.mask, frame.width, frame.height, kThin + kRim), frame.width,
                        frame.height, kThin);
    held_out.push_back(std::move(view));
  }
  PhotoShadingOptions shading;
  shading.memory_mb = options.memory_mb;
  for (std::uint32_t i = 0; i < survey.photographs.size(); ++i) {
    const bool held = std::any_of(held_out.begin(), held_out.end(),
                                  [&](const HeldOut& view) { return view.photo == i; });
    if (held || (options.sources == "originals" && survey.photographs[i].original_path.empty())) {
      shading.leave_out.push_back(i);
    }
  }
  std::printf("%zu views; colours from %zu photographs; offset of dense points %g px\n",
              held_out.size(), survey.photographs.size() - shading.leave_out.size(),
              survey.dense_pixel_offset);

  Json rows = Json::array();
  for (const std::string& name : options.levels) {
    LevelOptions level_options;
    level_options.target_count = name == "full" ? points.points.size() : ParseCount(name);
    Level level = BuildLevel(points, survey, level_options);
    const std::vector<Rgb8> point_colors = level.cloud.color;
    PhotographShader shader(survey, shading);
    for (const std::string& color : options.colors) {
      double psnr = 0, ssim = 0, covered = 0, seen = 0, seconds = 0;
      std::array<double, 3> high_pass{};
      Json views = Json::array();
      level.cloud.color = point_colors;
      if (color == "metaballs") {
        PhotoColorOptions own;
        own.memory_mb = options.memory_mb;
        own.leave_out = shading.leave_out;
        ColorFromPhotographs(survey, own, &level);
      }
      for (const HeldOut& view : held_out) {
        Frame frame = RenderLevel(level, view.camera);
        PhotoShadingStats stats;
        if (color == "photo") {
          Surface surface;
          surface.threshold = level.stats.threshold;
          stats = shader.Shade(level, surface, view.camera, &frame);
        }
        std::vector<char> mask = view.mask;
        std::uint64_t inside = 0, hit = 0;
        for (std::size_t i = 0; i < mask.size(); ++i) {
          inside += mask[i] != 0;
          mask[i] = mask[i] && frame.color[i].a > 0;
          hit += mask[i] != 0;
        }
        const PictureScore score = Compare(Encoded(frame), view.reference, mask);
        const double n = static_cast<double>(held_out.size());
        const double share = static_cast<double>(hit) / static_cast<double>(inside);
        psnr += score.psnr_db / n;
        ssim += score.ssim / n;
        covered += share / n;
        seconds += stats.seconds / n;
        seen += static_cast<double>(stats.from_photos) /
                static_cast<double>(std::max<std::uint64_t>(1, stats.pixels)) / n;
        for (std::size_t s = 0; s < high_pass.size(); ++s) high_pass[s] += score.high_pass[s] / n;
        const std::string& photo = survey.photographs[view.photo].name;
        views.push_back({{"photograph", photo},
                         {"psnr_db", score.psnr_db},
                         {"ssim", score.ssim},
                         {"covered", share},
                         {"gain", score.gain},
                         {"high_pass", score.high_pass}});
        if (!options.pictures.empty()) {
          const std::string stem =
              options.pictures + "/" + std::filesystem::path(photo).stem().string();
          for (std::size_t i = 0; i < mask.size(); ++i) {
            frame.color[i].a = 1;
          }
          WritePicture(stem + "_" + name + "_" + color + ".png", frame, {});
          WritePicture(stem + "_photograph.png", ToFrame(view.reference), {});
        }
      }
      std::printf("%-5s %-9s %8zu metaballs  %.2f dB  SSIM %.3f  covered %.4f  high-pass",
                  name.c_str(), color.c_str(), level.cloud.size(), psnr, ssim, covered);
      for (const double h : high_pass) std::printf(" %.3f", h);
      std::printf("  from photographs %.4f  %.2f s\n", seen, seconds);
      std::fflush(stdout);
      rows.push_back({{"level", name},
                      {"metaballs", level.cloud.size()},
                      {"color", color},
                      {"psnr_db", psnr},
                      {"ssim", ssim},
                      {"covered", covered},
                      {"high_pass", high_pass},
                      {"from_photographs", seen},
                      {"seconds", seconds},
                      {"views", std::move(views)}});
    }
  }
  if (!options.json.empty()) {
    const Json json = {{"workspace", std::filesystem::path(options.workspace).filename().string()},
                       {"sources", options.sources},
                       {"source_photographs", survey.photographs.size() - shading.leave_out.size()},
                       {"side", options.side},
                       {"dense_pixel_offset", survey.dense_pixel_offset},
                       {"high_pass_sigma", kHighPassSigma},
                       {"rows", std::move(rows)}};
    WriteJson(options.json, json);
  }
  return 0;
}

}  // namespace
}  // namespace sherd::benchmarks

int main(int argc, char** argv) {
  return sherd::benchmarks::RunMain("sherd_fidelity_benchmark", sherd::benchmarks::Run, argc, argv);
}
