#include "app/project/colmap_run.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include "app/project/child_process.h"
#include "app/project/project_lock.h"
#include "metaball/atomic_file.h"
#include "metaball/error.h"
#include "metaball/progress_range.h"
#include "metaball/stopwatch.h"
#include "reconstruction/folder_scan.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// What of COLMAP's options have another name in another version is asked of its own help.
class Colmap {
 public:
  explicit Colmap(std::string program, const Control& control) : program_(std::move(program)) {
    const std::string help = Help({"help"}, control);
    std::smatch match;
    if (std::regex_search(help, match, std::regex("COLMAP [0-9][0-9A-Za-z.]*"))) {
      version_ = match.str();
    } else {
      throw InputError(program_, "", "does not answer as COLMAP does", "name COLMAP's program");
    }
    cuda_ = help.find("with CUDA") != std::string::npos;
  }

  const std::string& program() const { return program_; }
  const std::string& version() const { return version_; }
  bool cuda() const { return cuda_; }

  // The first of `names` that `command` knows, or empty.
  std::string OptionOf(const std::string& command, const std::vector<std::string>& names,
                       const Control& control) const {
    const std::string help = Help({command, "-h"}, control);
    for (const std::string& name : names) {
      if (help.find("--" + name + " ") != std::string::npos) return "--" + name;
    }
    return "";
  }

 private:
  std::string Help(const std::vector<std::string>& arguments, const Control& control) const {
    std::vector<std::string> argv{program_};
    argv.insert(argv.end(), arguments.begin(), arguments.end());
    std::string text;
    RunChild(
        argv, "", [&](std::string_view line) { text.append(line).append("\n"); }, control);
    return text;
  }

  std::string program_, version_;
  bool cuda_ = false;
};

struct Stage {
  std::string name, saying;
  std::vector<std::vector<std::string>> commands;  // COLMAP's, without the program
  double share = 1;                                // of the time
  std::string part, result;  // renamed from one to the other; empty: the database itself
};

class Run {
 public:
  Run(const ReconstructOptions& options, const Control& control)
      : options_(options),
        control_(control),
        lock_(options.workspace, options.workspace),
        colmap_(options.colmap, control) {
    result_.version = colmap_.version();
    result_.cuda = colmap_.cuda();
    result_.log = Path("colmap.log");
    for (const ScannedFolder& folder : ScanFolders(options.photos, 8)) {
      photographs_ += static_cast<std::size_t>(
          std::count_if(folder.files.begin(), folder.files.end(),
                        [](const ScannedFile& f) { return IsImageFileName(f.name); }));
    }
    if (photographs_ < 2) {
      throw InputError(options.photos, "",
                       "holds " + std::to_string(photographs_) +
                           " photographs; a reconstruction needs at least two",
                       "name the folder they lie in");
    }
  }

  ReconstructResult All() {
    std::vector<Stage> stages = Stages();
    double total = 0, done = 0;
    for (const Stage& stage : stages) total += stage.share;
    const Json before = ReadState();
    Json state = Json::array();
    bool changed = false;
    for (const Stage& stage : stages) {
      control_.ThrowIfStopped();
      const Json wanted = {{"stage", stage.name}, {"commands", stage.commands}};
      const std::size_t i = state.size();
      changed = changed || i >= before.size() || before[i] != wanted || !IsThere(stage);
      ReconstructStage entry{stage.name, !changed, 0};
      if (changed) {
        WriteState(state);  // what follows is not finished any more
        entry.seconds =
            RunStage(stage, PartOf(control_, done / total, (done + stage.share) / total));
      }
      state.push_back(wanted);
      if (changed) WriteState(state);
      result_.stages.push_back(entry);
      done += stage.share;
    }
    for (const auto& model : fs::directory_iterator(Path("sparse"))) {
      result_.models += model.is_directory();
    }
    control_.Report("reconstructed", 1);
    return std::move(result_);
  }

