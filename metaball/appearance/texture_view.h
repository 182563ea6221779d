// An image looked up at surface points, on the CPU and on the GPU.
#pragma once

#include <algorithm>
#include <cmath>

#include "metaball/appearance/appearance.h"
#include "metaball/appearance/image_view.h"
#include "metaball/appearance/projection.h"
#include "metaball/appearance/surface_hit.h"
#include "metaball/frame.h"
#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd {

// A TextureLookup (appearance.h) prepared for one frame.
struct TextureView {
  ImageView image;
  TextureCoordinates coordinates = TextureCoordinates::kProjection;
  const SurfaceUv* uv = nullptr;  // by pixel; for kChannel alone
  bool periodic = false;          // kChannel: both coordinates wrap at 1
  TextureProjection projection;   // for kProjection alone
  bool repeat_u = false, repeat_v = false;

  // Linear light.
  SHERD_HD Vec3f ColorAt(const SurfaceHit& point) const {
    float u = 0, v = 0;
    UvFootprint footprint;
    CoordinatesAt(point, &u, &v, &footprint);
    const bool own = coordinates == TextureCoordinates::kChannel;
    return image.Sample(u, v, footprint, repeat_u || (own ? periodic : projection.wraps_u()),
                        repeat_v || (own && periodic));
  }

  // The same, and the directions in which u and v grow along the surface: unit vectors orthogonal
  // to the normal; zero where they are not known.
  SHERD_HD Vec3f ValueAt(const SurfaceHit& point, Vec3f* along_u, Vec3f* along_v) const {
    if (coordinates == TextureCoordinates::kChannel) {
      *along_u = Tangential(uv[point.pixel].du, point.normal);
      *along_v = Tangential(uv[point.pixel].dv, point.normal);
    } else {
      // Gradients of the projection, by differences over a length that is small beside its box.
      const Vec3d& size = projection.size;
      const double step = 1e-4 * std::max(std::max(size.x, size.y), size.z);
      Vec3d gradient_u, gradient_v;
      DifferenceAlong(point.position, {step, 0, 0}, &gradient_u.x, &gradient_v.x);
      DifferenceAlong(point.position, {0, step, 0}, &gradient_u.y, &gradient_v.y);
      DifferenceAlong(point.position, {0, 0, step}, &gradient_u.z, &gradient_v.z);
      *along_u = Tangential(Normalized(gradient_u).cast<float>(), point.normal);
      *along_v = Tangential(Normalized(gradient_v).cast<float>(), point.normal);
    }
    return ColorAt(point);
  }

 private:
  // (u, v) and its changes along the two vectors to the next pixels.
  SHERD_HD void CoordinatesAt(const SurfaceHit& point, float* u, float* v,
                              UvFootprint* footprint) const {
    if (coordinates == TextureCoordinates::kChannel) {
      const SurfaceUv& at = uv[point.pixel];
      const Vec3f dx = point.dx.cast<float>(), dy = point.dy.cast<float>();
      *u = at.u;
      *v = at.v;
      *footprint = {Dot(at.du, dx), Dot(at.dv, dx), Dot(at.du, dy), Dot(at.dv, dy)};
      return;
    }
    double u0 = 0, v0 = 0;
    projection.At(point.position, &u0, &v0);
    *u = static_cast<float>(u0);
    *v = static_cast<float>(v0);
    ChangeTo(point.position + point.dx, u0, v0, &footprint->dudx, &footprint->dvdx);
    ChangeTo(point.position + point.dy, u0, v0, &footprint->dudy, &footprint->dvdy);
  }

  // From the coordinates (u0, v0) to those of `point`, the short way round.
  SHERD_HD void ChangeTo(const Vec3d& point, double u0, double v0, float* du, float* dv) const {
    double u1 = 0, v1 = 0;
    projection.At(point, &u1, &v1);
    u1 -= u0;
    v1 -= v0;
    if (projection.wraps_u()) u1 -= std::round(u1);
    // Across the edge of a cube the image begins anew: no footprint is that large.
    if (projection.kind == ProjectionKind::kCubic && (std::abs(u1) > 0.5 || std::abs(v1) > 0.5)) {
      u1 = v1 = 0;
    }
    *du = static_cast<float>(u1);
    *dv = static_cast<float>(v1);
  }

  // From `step` before the point to `step` behind it.
  SHERD_HD void DifferenceAlong(const Vec3d& point, const Vec3d& step, double* du,
                                double* dv) const {
    double u0 = 0, v0 = 0, u1 = 0, v1 = 0;
    projection.At(point - step, &u0, &v0);
    projection.At(point + step, &u1, &v1);
    *du = u1 - u0;
    *dv = v1 - v0;
    if (projection.wraps_u()) *du -= std::round(*du);
  }

  static SHERD_HD Vec3f Tangential(const Vec3f& v, const Vec3f& normal) {
    return Normalized(v - normal * Dot(v, normal), Vec3f{});
  }
};

}  // namespace sherd
