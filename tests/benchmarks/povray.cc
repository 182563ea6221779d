#include "povray.h"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <numbers>
#include <regex>
#include <sstream>

namespace sherd {
namespace {

namespace fs = std::filesystem;

void WriteVector(std::ostream& out, const Vec3d& v) {
  out << '<' << v.x << ',' << v.y << ',' << v.z << '>';
}

void WriteScene(const std::string& path, const PeerScene& peer) {
  std::ofstream out(path);
  out.precision(9);
  const Cloud& cloud = *peer.scene.cloud;
  const Camera& camera = peer.camera;
  const double angle = 2 * std::atan(0.5 * camera.width / camera.fx) * 180 / std::numbers::pi;
  const Vec3d look_at = camera.eye + camera.forward;
  const Lighting& light = peer.scene.lighting;
  out << "#version 3.7;\nglobal_settings { assumed_gamma 1.0 ambient_light rgb 1 }\n"
      << "background { rgb 0 }\n"
      << "camera { perspective location ";
  WriteVector(out, camera.eye);
  out << " right x*" << camera.width << "/" << camera.height << " up y sky y angle " << angle
      << " look_at ";
  WriteVector(out, look_at);
  out << " }\nlight_source { ";
  WriteVector(out, light.to_light * 100.0);
  out << " rgb 1 parallel point_at <0,0,0> shadowless }\n"
      << "#default { finish { ambient " << light.ambient << " diffuse " << light.diffuse << " } }\n"
      << "blob { threshold " << peer.scene.surface.threshold << "\n";
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3f c = LinearFromRgb8(cloud.ColorOf(i));
    out << "sphere { ";
    WriteVector(out, cloud.frame.WorldFromLocal(cloud.center[i]));
    out << ',' << cloud.RadiusOf(i) * cloud.frame.unit << ",1 texture { pigment { color rgb <"
        << c.x << ',' << c.y << ',' << c.z << "> } } }\n";
  }
  out << "}\n";
}

double SecondsOf(const std::string& log, const std::string& what) {
  std::smatch match;
  const std::regex line(what + R"( Time:[^(]*\(([0-9.]+) seconds\))");
  return std::regex_search(log, match, line) ? std::stod(match[1]) : NAN;
}

bool ReadPpm(const std::string& path, PovRayRun* run) {
  std::ifstream in(path, std::ios::binary);
  std::string magic;
  int maximum = 0;
  in >> magic >> std::ws;
  while (in.peek() == '#') {
    std::string comment;
    std::getline(in, comment);
    in >> std::ws;
  }
  if (!(in >> run->width >> run->height >> maximum) || magic != "P6" || maximum != 255) {
    return false;
  }
  in.get();
  run->rgb.resize(static_cast<std::size_t>(run->width) * run->height * 3);
  in.read(reinterpret_cast<char*>(run->rgb.data()), static_cast<std::streamsize>(run->rgb.size()));
  return static_cast<bool>(in);
}

}  // namespace

std::optional<PovRayRun> RenderWithPovRay(const PeerScene& peer, int threads) {
  const fs::path folder = fs::temp_directory_path() / ("sherd-povray-" + std::to_string(getpid()));
  fs::create_directories(folder);
  WriteScene(folder / "scene.pov", peer);
  const std::string log_path = folder / "log.txt";

  PovRayRun run;
  const auto begin = std::chrono::steady_clock::now();
  std::fflush(nullptr);  // or the child would print what is still in our buffers
  const pid_t child = fork();
  if (child == 0) {
    if (!std::freopen(log_path.c_str(), "w", stderr) || !std::freopen("/dev/null", "w", stdout)) {
      _exit(126);
    }
    const std::string width = "+W" + std::to_string(peer.camera.width);
    const std::string height = "+H" + std::to_string(peer.camera.height);
    const std::string work_threads = "+WT" + std::to_string(threads);
    const std::string input = "+I" + (folder / "scene.pov").string();
    const std::string output = "+O" + (folder / "picture.ppm").string();
    execlp("povray", "povray", input.c_str(), output.c_str(), width.c_str(), height.c_str(),
           work_threads.c_str(), "-A", "-D", "+FP", "File_Gamma=1.0", nullptr);
    _exit(127);
  }
  int status = 0;
  rusage usage{};
  wait4(child, &status, 0, &usage);
  run.seconds_wall =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  run.peak_mb = static_cast<double>(usage.ru_maxrss) / 1024;
  std::ifstream log(log_path);
  std::stringstream text;
  text << log.rdbuf();
  run.seconds_parse = SecondsOf(text.str(), "Parse");
  run.seconds_trace = SecondsOf(text.str(), "Trace");
  const bool good =
      WIFEXITED(status) && WEXITSTATUS(status) == 0 && ReadPpm(folder / "picture.ppm", &run);
  if (!good) {
    const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    std::cerr << (code == 127 ? std::string("povray is not installed: no comparison with it")
                              : "povray failed with exit code " + std::to_string(code))
              << "\n";
  }
  fs::remove_all(folder);
  return good ? std::optional(run) : std::nullopt;
}

}  // namespace sherd
