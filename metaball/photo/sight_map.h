// Whether a photograph sees a place of the surface, on the CPU and on the GPU.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "metaball/camera.h"
#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd {

// How a photograph sees a place.
struct PhotoSight {
  // 0: something of the surface is in front of it; 1: nothing is. In between at the rim of
  // what is in front.
  float visible = 0;
  // 0: on an outline (the depth jumps here), 1: two pixels of the depth map from any.
  float inside = 0;
};

// The surface's depth as a photograph sees it. Row-major planes of the camera's size, which
// somebody else holds.
struct SightMap {
  Camera camera;
  const float* depth = nullptr;          // along the ray, world units; 0: nothing there
  const std::uint8_t* inside = nullptr;  // PhotoSight::inside * 255

  std::size_t pixels() const { return static_cast<std::size_t>(camera.width) * camera.height; }

  // `point`: on the iso-surface, world; normal: unit; tolerance: how far behind the surface still
  // counts as on it, world units. Without a map and outside of it nothing is known: visible 0.
  SHERD_HD PhotoSight At(const Vec3d& point, const Vec3f& normal, double tolerance) const {
    PhotoSight sight;
    double x = 0, y = 0;
    if (!depth || !camera.Project(point, &x, &y)) return sight;
    x -= 0.5;
    y -= 0.5;
    const double left = std::floor(x), top = std::floor(y);
    if (!(left >= 0 && top >= 0 && left + 1 < camera.width && top + 1 < camera.height)) {
      return sight;
    }
    const int x0 = static_cast<int>(left), y0 = static_cast<int>(top);
    const Vec3d way = point - camera.eye;
    const double distance = Length(way);
    // The surface's own slope over a pixel of the map.
    const double cosine = std::max(0.15, -Dot(way, normal.cast<double>()) / distance);
    const double pixel = camera.PixelSizeAt(Dot(way, camera.forward));
    const double limit = distance - tolerance - pixel * std::sqrt(1 / (cosine * cosine) - 1);
    const double fx = x - x0, fy = y - y0;
    for (int dy = 0; dy < 2; ++dy) {
      for (int dx = 0; dx < 2; ++dx) {
        const auto weight = static_cast<float>((dx ? fx : 1 - fx) * (dy ? fy : 1 - fy));
        const std::size_t i = static_cast<std::size_t>(y0 + dy) * camera.width + x0 + dx;
        if (depth[i] == 0 || depth[i] > limit) sight.visible += weight;
        sight.inside += weight * static_cast<float>(inside[i]) / 255;
      }
    }
    return sight;
  }
};

}  // namespace sherd