 private:
  std::string Path(const std::string& name) const { return options_.workspace + "/" + name; }

  std::vector<Stage> Stages() {
    const ReconstructOptions& o = options_;
    const std::string database = Path("database.db");
    const std::string gpu = colmap_.cuda() ? "1" : "0";
    const auto add = [&](std::vector<std::string>* command, const std::vector<std::string>& names,
                         const std::string& value) {
      const std::string option = colmap_.OptionOf(command->front(), names, control_);
      if (option.empty()) return;
      command->push_back(option);
      command->push_back(value);
    };
    std::vector<std::string> features{"feature_extractor",
                                      "--database_path",
                                      database,
                                      "--image_path",
                                      o.photos,
                                      "--ImageReader.camera_model",
                                      o.camera_model,
                                      "--ImageReader.single_camera",
                                      o.single_camera ? "1" : "0"};
    add(&features, {"FeatureExtraction.use_gpu", "SiftExtraction.use_gpu"}, gpu);
    std::vector<std::string> matching{o.sequential ? "sequential_matcher" : "exhaustive_matcher",
                                      "--database_path", database};
    add(&matching, {"FeatureMatching.use_gpu", "SiftMatching.use_gpu"}, gpu);
    std::vector<std::string> mapping{"mapper",           "--database_path", database,
                                     "--image_path",     o.photos,          "--output_path",
                                     Path("sparse.part")};
    if (o.max_image_size > 0) {
      add(&features, {"FeatureExtraction.max_image_size", "SiftExtraction.max_image_size"},
          std::to_string(o.max_image_size));
    }
    if (o.threads > 0) {
      const std::string threads = std::to_string(o.threads);
      add(&features, {"FeatureExtraction.num_threads", "SiftExtraction.num_threads"}, threads);
      add(&matching, {"FeatureMatching.num_threads", "SiftMatching.num_threads"}, threads);
      add(&mapping, {"Mapper.num_threads"}, threads);
    }
    std::vector<Stage> stages{
        {"features", "finding features", {features}, 2, "", ""},
        {"matching", "matching photographs", {matching}, 3, "", ""},
        {"mapping", "placing the photographs", {mapping}, 3, "sparse.part", "sparse"}};
    // The largest model is known only then: a place is kept for its name.
    std::vector<std::string> undistortion{"image_undistorter", "--image_path",  o.photos,
                                          "--input_path",      kLargestModel,   "--output_path",
                                          Path("dense.part"),  "--output_type", "COLMAP"};
    if (o.max_image_size > 0) {
      undistortion.push_back("--max_image_size");
      undistortion.push_back(std::to_string(o.max_image_size));
    }
    stages.push_back(
        {"undistortion", "undistorting photographs", {undistortion}, 1, "dense.part", "dense"});
    if (!o.dense) {
      result_.no_dense = "it was not asked for";
    } else if (!colmap_.cuda()) {
      result_.no_dense =
          colmap_.version() +
          " was built without CUDA, which its dense stage needs; the surface is made "
          "from the sparse points";
    } else {
      // Depth maps stay where they are: an interrupted stage goes on where it ended.
      stages.push_back({"stereo",
                        "finding depths",
                        {{"patch_match_stereo", "--workspace_path", Path("dense")}},
                        20,
                        "",
                        ""});
      stages.push_back({"fusion",
                        "joining depth maps",
                        {{"stereo_fusion", "--workspace_path", Path("dense"), "--output_path",
                          Path("dense/fused.ply")}},
                        3,
                        "",
                        ""});
    }
    return stages;
  }

  // Whether the result of a finished stage is still there.
  bool IsThere(const Stage& stage) const {
    std::error_code error;
    if (stage.name == "fusion") return fs::exists(Path("dense/fused.ply"), error);
    if (stage.name == "stereo") return fs::exists(Path("dense/stereo/depth_maps"), error);
    return fs::exists(Path(stage.result.empty() ? "database.db" : stage.result), error);
  }

