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
#include <regex>
#include <sstream>

#include "metaball/povray_export.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;

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
  WritePovRay(folder / "scene.pov", peer.scene, peer.camera);
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
