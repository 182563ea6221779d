// Where the time of pictures goes, on the two scenes of docs/performance.md.
//
//   sherd_cuda_bench [--json FILE] [--counts N,N,...] [--sizes WxH,WxH,...] [--frames N]
//                    [--warm-up N] [--sections NAME,NAME,...] [--feature-count N] [--count-work]
//                    [--backend cuda|host-loop]
//
// Counts may end in k and M. Sections, all unless some are named; those with a star are measured at
// the first size alone:
//
//   measurements       milliseconds for every kernel of a frame and for whole frames
//   (scene_bench.h) first_frame *      from a cloud in the host's memory to its first picture
//   against_the_cpu *  the CPU renderer beside it, and both errors against the reference
//   thesis_method *    the thesis's method beside ours on the same GPU (thesis_bench.h)
//   features *         what each feature costs, at --feature-count metaballs (feature_bench.h)
//   photographs        lookups in photographs (photo_bench.h)
//
// Each frame has a camera of its own; the medians over the frames after a warm-up are reported, by
// CUDA events for the kernels and by the host's clock for whole frames. Without a GPU it says so
// and ends. What does not fit in memory is left out with a line that says so. The report is written
// anew after every scene.
//
// --count-work adds the operations a frame consists of (counted by the host loop, which takes its
// time), with which a measured time can be held against the device's limits. --backend host-loop
// runs the kernels' bodies on the CPU, so that the program can be tried where there is no GPU: what
// it then measures says nothing about one, and the report says that.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench_backend.h"
#include "bench_options.h"
#include "cuda/renderers.h"
#include "datasets_synthetic/peer_scenes.h"
#include "exit_code.h"
#include "feature_bench.h"
#include "json_writer.h"
#include "metaball/error.h"
#include "photo_bench.h"
#include "reference_error.h"
#include "scene_bench.h"
#include "thesis_bench.h"

namespace sherd {
namespace {

const std::vector<std::string> kSections{"measurements",  "first_frame", "against_the_cpu",
                                         "thesis_method", "features",    "photographs"};

struct Options : BenchOptions {
  std::string backend = "cuda";
  std::vector<std::string> sections = kSections;
  std::uint64_t feature_count = 250'000;
  bool count_work = false;

  bool Wants(const std::string& section) const {
    return std::find(sections.begin(), sections.end(), section) != sections.end();
  }
};

Options ParseOptions(int argc, char** argv) {
  Options options;
  const OwnOption own = [&options](const std::string& name, const OptionValue& value) {
    if (name == "--count-work") {
      options.count_work = true;
    } else if (name == "--backend") {
      options.backend = value();
    } else if (name == "--feature-count") {
      options.feature_count = ParseCount(name, value());
    } else if (name == "--sections") {
      options.sections = SplitList(name, value());
      for (const std::string& section : options.sections) {
        if (std::find(kSections.begin(), kSections.end(), section) == kSections.end()) {
          throw std::invalid_argument("--sections: there is no section '" + section + "'");
        }
      }
    } else {
      return false;
    }
    return true;
  };
  static_cast<BenchOptions&>(options) = ParseBenchOptions(argc, argv, own);
  return options;
}

class Bench {
 public:
  Bench(const Options& options, const BenchBackend& backend)
      : options_(options), backend_(backend), device_(backend.MakeRenderer()->device()) {
    for (const std::string& section : kSections) reports_[section].BeginArray();
    left_out_.BeginArray();
  }

  void Run() {
    std::printf("%s\n", device_.c_str());
    for (const std::uint64_t count : options_.counts) {
      for (const bool shell : {false, true}) {
        MeasureScene(count, shell);
        WriteReport();
      }
    }
    if (options_.Wants("features")) {
      const MeasureOne measure = [this](const std::string& name, const std::function<void()>& one) {
        Measure("features", name, options_.feature_count, one);
      };
      Measure("features", "height_field", options_.feature_count, [&] {
        MeasureFeatures(backend_, options_.feature_count, options_, measure, &reports_["features"]);
      });
      WriteReport();
    }
    if (options_.Wants("photographs")) {
      Measure("photographs", "photographs", 0,
              [&] { MeasurePhotographs(backend_, &reports_["photographs"]); });
      WriteReport();
    }
  }

