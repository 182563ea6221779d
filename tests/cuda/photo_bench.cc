#include "photo_bench.h"

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "metaball/median.h"
#include "metaball/photo/sampler.h"
#include "metaball/stopwatch.h"
#include "photo_scenes.h"

namespace sherd {

void MeasurePhotographs(const BenchBackend& backend, JsonWriter* json) {
  const bool gpu = backend.measures_a_gpu();
  const int width = gpu ? 4096 : 512, height = gpu ? 2732 : 341;
  const int photos = gpu ? 8 : 2, repeats = gpu ? 5 : 2;
  const std::size_t count = gpu ? 131'072 : 4096;
  std::vector<PhotoPyramid> pixels;
  std::vector<std::vector<PhotoLookup>> lookups;
  for (int k = 0; k < photos; ++k) {
    const auto id = static_cast<std::uint32_t>(k);
    pixels.push_back(MakeNoisePhoto(width, height, 0, id));
    lookups.push_back(MakeLookups(id, width, height, count));
  }
  std::vector<PhotoColors> colors(count);
  const auto seconds = [&](PhotoSampler* sampler) {
    const Stopwatch watch;
    for (int k = 0; k < photos; ++k) {
      const PhotoExtent extent{static_cast<std::uint32_t>(k), width, height, 0};
      sampler->Sample(extent, &pixels[k], lookups[k], colors.data(), {});
    }
    return watch.Seconds();
  };
  std::vector<double> cpu, cold, warm;
  PhotoTileSampler::Use use;
  const auto on_cpu = MakeCpuPhotoSampler();
  for (int i = 0; i < repeats; ++i) {
    cpu.push_back(seconds(on_cpu.get()));
    const auto sampler = backend.MakePhotoSampler();
    cold.push_back(seconds(sampler.get()));
    warm.push_back(seconds(sampler.get()));
    use = sampler->use();
  }
  const std::uint64_t all = static_cast<std::uint64_t>(photos) * count;
  std::printf("photographs: %llu lookups, CPU %.3f s, %s %.3f s empty, %.3f s filled\n",
              static_cast<unsigned long long>(all), Median(cpu), backend.name().c_str(),
              Median(cold), Median(warm));
  std::fflush(stdout);
  json->BeginObject()
      .Field("photographs", photos)
      .Field("width", width)
      .Field("height", height)
      .Field("lookups", all)
      .Field("tiles", use.tiles_loaded)
      .Field("pool_bytes", use.pool_bytes)
      .Field("cpu_seconds", Median(cpu))
      .Field("seconds_empty_store", Median(cold))
      .Field("seconds_filled_store", Median(warm))
      .EndObject();
}

}  // namespace sherd
