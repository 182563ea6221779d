#include "photo_check.h"

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <memory>

#include "cuda/host_loop.h"
#include "cuda/renderers.h"
#include "metaball/stopwatch.h"
#include "photo_scenes.h"

namespace sherd {

PhotoCheck CheckPhotos(const std::string& backend, std::uint64_t pool_bytes, bool holes) {
  constexpr std::uint64_t kRoomy = std::uint64_t{256} << 20;
  PhotoCheck check;
  check.backend = backend;
  check.pool_bytes = pool_bytes;
  check.holes = holes;
  try {
    PhotoFieldOptions options;
    options.width = 240;
    options.height = 160;
    options.holes = holes;
    PhotoField field(options);
    const Frame surface = field.Render();
    Frame expected = surface, got = surface;
    PhotoCounts counts;
    if (holes) {
      MakeHostLoopPhotoShader(kRoomy)->Shade(field.scene(), field.camera(), &field, &expected,
                                             &counts, {});
    } else {
      field.ShadePlainly(&expected);
    }
    const auto shader = backend == "cuda" ? MakeCudaPhotoShader(pool_bytes, FirstUsableGpu().idx)
                                          : MakeHostLoopPhotoShader(pool_bytes);
    shader->Shade(field.scene(), field.camera(), &field, &got, &counts, {});
    got = surface;
    const Stopwatch watch;
    shader->Shade(field.scene(), field.camera(), &field, &got, &counts, {});
    check.seconds = watch.Seconds();
    check.pixels = counts.pixels;
    for (std::size_t i = 0; i < got.color.size(); ++i) {
      const Pixel &a = got.color[i], &b = expected.color[i];
      const bool same = std::abs(a.r - b.r) < 4e-3f && std::abs(a.g - b.g) < 4e-3f &&
                        std::abs(a.b - b.b) < 4e-3f && a.a == b.a;
      check.pixels_off += !same;
    }
    // The device fuses multiplications and additions: where two photographs are almost as good, it
    // may take the other one, and a lookup's logarithm may choose a level a rounding away.
    check.allowed = backend == "cuda" ? check.pixels / 200 : 0;
    check.use = shader->use();
    if (holes && counts.across_holes == 0) check.error = "nothing was carried across the holes";
    if (counts.from_photos < counts.pixels / 2) check.error = "few photographs were looked into";
  } catch (const std::exception& error) {
    check.error = error.what();
  }
  check.passed = check.error.empty() && check.pixels_off <= check.allowed;
  return check;
}

void Print(const PhotoCheck& check) {
  std::printf("%-4s photographs%s in %-21s %-9s ", check.passed ? "ok" : "FAIL",
              check.holes ? " across holes" : "",
              (std::to_string(check.pool_bytes >> 10) + " KiB").c_str(), check.backend.c_str());
  if (!check.error.empty()) {
    std::printf("%s\n", check.error.c_str());
    return;
  }
  std::printf("%llu of %llu pixels off (%llu allowed), %llu rounds, %.1f ms\n",
              static_cast<unsigned long long>(check.pixels_off),
              static_cast<unsigned long long>(check.pixels),
              static_cast<unsigned long long>(check.allowed),
              static_cast<unsigned long long>(check.use.rounds), check.seconds * 1e3);
  std::fflush(stdout);
}

void Write(const PhotoCheck& check, JsonWriter* json) {
  json->BeginObject()
      .Field("backend", check.backend)
      .Field("passed", check.passed)
      .Field("holes", check.holes)
      .Field("pool_bytes", check.pool_bytes);
  if (check.error.empty()) {
    json->Field("pixels", check.pixels)
        .Field("pixels_off", check.pixels_off)
        .Field("pixels_allowed", check.allowed)
        .Field("tiles_loaded", check.use.tiles_loaded)
        .Field("rounds", check.use.rounds)
        .Field("seconds", check.seconds);
  } else {
    json->Field("error", check.error);
  }
  json->EndObject();
}

}  // namespace sherd
