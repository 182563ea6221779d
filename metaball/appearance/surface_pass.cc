#include "metaball/appearance/surface_pass.h"

#include <algorithm>
#include <cmath>

namespace sherd {
namespace {

// Where the ray meets the tangent plane, from the surface point. Rays that run along the plane
// would meet it at infinity: they are taken to come in at this slope at least.
constexpr double kLeastSlope = 0.02;

Vec3d AlongTangent(const RayD& ray, const Vec3d& position, const Vec3d& normal, double depth) {
  const double slope = Dot(ray.direction, normal);
  const double away = Dot(position - ray.origin, normal);
  // Normals face the viewer, so the slope is negative.
  const double t = slope < -kLeastSlope ? away / slope : depth;
  const Vec3d offset = ray.origin + ray.direction * t - position;
  const double longest = depth / kLeastSlope;
  return Length(offset) < longest ? offset : Vec3d{};
}

Vec3f Tangential(const Vec3f& v, const Vec3f& normal) {
  return Normalized(v - normal * Dot(v, normal), Vec3f{});
}

}  // namespace

SurfacePoint SurfacePointAt(const Camera& camera, const Frame& frame, int x, int y) {
  SurfacePoint point;
  point.pixel = static_cast<std::size_t>(y) * frame.width + x;
  const double depth = frame.depth[point.pixel];
  const RayD ray = RayThrough(camera, x + 0.5, y + 0.5);
  point.position = ray.origin + ray.direction * depth;
  point.normal = frame.normal[point.pixel];
  point.to_viewer = (-ray.direction).cast<float>();
  const Vec3d normal = point.normal.cast<double>();
  point.dx = AlongTangent(RayThrough(camera, x + 1.5, y + 0.5), point.position, normal, depth);
  point.dy = AlongTangent(RayThrough(camera, x + 0.5, y + 1.5), point.position, normal, depth);
  return point;
}

TexturePass::TexturePass(const TextureLookup& lookup, const Frame& frame) : lookup_(lookup) {
  for (const UvPlane& plane : frame.uv) {
    if (plane.channel == lookup.uv.channel) plane_ = &plane;
  }
}

void TexturePass::CoordinatesAt(const SurfacePoint& point, SurfaceUv* uv,
                                UvFootprint* footprint) const {
  if (lookup_.coordinates == TextureCoordinates::kChannel) {
    *uv = plane_->values[point.pixel];
    const Vec3f dx = point.dx.cast<float>(), dy = point.dy.cast<float>();
    *footprint = {Dot(uv->du, dx), Dot(uv->dv, dx), Dot(uv->du, dy), Dot(uv->dv, dy)};
    return;
  }
  const TextureProjection& projection = lookup_.projection;
  double u = 0, v = 0;
  projection.At(point.position, &u, &v);
  const auto difference = [&](const Vec3d& offset, float* du, float* dv) {
    double u1 = 0, v1 = 0;
    projection.At(point.position + offset, &u1, &v1);
    u1 -= u;
    v1 -= v;
    if (projection.wraps_u()) u1 -= std::round(u1);
    // Across the edge of a cube the image begins anew: no footprint is that large.
    if (projection.kind == ProjectionKind::kCubic && (std::abs(u1) > 0.5 || std::abs(v1) > 0.5)) {
      u1 = v1 = 0;
    }
    *du = static_cast<float>(u1);
    *dv = static_cast<float>(v1);
  };
  uv->u = static_cast<float>(u);
  uv->v = static_cast<float>(v);
  difference(point.dx, &footprint->dudx, &footprint->dvdx);
  difference(point.dy, &footprint->dudy, &footprint->dvdy);
}

Vec3f TexturePass::ColorAt(const SurfacePoint& point) const {
  SurfaceUv uv;
  UvFootprint footprint;
  CoordinatesAt(point, &uv, &footprint);
  const bool wraps = lookup_.coordinates == TextureCoordinates::kProjection
                         ? lookup_.projection.wraps_u()
                         : lookup_.uv.periodic;
  return lookup_.image->Sample(
      uv.u, uv.v, footprint, lookup_.repeat_u || wraps,
      lookup_.repeat_v ||
          (lookup_.coordinates == TextureCoordinates::kChannel && lookup_.uv.periodic));
}

Vec3f TexturePass::ValueAt(const SurfacePoint& point, Vec3f* along_u, Vec3f* along_v) const {
  if (lookup_.coordinates == TextureCoordinates::kChannel) {
    const SurfaceUv& uv = plane_->values[point.pixel];
    *along_u = Tangential(uv.du, point.normal);
    *along_v = Tangential(uv.dv, point.normal);
  } else {
    // Gradients of the projection, by differences over a length that is small beside its box.
    const TextureProjection& projection = lookup_.projection;
    const Vec3d& size = projection.size;
    const double step = 1e-4 * std::max({size.x, size.y, size.z});
    Vec3d gradient_u, gradient_v;
    double* const to_u[] = {&gradient_u.x, &gradient_u.y, &gradient_u.z};
    double* const to_v[] = {&gradient_v.x, &gradient_v.y, &gradient_v.z};
    const Vec3d axes[] = {{step, 0, 0}, {0, step, 0}, {0, 0, step}};
    for (int k = 0; k < 3; ++k) {
      double u0 = 0, v0 = 0, u1 = 0, v1 = 0;
      projection.At(point.position - axes[k], &u0, &v0);
      projection.At(point.position + axes[k], &u1, &v1);
      *to_u[k] = u1 - u0;
      *to_v[k] = v1 - v0;
      if (projection.wraps_u()) *to_u[k] -= std::round(*to_u[k]);
    }
    *along_u = Tangential(Normalized(gradient_u).cast<float>(), point.normal);
    *along_v = Tangential(Normalized(gradient_v).cast<float>(), point.normal);
  }
  return ColorAt(point);
}

NormalPass::NormalPass(const Appearance& appearance, const Frame& frame)
    : appearance_(appearance), frame_(frame), image_(appearance.normal_map.lookup, frame) {
  for (const ChannelPlane& plane : frame.channels) {
    if (plane.name == appearance.normal_map.channel) plane_ = &plane;
  }
}

Vec3f NormalPass::NormalAt(const SurfacePoint& point) const {
  Vec3f normal = point.normal;
  if (appearance_.normal == NormalSource::kInfluence) {
    normal = Normalized(frame_.influence[point.pixel], normal);
  }
  Vec3f map{};
  switch (appearance_.normal_map.source) {
    case NormalMapSource::kNone:
      return normal;
    case NormalMapSource::kChannel: {
      const float* v = &plane_->values[point.pixel * 3];
      map = {v[0], v[1], v[2]};
      break;
    }
    case NormalMapSource::kImage: {
      SurfacePoint at = point;
      at.normal = normal;
      Vec3f along_u, along_v;
      const Vec3f c = image_.ValueAt(at, &along_u, &along_v);
      const float z = std::max(2.0f * c.z - 1.0f, 0.0f);
      map = along_u * (2.0f * c.x - 1.0f) + along_v * (2.0f * c.y - 1.0f) + normal * z;
      break;
    }
  }
  if (!IsFinite(map)) return normal;
  // The half in (N_surface + N_map) / 2 falls out of the unit vector.
  return Normalized(normal + map, normal);
}

}  // namespace sherd