  double RunStage(const Stage& stage, const Control& control) {
    const Stopwatch watch;
    std::error_code error;
    if (stage.name == "features") {
      // Features of other options, or of an extraction that was cut off, must not stay.
      for (const char* name :
           {"database.db", "database.db-wal", "database.db-shm", "database.db-journal"}) {
        fs::remove(Path(name), error);
      }
    }
    if (!stage.part.empty()) {
      fs::remove_all(Path(stage.part), error);
      if (!fs::create_directory(Path(stage.part), error)) {
        throw OutputError(Path(stage.part), "cannot be made: " + error.message());
      }
    }
    for (std::vector<std::string> command : stage.commands) {
      std::replace(command.begin(), command.end(), std::string(kLargestModel), LargestModel());
      RunCommand(stage, command, control);
    }
    if (!stage.part.empty()) {
      CheckResult(stage);
      fs::remove_all(Path(stage.result), error);
      fs::rename(Path(stage.part), Path(stage.result), error);
      if (error) throw OutputError(Path(stage.result), "cannot be made: " + error.message());
    }
    return watch.Seconds();
  }

  void RunCommand(const Stage& stage, const std::vector<std::string>& command,
                  const Control& control) {
    std::vector<std::string> argv{colmap_.program()};
    argv.insert(argv.end(), command.begin(), command.end());
    std::string last;
    double furthest = 0;
    control.Report(stage.saying, 0);
    const ChildOutcome outcome = RunChild(
        argv, result_.log,
        [&](std::string_view line) {
          if (const auto progress = ColmapProgress(line, photographs_)) {
            furthest = std::max(furthest, std::min(1.0, *progress));
            control.Report(stage.saying, furthest);
          }
          if (line.find_first_not_of(" \t=-") != std::string_view::npos) last = line;
        },
        control);
    if (outcome.good()) return;
    throw InputError(
        options_.photos, "",
        colmap_.version() + "'s " + command.front() +
            (outcome.signal != 0 ? " was killed by signal " + std::to_string(outcome.signal) +
                                       (outcome.signal == SIGKILL ? " (out of memory?)" : "")
                                 : " failed with exit code " + std::to_string(outcome.exit_code)) +
            (last.empty() ? "" : ", its last words: " + last.substr(0, 200)),
        "see " + result_.log + "; the finished stages are kept, run the same again to go on");
  }

  void CheckResult(const Stage& stage) const {
    if (stage.name == "mapping" && ModelsIn(Path(stage.part)).empty()) {
      throw InputError(options_.photos, "",
                       "COLMAP found no photographs that show the same: no model was made",
                       "take photographs that overlap by two thirds; see " + result_.log);
    }
  }

  // Folder and size of images.bin of each model.
  static std::vector<std::pair<std::uintmax_t, std::string>> ModelsIn(const std::string& folder) {
    std::vector<std::pair<std::uintmax_t, std::string>> models;
    std::error_code error;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
      const fs::path images = it->path() / "images.bin";
      if (!fs::exists(images, error)) continue;
      std::ifstream file(images, std::ios::binary);
      std::uint64_t count = 0;
      file.read(reinterpret_cast<char*>(&count), sizeof count);
      models.emplace_back(count, it->path().string());
    }
    // Most photographs first, then by name.
    std::sort(models.begin(), models.end(), [](const auto& a, const auto& b) {
      return a.first != b.first ? a.first > b.first : a.second < b.second;
    });
    return models;
  }

  std::string LargestModel() const {
    const auto models = ModelsIn(Path("sparse"));
    return models.empty() ? Path("sparse/0") : models.front().second;
  }

  Json ReadState() const {
    std::ifstream file(Path("reconstruct.json"), std::ios::binary);
    const Json json = Json::parse(file, nullptr, false);
    return json.is_array() ? json : Json::array();
  }

  void WriteState(const Json& state) const {
    const std::string text = state.dump(1) + "\n";
    AtomicFile file(Path("reconstruct.json"));
    file.Write(text.data(), text.size());
    file.Commit();
  }

  static constexpr const char* kLargestModel = "(largest model)";
  const ReconstructOptions& options_;
  const Control& control_;
  ProjectLock lock_;
  Colmap colmap_;
  std::size_t photographs_ = 0;
  ReconstructResult result_;
};