 private:
  // Of what is measured so far: a program that is ended early, or a GPU that fails, leaves that.
  void WriteReport() const {
    if (options_.json.empty()) return;
    JsonWriter json;
    json.BeginObject()
        .Field("program", "sherd_cuda_bench")
        .Field("backend", backend_.name())
        .Field("measures_a_gpu", backend_.measures_a_gpu())
        .Field("device", device_);
    for (const std::string& section : kSections) {
      if (!options_.Wants(section)) continue;
      JsonWriter list = reports_.at(section);
      json.Key(section).Value(list.EndArray());
    }
    JsonWriter left_out = left_out_;
    json.Key("left_out").Value(left_out.EndArray()).EndObject();
    WriteText(options_.json, json.text());
  }

  // What does not fit in memory is told of and left out.
  void Measure(const std::string& section, const std::string& name, std::uint64_t metaballs,
               const std::function<void()>& measure) {
    std::string why;
    try {
      measure();
      return;
    } catch (const ResourceError& error) {
      why = error.what();
    } catch (const std::bad_alloc&) {
      why = "the host has no memory for it";
    }
    std::printf("left out: %s of %s, %llu metaballs: %s\n", section.c_str(), name.c_str(),
                static_cast<unsigned long long>(metaballs), why.c_str());
    std::fflush(stdout);
    left_out_.BeginObject()
        .Field("section", section)
        .Field("name", name)
        .Field("metaballs", metaballs)
        .Field("why", why)
        .EndObject();
  }

  void MeasureScene(std::uint64_t count, bool shell) {
    const std::string name = shell ? "shell" : "height_field";
    std::optional<PeerScene> peer;
    Measure("scenes", name, count,
            [&] { peer = shell ? MakeShell(count) : MakeHeightField(count); });
    if (!peer) return;
    const auto measure = [&](const std::string& section, const auto& one) {
      if (!options_.Wants(section)) return;
      Measure(section, name, count, [&] { one(&reports_[section]); });
    };
    for (const PictureSize& size : options_.sizes) {
      measure("measurements", [&](JsonWriter* json) {
        MeasureFrames(backend_, name, Sized(*peer, size), options_, options_.count_work, json);
      });
    }
    const PeerScene first = Sized(*peer, options_.sizes.front());
    measure("first_frame",
            [&](JsonWriter* json) { MeasureFirstFrame(backend_, name, first, json); });
    if (!options_.Wants("against_the_cpu") && !options_.Wants("thesis_method")) return;
    std::optional<SmallReference> reference;
    Measure("the reference", name, count, [&] { reference = MakeSmallReference(first); });
    if (!reference) return;
    measure("against_the_cpu", [&](JsonWriter* json) {
      MeasureAgainstTheCpu(backend_, name, first, *reference, json);
    });
    measure("thesis_method", [&](JsonWriter* json) {
      MeasureThesis(backend_, name, first, *reference, options_, json);
    });
  }

  const Options& options_;
  const BenchBackend& backend_;
  const std::string device_;
  std::map<std::string, JsonWriter> reports_;  // a list for each section
  JsonWriter left_out_;
};

int Run(const Options& options) {
  if (options.backend == "cuda") {
    const CudaStatus status = QueryCuda();
    if (!status.available) {
      std::printf("no GPU to measure: %s\n", status.reason.c_str());
      return 0;
    }
  }
  const BenchBackend backend(options.backend);
  Bench(options, backend).Run();
  return 0;
}

}  // namespace
}  // namespace sherd

int main(int argc, char** argv) {
  return sherd::ExitCodeOf("sherd_cuda_bench",
                           [&] { return sherd::Run(sherd::ParseOptions(argc, argv)); });
}
