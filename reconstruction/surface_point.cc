#include "reconstruction/surface_point.h"

#include <algorithm>
#include <cmath>

#include "metaball/density/shapes.h"

namespace sherd {
namespace {

// Supports are taken as so many times as wide as the field's: the sheet of many metaballs follows
// less of the noise of each.
constexpr float kWidening = 1.4f;

}  // namespace

SurfaceSampler::SurfaceSampler(const Cloud& cloud) : index_(cloud, 0.0f, kWidening) {}

void SurfaceSampler::Sample(const Level& level, const Vec3d& hit, const Vec3d& ray, std::int32_t id,
                            const Vec3f& shading_normal, SurfacePoint* out) const {
  const Cloud& cloud = level.cloud;
  const bool normals = level.normal.size() == cloud.size();
  const bool depths = level.depth.size() == cloud.size();
  const bool lists = level.photo_begin.size() == cloud.size() + 1;
  const Vec3f local = cloud.frame.LocalFromWorld(hit).cast<float>();
  out->photos.clear();
  Vec3f normal{};
  float height = 0, total = 0;
  const auto add = [&](std::uint32_t i, float weight) {
    total += weight;
    if (normals) {
      // Metaballs of the sheet behind, whose normals look away, have no say in where this one is.
      const Vec3f& n = level.normal[i];
      const float facing = Dot(n, shading_normal);
      if (facing > 0) {
        normal += n * (weight * facing);
        const float depth = depths ? level.depth[i] / static_cast<float>(cloud.frame.unit) : 0.0f;
        height += weight * facing * (Dot(n, local - cloud.center[i]) - depth);
      }
    }
    if (!lists) return;
    for (std::uint32_t j = level.photo_begin[i]; j < level.photo_begin[i + 1]; ++j) {
      const std::uint16_t photo = level.photo_idx[j];
      auto known = std::find_if(out->photos.begin(), out->photos.end(),
                                [&](const auto& share) { return share.photo == photo; });
      if (known == out->photos.end()) {
        out->photos.push_back({photo, weight});
      } else {
        known->weight += weight;
      }
    }
  };
  const SupportIndex::Range range = index_.At(local);
  for (const std::uint32_t* i = range.begin; i != range.end; ++i) {
    const Vec3f d = local - cloud.center[*i];
    const float r = kWidening * cloud.RadiusOf(*i);
    const float u = Dot(d, d) / (r * r);
    if (u < 1) add(*i, ShapeValue(DensityShape{}, u));
  }
  // Radii scaled up since the level was built may leave a hit outside every support of ours.
  if (!(total > 0) && id >= 0 && static_cast<std::size_t>(id) < cloud.size()) {
    add(static_cast<std::uint32_t>(id), 1.0f);
  }
  for (auto& share : out->photos) share.weight /= total;

  out->position = hit;
  out->normal = Normalized(normal, shading_normal);
  const float facing_total = Length(normal);
  if (facing_total > 0) {
    // Along the viewing ray, so that every pixel keeps its own ray; at grazing angles no farther
    // than three times the height.
    const double sheet = height / facing_total;
    const double cosine = std::max(-Dot(out->normal.cast<double>(), ray), 1.0 / 3);
    out->position = hit + ray * (sheet * cloud.frame.unit / cosine);
  }
}

}  // namespace sherd
