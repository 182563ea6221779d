// What a frame consists of, counted, and the time that an NVIDIA H200 would need for it at the
// limits of its data sheet. Needs no GPU: the host loop counts. A lower bound and no measurement.
//
//   sherd_cuda_budget [--json FILE] [--counts N,N,...] [--sizes WxH,WxH,...]
//
// Bytes are those that each kernel must read and write at least (arrays once, sorts by their
// passes). Instructions are counted by hand from the formulas, fused multiply-adds as one.
#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench_options.h"
#include "cuda/host_loop.h"
#include "cuda/kernels/binning.h"
#include "datasets_synthetic/peer_scenes.h"
#include "exit_code.h"
#include "json_writer.h"
#include "metaball/atomic_file.h"

namespace sherd {
namespace {

// NVIDIA H200 SXM, data sheet: memory 4.8 TB/s, 67 TFLOPS in FP32 (a fused multiply-add is two),
// PCIe 5.0 x16 64 GB/s a direction.
constexpr double kMemoryBytesPerSecond = 4.8e12;
constexpr double kInstructionsPerSecond = 33.5e12;
constexpr double kBusBytesPerSecond = 64e9;

// Instructions of one operation, default density and one radius (density/shapes.h, march-inl.h,
// shading.h).
constexpr double kPerTest = 24;      // PassOf and what decides whether it is kept
constexpr double kPerAdd = 19;       // SquareBound::Add from a column's entry
constexpr double kPerStep = 140;     // AdvanceMarch with its divisions
constexpr double kPerStaged = 60;    // an entry moved to the tile's frame
constexpr double kPerShadeAdd = 45;  // SurfaceSums::Add

struct Part {
  std::string name;
  double bytes = 0, instructions = 0;
};

// Passes of a radix sort of `bits` by 8 bits each: a histogram, then keys and values read and
// written.
double SortBytes(double n, int bits) { return 4 * n + (bits + 7) / 8 * 16 * n; }

std::vector<Part> PartsOf(const RenderStats& stats, const FrameWork& work, const Camera& camera) {
  const auto n = static_cast<double>(stats.metaballs);
  const auto seen = static_cast<double>(stats.metaballs_in_view);
  const auto entries = static_cast<double>(stats.tile_entries);
  const auto pixels = static_cast<double>(stats.rays);
  const unsigned tiles =
      (camera.width / kernels::kTileSize + 1u) * (camera.height / kernels::kTileSize + 1u);
  return {
      {"MeasureBounds", 36 * n, 60 * n},
      {"sort by depth", SortBytes(n, 32), 0},
      {"CountTiles and scan", 32 * n, 20 * n},
      {"FillEntries", 20 * seen + 8 * entries, 10 * entries},
      {"sort by tile", SortBytes(entries, std::bit_width(tiles)), 0},
      {"FindRanges", 4 * entries + 8.0 * tiles, 5 * entries},
      {"Trace", 32.0 * static_cast<double>(work.staged) + sizeof(Pixel) * pixels,
       kPerTest * static_cast<double>(work.tests) + kPerAdd * static_cast<double>(work.adds) +
           kPerStep * static_cast<double>(work.steps) +
           kPerStaged * static_cast<double>(work.staged) +
           kPerShadeAdd * static_cast<double>(work.shade_adds)},
  };
}

void Count(const std::string& scene, const PeerScene& peer, JsonWriter* json) {
  const FrameWork work = CountFrameWork(peer.scene, peer.camera, {});
  const RenderStats stats = MakeHostLoopRenderer()->Render(peer.scene, peer.camera, {}).stats;
  const std::vector<Part> parts = PartsOf(stats, work, peer.camera);
  json->BeginObject()
      .Field("scene", scene)
      .Field("metaballs", stats.metaballs)
      .Field("width", peer.camera.width)
      .Field("height", peer.camera.height)
      .Field("metaballs_in_view", stats.metaballs_in_view)
      .Field("tile_entries", stats.tile_entries)
      .Field("hits", stats.hits)
      .Field("metaballs_tried_against_rays", work.tests)
      .Field("metaballs_added_to_bounds", work.adds)
      .Field("march_steps", work.steps)
      .Field("entries_staged", work.staged)
      .Field("metaballs_tried_at_hits", work.shade_adds)
      .Field("rays_beyond_their_column", work.wide_rays)
      .Key("kernels")
      .BeginArray();
  double total = 0;
  for (const Part& part : parts) {
    const double memory = part.bytes / kMemoryBytesPerSecond * 1e3;
    const double compute = part.instructions / kInstructionsPerSecond * 1e3;
    total += std::max(memory, compute);
    json->BeginObject()
        .Field("name", part.name)
        .Field("bytes", part.bytes)
        .Field("instructions", part.instructions)
        .Field("milliseconds_at_the_memory_limit", memory)
        .Field("milliseconds_at_the_instruction_limit", compute)
        .EndObject();
  }
  const double copy = static_cast<double>(stats.rays) * sizeof(Pixel) / kBusBytesPerSecond * 1e3;
  json->EndArray()
      .Field("milliseconds_at_the_limits", total)
      .Field("milliseconds_to_copy_the_picture", copy)
      .EndObject();
  std::printf(
      "%-13s %9llu %4dx%-4d  entries %10llu  adds %11llu  steps %9llu  at the limits "
      "%7.3f ms, copy %6.3f ms\n",
      scene.c_str(), static_cast<unsigned long long>(stats.metaballs), peer.camera.width,
      peer.camera.height, static_cast<unsigned long long>(stats.tile_entries),
      static_cast<unsigned long long>(work.adds), static_cast<unsigned long long>(work.steps),
      total, copy);
  std::fflush(stdout);
}

int Run(const BenchOptions& options) {
  JsonWriter json;
  json.BeginObject()
      .Field("program", "sherd_cuda_budget")
      .Field("limits_of", "NVIDIA H200 SXM, data sheet; counted, not measured")
      .Field("memory_bytes_per_second", kMemoryBytesPerSecond)
      .Field("instructions_per_second", kInstructionsPerSecond)
      .Field("bus_bytes_per_second", kBusBytesPerSecond)
      .Key("frames")
      .BeginArray();
  for (const std::uint64_t count : options.counts) {
    for (const bool shell : {false, true}) {
      const PeerScene peer = shell ? MakeShell(count) : MakeHeightField(count);
      for (const PictureSize& size : options.sizes) {
        Count(shell ? "shell" : "height_field", Sized(peer, size), &json);
      }
    }
  }
  json.EndArray().EndObject();
  if (!options.json.empty()) WriteText(options.json, json.text());
  return 0;
}

}  // namespace
}  // namespace sherd

int main(int argc, char** argv) {
  return sherd::ExitCodeOf("sherd_cuda_budget",
                           [&] { return sherd::Run(sherd::ParseBenchOptions(argc, argv)); });
}