std::string Absolute(const std::string& path) {
  std::error_code error;
  std::string text = fs::weakly_canonical(fs::absolute(path, error), error).string();
  while (text.size() > 1 && text.back() == '/') text.pop_back();
  return text;
}

// The number before and after the slash of "3/10" or "3 / 10" at `at`; 0 of 0 for anything else.
bool ReadRatio(std::string_view text, double* ratio) {
  std::size_t i = 0;
  const auto number = [&](int* value) {
    while (i < text.size() && text[i] == ' ') ++i;
    const auto result = std::from_chars(text.data() + i, text.data() + text.size(), *value);
    if (result.ec != std::errc()) return false;
    i = static_cast<std::size_t>(result.ptr - text.data());
    while (i < text.size() && text[i] == ' ') ++i;
    return true;
  };
  int part = 0, whole = 0;
  if (!number(&part) || i >= text.size() || text[i] != '/') return false;
  ++i;
  if (!number(&whole) || whole <= 0 || part < 0) return false;
  *ratio = static_cast<double>(part) / whole;
  return true;
}

}  // namespace

std::optional<double> ColmapProgress(std::string_view line, std::size_t photographs) {
  double ratio = 0;
  constexpr std::string_view kRegistering = "Registering image #";
  if (const std::size_t at = line.find(kRegistering); at != std::string_view::npos) {
    const std::size_t open = line.find('(', at);
    int registered = 0;
    if (open == std::string_view::npos || photographs == 0) return std::nullopt;
    const auto result =
        std::from_chars(line.data() + open + 1, line.data() + line.size(), registered);
    if (result.ec != std::errc()) return std::nullopt;
    return std::min(1.0, registered / static_cast<double>(photographs));
  }
  if (const std::size_t at = line.find(" view "); at != std::string_view::npos) {
    if (ReadRatio(line.substr(at + 6), &ratio)) return ratio;
  }
  for (std::size_t at = line.find('['); at != std::string_view::npos; at = line.find('[', at + 1)) {
    const std::string_view rest = line.substr(at + 1);
    if (!ReadRatio(rest, &ratio)) continue;
    // Blocks of pairs: the second number runs within the first.
    const std::size_t comma = rest.find(','), close = rest.find(']');
    double inner = 0;
    if (comma < close && ReadRatio(rest.substr(comma + 1), &inner)) {
      int outer_count = 0;
      const std::size_t slash = rest.find('/');
      std::from_chars(rest.data() + slash + 1, rest.data() + rest.size(), outer_count);
      if (outer_count > 0) ratio += (inner - 1) / outer_count;
    }
    return ratio;
  }
  return std::nullopt;
}

ReconstructResult Reconstruct(const ReconstructOptions& options, const Control& control) {
  std::error_code error;
  ReconstructOptions absolute = options;
  absolute.photos = Absolute(options.photos);
  absolute.workspace = Absolute(options.workspace);
  if (!fs::is_directory(absolute.photos, error)) {
    throw InputError(options.photos, "", "is no folder", "name the folder of the photographs");
  }
  if ((absolute.workspace + "/").starts_with(absolute.photos + "/")) {
    throw InputError(options.workspace, "",
                     "lies in the folder of the photographs, where COLMAP would take its own "
                     "pictures for photographs",
                     "choose a folder outside");
  }
  if (!fs::is_directory(fs::path(absolute.workspace).parent_path(), error)) {
    throw OutputError(absolute.workspace, "the folder above it does not exist; make it first");
  }
  Run run(absolute, control);
  return run.All();
}

}  // namespace sherd
