#include "metaball/supersample.h"

#include <algorithm>
#include <cmath>
#include <new>

#include "metaball/error.h"

namespace sherd {
namespace {

constexpr int kLargestSide = 1 << 19;           // tile indices are 16 bits wide
constexpr std::int64_t kBandPixels = 16 << 20;  // of the enlarged picture, rendered at once

bool Finite(double v) { return std::isfinite(v); }

}  // namespace

void CheckRenderInput(const Scene& scene, const Camera& camera, const RenderSettings& settings) {
  if (!scene.cloud) throw Error("there is no cloud to render");
  if (camera.width < 1 || camera.height < 1 || camera.width > kLargestSide ||
      camera.height > kLargestSide) {
    throw Error("a picture's sides must lie between 1 and " + std::to_string(kLargestSide) +
                " pixels");
  }
  if (!IsFinite(camera.eye) || !IsFinite(camera.right) || !IsFinite(camera.down) ||
      !IsFinite(camera.forward) || !(camera.fx > 0) || !(camera.fy > 0) || !Finite(camera.fx) ||
      !Finite(camera.fy) || !Finite(camera.cx) || !Finite(camera.cy)) {
    throw Error("the camera is not finite");
  }
  if (!(scene.surface.threshold > 0) || !Finite(scene.surface.threshold)) {
    throw Error("the threshold must be positive");
  }
  if (!(scene.surface.radius_scale > 0) || !Finite(scene.surface.radius_scale)) {
    throw Error("the radius factor must be positive");
  }
  const Lighting& light = scene.lighting;
  if (!(light.ambient >= 0) || !(light.diffuse >= 0) || !Finite(light.ambient) ||
      !Finite(light.diffuse)) {
    throw Error("ambient and diffuse light must not be negative");
  }
  if (!light.unlit && !light.headlight &&
      (!IsFinite(light.to_light) || !(Length(light.to_light) > 0))) {
    throw Error("the light's direction must be finite and not zero");
  }
  if (settings.supersample < 1 || settings.supersample > 8) {
    throw Error("supersampling must lie between 1 and 8");
  }
}

Frame MakeFrame(const Camera& camera, const Planes& planes) {
  Frame frame;
  frame.width = camera.width;
  frame.height = camera.height;
  const std::size_t n = static_cast<std::size_t>(camera.width) * camera.height;
  try {
    frame.color.resize(n);
    if (planes.depth) frame.depth.resize(n);
    if (planes.normal) frame.normal.resize(n);
    if (planes.id) frame.id.assign(n, -1);
  } catch (const std::bad_alloc&) {
    const std::size_t bytes = n * (sizeof(Pixel) + (planes.depth ? sizeof(float) : 0) +
                                   (planes.normal ? sizeof(Vec3f) : 0) + (planes.id ? 4 : 0));
    throw ResourceError("a picture of " + std::to_string(camera.width) + " x " +
                            std::to_string(camera.height) + " pixels needs " +
                            std::to_string(bytes >> 20) + " MB of memory; render it in parts",
                        bytes, 0);
  }
  return frame;
}

Frame RenderSupersampled(Renderer* renderer, const Scene& scene, const Camera& camera,
                         const RenderSettings& settings, const Control& control) {
  const int n = settings.supersample;
  Frame out = MakeFrame(camera, settings.planes);
  RenderSettings single = settings;
  single.supersample = 1;
  const Camera large = camera.Resized(camera.width * n, camera.height * n);
  const auto rows = static_cast<int>(std::clamp<std::int64_t>(
      kBandPixels / (static_cast<std::int64_t>(large.width) * n), 1, camera.height));
  const float weight = 1.0f / static_cast<float>(n * n);
  for (int y0 = 0; y0 < camera.height; y0 += rows) {
    const int band = std::min(rows, camera.height - y0);
    Control part = control;
    if (control.progress) {
      part.progress = [&](std::string_view what, double fraction) {
        control.Report(what, (y0 + fraction * band) / camera.height);
      };
    }
    const Frame fine =
        renderer->Render(scene, large.Cropped(0, y0 * n, large.width, band * n), single, part);
    out.stats += fine.stats;
    for (int y = 0; y < band; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        Pixel sum;
        for (int j = 0; j < n; ++j) {
          const Pixel* row =
              &fine.color[(static_cast<std::size_t>(y) * n + j) * fine.width + x * n];
          for (int i = 0; i < n; ++i) {
            sum.r += row[i].r;
            sum.g += row[i].g;
            sum.b += row[i].b;
            sum.a += row[i].a;
          }
        }
        const std::size_t to = static_cast<std::size_t>(y0 + y) * out.width + x;
        const std::size_t from =
            (static_cast<std::size_t>(y) * n + n / 2) * fine.width + x * n + n / 2;
        out.color[to] = {sum.r * weight, sum.g * weight, sum.b * weight, sum.a * weight};
        if (!out.depth.empty()) out.depth[to] = fine.depth[from];
        if (!out.normal.empty()) out.normal[to] = fine.normal[from];
        if (!out.id.empty()) out.id[to] = fine.id[from];
      }
    }
  }
  return out;
}

}  // namespace sherd
