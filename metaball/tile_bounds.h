// Which pixels a metaball's support can touch: conservative bounds of a sphere's picture.
#pragma once

#include "metaball/camera.h"
#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd {

// A camera in a cloud's local units, in the form the per-metaball code wants.
struct ViewF {
  bool orthographic = false;
  Vec3d eye{};  // local units, double: subtracted before rounding to float
  Vec3f right{}, down{}, forward{};
  float fx = 1, fy = 1, cx = 0, cy = 0;  // pixels (orthographic: pixels per local unit)
  int width = 0, height = 0;
};

// Half-open pixel ranges; empty when x0 >= x1.
struct PixelBox {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  SHERD_HD bool empty() const { return x0 >= x1 || y0 >= y1; }
};

enum class TangentCone { kBounded, kNone };

// The slopes x / z between which a circle (x, z; radius) is seen from the origin looking along +z;
// infinite where it reaches behind. kNone: all of it lies behind. The tangents are the direction to
// the centre turned by the angle whose sine is radius / distance; no cancellation.
SHERD_HD TangentCone TangentSlopes(float x, float z, float radius, float* lo, float* hi) {
  const float tangent2 = x * x + z * z - radius * radius;
  *lo = -INFINITY;
  *hi = INFINITY;
  if (!(tangent2 > 0.0f)) return z + radius > 0.0f ? TangentCone::kBounded : TangentCone::kNone;
  const float tangent = sqrtf(tangent2);
  const float lo_sin = x * tangent - z * radius, lo_cos = z * tangent + x * radius;
  const float hi_sin = x * tangent + z * radius, hi_cos = z * tangent - x * radius;
  if (lo_cos > 0.0f) {
    *lo = lo_sin / lo_cos;
  } else if (lo_sin > 0.0f) {
    return TangentCone::kNone;
  }
  if (hi_cos > 0.0f) {
    *hi = hi_sin / hi_cos;
  } else if (hi_sin < 0.0f) {
    return TangentCone::kNone;
  }
  return TangentCone::kBounded;
}

SHERD_HD int ClampedFloor(float v, int lo, int hi) {
  if (!(v > static_cast<float>(lo))) return lo;
  if (v >= static_cast<float>(hi)) return hi;
  return static_cast<int>(v);  // v > lo >= 0: truncation is floor
}

// Pixels whose centres' rays can meet the sphere, and a lower bound of the distance at which they
// do
// (`front`, may be negative). Errs on the side of too many pixels by about a tenth of one.
SHERD_HD PixelBox BoundsOfSphere(const ViewF& view, const Vec3f& center, float radius,
                                 float* front) {
  const Vec3f v = {static_cast<float>(center.x - view.eye.x),
                   static_cast<float>(center.y - view.eye.y),
                   static_cast<float>(center.z - view.eye.z)};
  const float x = Dot(v, view.right);
  const float y = Dot(v, view.down);
  const float z = Dot(v, view.forward);
  const PixelBox none;
  if (!(z + radius > 0.0f)) return none;
  float x_lo, x_hi, y_lo, y_hi;
  if (view.orthographic) {
    *front = z - radius - 1e-6f * (fabsf(z) + radius);
    x_lo = x - radius;
    x_hi = x + radius;
    y_lo = y - radius;
    y_hi = y + radius;
  } else {
    const float distance = sqrtf(Dot(v, v));
    *front = distance - radius;
    *front -= 1e-6f * (distance + radius);
    if (z > 2.0f * radius) {
      // The same slopes as the roots of their quadratic: all in front, they are far from its pole.
      const float z2_r2 = z * z - radius * radius, inverse = 1.0f / z2_r2;
      const float x_tangent = radius * sqrtf(x * x + z2_r2),
                  y_tangent = radius * sqrtf(y * y + z2_r2);
      x_lo = (x * z - x_tangent) * inverse;
      x_hi = (x * z + x_tangent) * inverse;
      y_lo = (y * z - y_tangent) * inverse;
      y_hi = (y * z + y_tangent) * inverse;
    } else if (TangentSlopes(x, z, radius, &x_lo, &x_hi) == TangentCone::kNone ||
               TangentSlopes(y, z, radius, &y_lo, &y_hi) == TangentCone::kNone) {
      return none;
    }
  }
  // A relative allowance for rounding in wide pictures, and an absolute one.
  const float slack_x = 0.1f + 2e-6f * static_cast<float>(view.width);
  const float slack_y = 0.1f + 2e-6f * static_cast<float>(view.height);
  const float px0 = view.fx * x_lo + view.cx - 0.5f - slack_x;
  const float px1 = view.fx * x_hi + view.cx - 0.5f + slack_x;
  const float py0 = view.fy * y_lo + view.cy - 0.5f - slack_y;
  const float py1 = view.fy * y_hi + view.cy - 0.5f + slack_y;
  if (px1 < 0.0f || py1 < 0.0f || px0 > static_cast<float>(view.width - 1) ||
      py0 > static_cast<float>(view.height - 1)) {
    return none;
  }
  return {ClampedFloor(px0, 0, view.width - 1), ClampedFloor(py0, 0, view.height - 1),
          ClampedFloor(px1, 0, view.width - 1) + 1, ClampedFloor(py1, 0, view.height - 1) + 1};
}

}  // namespace sherd
