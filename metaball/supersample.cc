#include "metaball/supersample.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <utility>

#include "metaball/error.h"

namespace sherd {
namespace {

constexpr int kLargestSide = 1 << 19;           // tile indices are 16 bits wide
constexpr std::int64_t kBandPixels = 16 << 20;  // of the enlarged picture, rendered at once

bool Finite(double v) { return std::isfinite(v); }

// The further planes of a band of the enlarged picture: each pixel takes the sample nearest its
// centre. y0: the band's first row in `out`.
void TakeMiddleSamples(const Frame& fine, int n, int y0, Frame* out) {
  const auto take = [&](const auto& from, auto* to, std::size_t components) {
    if (from.empty()) return;
    to->resize(static_cast<std::size_t>(out->width) * out->height * components);
    for (int y = 0; y < fine.height / n; ++y) {
      for (int x = 0; x < out->width; ++x) {
        const std::size_t source =
            (static_cast<std::size_t>(y) * n + n / 2) * fine.width + x * n + n / 2;
        const std::size_t target = static_cast<std::size_t>(y0 + y) * out->width + x;
        std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(source * components), components,
                    to->begin() + static_cast<std::ptrdiff_t>(target * components));
      }
    }
  };
  take(fine.weight, &out->weight, 1);
  take(fine.intensity, &out->intensity, 1);
  take(fine.influence, &out->influence, 1);
  out->uv.resize(fine.uv.size());
  for (std::size_t k = 0; k < fine.uv.size(); ++k) {
    out->uv[k].channel = fine.uv[k].channel;
    take(fine.uv[k].values, &out->uv[k].values, 1);
  }
  out->channels.resize(fine.channels.size());
  for (std::size_t k = 0; k < fine.channels.size(); ++k) {
    out->channels[k].name = fine.channels[k].name;
    out->channels[k].components = fine.channels[k].components;
    take(fine.channels[k].values, &out->channels[k].values,
         static_cast<std::size_t>(fine.channels[k].components));
  }
}

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
  ResolveDensity(scene.surface.density);
  if (scene.surface.mode == ThresholdMode::kBlended && !IsNonNegative(scene.surface.density)) {
    throw Error("blended thresholds need a density that is nowhere negative");
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

Frame MakeFrame(const Camera& camera, const Planes& planes, Frame spare, FrameContent content) {
  Frame frame;
  frame.width = camera.width;
  frame.height = camera.height;
  const std::size_t n = static_cast<std::size_t>(camera.width) * camera.height;
  const auto make = [&](bool wanted, auto background, auto* old, auto* plane) {
    if (wanted && old->capacity() >= n) *plane = std::move(*old);
    *old = {};  // too small, or not needed: not held beside the new one
    if (!wanted) return;
    if (content == FrameContent::kAnything) {
      plane->resize(n);
    } else {
      plane->assign(n, background);
    }
  };
  try {
    make(true, Pixel{}, &spare.color, &frame.color);
    make(planes.depth, 0.0f, &spare.depth, &frame.depth);
    make(planes.normal, Vec3f{}, &spare.normal, &frame.normal);
    make(planes.id, -1, &spare.id, &frame.id);
    make(planes.light, Vec3f{}, &spare.light, &frame.light);
  } catch (const std::bad_alloc&) {
    const std::size_t bytes = n * planes.BytesPerPixel();
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
    if (settings.planes.NeedGather()) TakeMiddleSamples(fine, n, y0, &out);
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
        if (!out.light.empty()) out.light[to] = fine.light[from];
      }
    }
  }
  return out;
}

}  // namespace sherd
