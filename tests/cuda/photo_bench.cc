#include "photo_bench.h"

#include <cstdint>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "metaball/median.h"
#include "metaball/stopwatch.h"
#include "photo_scenes.h"

namespace sherd {

void MeasurePhotographs(const BenchBackend& backend, JsonWriter* json) {
  const bool gpu = backend.measures_a_gpu();
  PhotoFieldOptions options;
  if (gpu) {
    options = {.metaballs = 250'000,
               .width = 1920,
               .height = 1080,
               .photos = 36,
               .photo_width = 4096,
               .photo_height = 2732};
  }
  const int repeats = gpu ? 5 : 2;
  PhotoField field(options);
  const Frame surface = field.Render();
  Frame frame;
  PhotoCounts counts;
  const auto seconds = [&](ProfilingPhotoShader* shader) {
    frame = surface;
    const Stopwatch watch;
    shader->Shade(field.scene(), field.camera(), &field, &frame, &counts, {});
    return watch.Seconds();
  };
  std::vector<double> cpu, cold, warm;
  std::map<std::string, std::vector<double>> kernels;  // milliseconds of a picture
  ProfilingPhotoShader::Use use;
  for (int i = 0; i < repeats; ++i) {
    frame = surface;
    const Stopwatch watch;
    field.ShadePlainly(&frame);
    cpu.push_back(watch.Seconds());
    const auto shader = backend.MakePhotoShader();
    cold.push_back(seconds(shader.get()));
    warm.push_back(seconds(shader.get()));
    use = shader->use();
    shader->EnableProfile(true);
    seconds(shader.get());
    std::map<std::string, double> sums;
    for (const KernelTime& kernel : shader->LastKernels()) {
      sums[kernel.name] += kernel.milliseconds;
    }
    for (const auto& [name, sum] : sums) kernels[name].push_back(sum);
  }
  std::printf("photographs: %llu pixels, CPU %.3f s, %s %.3f s empty, %.3f s filled\n",
              static_cast<unsigned long long>(counts.pixels), Median(cpu), backend.name().c_str(),
              Median(cold), Median(warm));
  std::fflush(stdout);
  json->BeginObject()
      .Field("photographs", options.photos)
      .Field("photo_width", options.photo_width)
      .Field("photo_height", options.photo_height)
      .Field("width", options.width)
      .Field("height", options.height)
      .Field("pixels", counts.pixels)
      .Field("tiles", use.tiles_loaded)
      .Field("pool_bytes", use.pool_bytes)
      .Field("cpu_seconds", Median(cpu))
      .Field("seconds_empty_store", Median(cold))
      .Field("seconds_filled_store", Median(warm))
      .Key("kernel_ms")
      .BeginObject();
  for (const auto& [name, times] : kernels) json->Field(name, Median(times));
  json->EndObject().EndObject();
}

}  // namespace sherd
