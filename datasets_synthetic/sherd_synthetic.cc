// sherd-synthetic: writes the synthetic excavation as a COLMAP workspace.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <stop_token>
#include <string>
#include <thread>

#include "datasets_synthetic/excavation.h"
#include "metaball/error.h"

namespace {

volatile std::sig_atomic_t g_interrupted = 0;

// "1600x1200".
void ParseSize(const std::string& text, int* width, int* height) {
  char rest = 0;
  if (std::sscanf(text.c_str(), "%6dx%6d%c", width, height, &rest) != 2) {
    throw sherd::InputError("--size", "", "\"" + text + "\" is not a size",
                            "write WIDTHxHEIGHT, for example 1600x1200");
  }
}

// One line on a terminal, kept up to date; silent in a pipe.
class ProgressLine {
 public:
  void Show(std::string_view what, double fraction) {
    using Clock = std::chrono::steady_clock;
    const auto now = Clock::now();
    if (fraction < 1 && what == what_ && now - shown_ < std::chrono::milliseconds(100)) return;
    shown_ = now;
    what_ = what;
    const double seconds = std::chrono::duration<double>(now - start_).count();
    std::fprintf(stderr, "\r\033[K%3.0f %%  %s", 100 * fraction, what_.c_str());
    if (fraction > 0.05 && fraction < 1) {
      std::fprintf(stderr, ", about %.0f s left", seconds * (1 - fraction) / fraction);
    }
    std::fflush(stderr);
    open_ = true;
  }
  void End() {
    if (open_) std::fprintf(stderr, "\r\033[K");
    open_ = false;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now(), shown_{};
  std::string what_;
  bool open_ = false;
};

constexpr char kExamples[] = R"(Examples:
  sherd-synthetic --out excavation
      24 photographs of 1600x1200 and a dense cloud of 600 000 points
  sherd-synthetic --out big --size 6000x4000 --dense-points 5000000
      24 megapixels each, as a full-frame camera takes them
  sherd-synthetic --out clean --no-distortion --noise 0 --outliers 0
      PINHOLE cameras, points exactly on the surface
  sherd-synthetic --out small --photos 9 --size 640x480 --no-dense
      photographs and sparse model alone
)";

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Writes a synthetic excavation, a trench of 4 m x 3 m whose truth is known, as a complete "
      "COLMAP workspace: images/, sparse/0, sparse_txt/0, dense/ and truth/."};
  app.footer(kExamples);
  sherd::ExcavationOptions o;
  std::string out, size = "1600x1200";
  bool no_distortion = false, no_dense = false;
  app.add_option("--out", out, "Folder to write (a synthetic excavation there is replaced)")
      ->required()
      ->type_name("DIR");
  app.add_option("--seed", o.seed, "Everything follows from it")->capture_default_str();
  app.add_option("--photos", o.photographs, "Number of photographs, 3 to 999")
      ->capture_default_str();
  app.add_option("--size", size, "Their size in pixels")->type_name("WxH")->capture_default_str();
  app.add_flag("--no-distortion", no_distortion, "PINHOLE cameras instead of OPENCV");
  app.add_option("--dense-points", o.dense_points, "Points in dense/fused.ply")
      ->capture_default_str();
  app.add_option("--noise", o.noise_m, "Standard deviation of the dense points, metres")
      ->type_name("M")
      ->capture_default_str();
  app.add_option("--outliers", o.outlier_share, "Share of stray dense points, 0 to 0.9")
      ->type_name("SHARE")
      ->capture_default_str();
  app.add_flag("--no-dense", no_dense, "Photographs and sparse model alone");
  app.add_option("--sparse-points", o.sparse_points, "Points in the sparse model")
      ->capture_default_str();
  app.add_option("--keypoint-noise", o.keypoint_noise_px,
                 "Standard deviation of the observations, pixels")
      ->type_name("PX")
      ->capture_default_str();
  app.add_option("--exposure-stops", o.exposure_stops,
                 "Standard deviation of the photographs' exposure")
      ->capture_default_str();
  app.add_option("--sensor-noise", o.sensor_noise, "Standard deviation of a pixel, 8-bit levels")
      ->capture_default_str();
  app.add_option("--depth-map-side", o.depth_map_max_side,
                 "Longest side of the depth and normal maps, pixels")
      ->capture_default_str();
  app.add_flag("--colmap-half-pixel", o.colmap_half_pixel,
               "Dense points half a depth-map pixel off, as COLMAP's fusion places them");
  app.add_option("--threads", o.threads, "0: all")->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::fprintf(stderr, "sherd-synthetic: %s (--help shows the options)\n", error.what());
    return 2;
  }

  std::stop_source stop;
  std::signal(SIGINT, [](int) { g_interrupted = 1; });
  std::signal(SIGTERM, [](int) { g_interrupted = 1; });
  // A signal handler may only set a flag; this thread carries it over.
  std::jthread watcher([&stop](const std::stop_token& end) {
    while (!end.stop_requested()) {
      if (g_interrupted) stop.request_stop();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });

  ProgressLine line;
  sherd::Control control;
  control.stop = stop.get_token();
  if (isatty(STDERR_FILENO)) {
    control.progress = [&line](std::string_view what, double f) { line.Show(what, f); };
  }
  try {
    ParseSize(size, &o.photo_width, &o.photo_height);
    o.lens_distortion = !no_distortion;
    o.write_dense = !no_dense;
    sherd::WriteExcavation(out, o, control);
    line.End();
    std::printf("%s: %d photographs of %dx%d%s\n", out.c_str(), o.photographs, o.photo_width,
                o.photo_height, o.write_dense ? ", sparse and dense model" : ", sparse model");
    return 0;
  } catch (const sherd::Cancelled&) {
    line.End();
    std::fprintf(stderr, "sherd-synthetic: cancelled, nothing was written\n");
    return 130;
  } catch (const std::exception& error) {
    line.End();
    std::fprintf(stderr, "sherd-synthetic: %s\n", error.what());
    return 1;
  }
}
