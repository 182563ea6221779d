// What the passes over a finished frame know of a hit, on the CPU and on the GPU.
#pragma once

#include <cstddef>

#include "metaball/camera.h"
#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd {

struct SurfaceHit {
  std::size_t pixel = 0;
  Vec3d position{};   // world
  Vec3d dx{}, dy{};   // to where the next pixel's rays (right, down) meet the tangent plane, world
  Vec3f normal{};     // the field's, unit
  Vec3f to_viewer{};  // unit
};

// From `position` to where the ray meets the tangent plane there; zero where that is too far away
// to mean anything. normal: unit; depth: of the position along its own ray, > 0.
SHERD_HD Vec3d AlongTangent(const RayD& ray, const Vec3d& position, const Vec3d& normal,
                            double depth) {
  // Rays that run along the plane would meet it at infinity: they are taken to come in at this
  // slope at least.
  constexpr double kLeastSlope = 0.02;
  const double slope = Dot(ray.direction, normal);
  const double away = Dot(position - ray.origin, normal);
  // Normals face the viewer, so the slope is negative.
  const double t = slope < -kLeastSlope ? away / slope : depth;
  const Vec3d offset = ray.origin + ray.direction * t - position;
  const double longest = depth / kLeastSlope;
  return Length(offset) < longest ? offset : Vec3d{};
}

// The hit of pixel (x, y). depth, normal: planes of a frame that is `width` pixels wide.
SHERD_HD SurfaceHit SurfaceHitAt(const Camera& camera, const float* depth, const Vec3f* normal,
                                 int width, int x, int y) {
  SurfaceHit point;
  point.pixel = static_cast<std::size_t>(y) * width + x;
  const double along = depth[point.pixel];
  const RayD ray = RayThrough(camera, x + 0.5, y + 0.5);
  point.position = ray.origin + ray.direction * along;
  point.normal = normal[point.pixel];
  point.to_viewer = (-ray.direction).cast<float>();
  const Vec3d n = point.normal.cast<double>();
  point.dx = AlongTangent(RayThrough(camera, x + 1.5, y + 0.5), point.position, n, along);
  point.dy = AlongTangent(RayThrough(camera, x + 0.5, y + 1.5), point.position, n, along);
  return point;
}

}  // namespace sherd
