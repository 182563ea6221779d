#include "photo_check.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <vector>

#include "cuda/host_loop.h"
#include "cuda/renderers.h"
#include "metaball/photo/sampler.h"
#include "metaball/stopwatch.h"
#include "photo_scenes.h"

namespace sherd {
namespace {

double LargestDifference(const Vec3f& a, const Vec3f& b) {
  const Vec3f d = a - b;
  const float worst = std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)});
  return worst >= 0 ? worst : INFINITY;  // NaN
}

}  // namespace

PhotoCheck CheckPhotos(const std::string& backend, std::uint64_t pool_bytes) {
  constexpr int kWidth = 2000, kHeight = 1500, kPhotos = 3;
  constexpr std::size_t kLookups = 100'000;
  PhotoCheck check;
  check.backend = backend;
  check.pool_bytes = pool_bytes;
  try {
    const auto cpu = MakeCpuPhotoSampler();
    const auto sampler = backend == "cuda" ? MakeCudaPhotoSampler(pool_bytes, FirstUsableGpu().idx)
                                           : MakeHostLoopPhotoSampler(pool_bytes);
    std::vector<PhotoColors> expected(kLookups), got(kLookups);
    for (int k = 0; k < kPhotos; ++k) {
      const auto id = static_cast<std::uint32_t>(k);
      const PhotoPyramid pixels = MakeNoisePhoto(kWidth, kHeight, 0, id);
      const std::vector<PhotoLookup> lookups = MakeLookups(id, kWidth, kHeight, kLookups);
      const PhotoExtent extent{id, kWidth, kHeight, 0};
      cpu->Sample(extent, &pixels, lookups, expected.data(), {});
      const Stopwatch watch;
      sampler->Sample(extent, &pixels, lookups, got.data(), {});
      check.seconds += watch.Seconds();
      check.lookups += kLookups;
      for (std::size_t i = 0; i < kLookups; ++i) {
        check.largest_difference = std::max(
            {check.largest_difference, LargestDifference(got[i].footprint, expected[i].footprint),
             LargestDifference(got[i].surroundings, expected[i].surroundings)});
      }
    }
    check.use = sampler->use();
  } catch (const std::exception& error) {
    check.error = error.what();
  }
  // The device fuses multiplications and additions; a pixel from the wrong place is off by far
  // more. Its logarithm may choose a level a rounding away.
  check.passed = check.error.empty() && check.largest_difference <= 2e-5;
  return check;
}

void Print(const PhotoCheck& check) {
  std::printf("%-4s photographs in %-21s %-9s ", check.passed ? "ok" : "FAIL",
              (std::to_string(check.pool_bytes >> 10) + " KiB").c_str(), check.backend.c_str());
  if (!check.error.empty()) {
    std::printf("%s\n", check.error.c_str());
    return;
  }
  std::printf("off from the CPU's by %.1e, %llu rounds, %.1f ms\n", check.largest_difference,
              static_cast<unsigned long long>(check.use.rounds), check.seconds * 1e3);
  std::fflush(stdout);
}

void Write(const PhotoCheck& check, JsonWriter* json) {
  json->BeginObject()
      .Field("backend", check.backend)
      .Field("passed", check.passed)
      .Field("pool_bytes", check.pool_bytes);
  if (check.error.empty()) {
    json->Field("lookups", check.lookups)
        .Field("largest_difference_from_cpu", check.largest_difference)
        .Field("tiles_loaded", check.use.tiles_loaded)
        .Field("rounds", check.use.rounds)
        .Field("seconds", check.seconds);
  } else {
    json->Field("error", check.error);
  }
  json->EndObject();
}

}  // namespace sherd
