// What the metaballs say about a point of their surface, on the CPU and on the GPU: where the sheet
// lies that they stand for, and which photographs see them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "metaball/cloud.h"
#include "metaball/density/shapes.h"
#include "metaball/hostdevice.h"
#include "metaball/support_index.h"
#include "metaball/vec.h"

namespace sherd {

struct SheetPoint {
  Vec3d position{};  // world
  Vec3f normal{};    // unit, world
};

// Arrays that somebody else holds, an entry for each of `count` metaballs.
struct SheetView {
  // Supports are taken as so many times as wide as the field's: the sheet of many metaballs follows
  // less of the noise of each.
  static constexpr float kWidening = 1.4f;

  LocalFrame frame;
  std::uint32_t count = 0;
  const Vec3f* center = nullptr;  // local
  const float* radius = nullptr;  // local; null: uniform_radius
  float uniform_radius = 0;
  const Vec3f* normal = nullptr;  // unit, world; null: not known
  // How far each centre lies below the point that it stands for, against its normal, world units;
  // null: the centres are those points.
  const float* depth = nullptr;
  // The photographs that see metaball i: photo_idx[photo_begin[i] .. photo_begin[i + 1]). Null: not
  // known.
  const std::uint32_t* photo_begin = nullptr;
  const std::uint16_t* photo_idx = nullptr;
  SupportIndexView index;  // of supports kWidening times as wide

  SHERD_HD float RadiusOf(std::uint32_t i) const { return radius ? radius[i] : uniform_radius; }

  // Calls visit(i, weight) for the metaballs that have a say at a hit, in ascending order; id: the
  // hit's strongest metaball.
  template <class Visit>
  SHERD_HD void ForEachAt(const Vec3d& hit, std::int32_t id, const Visit& visit) const {
    const Vec3f local = frame.LocalFromWorld(hit).cast<float>();
    const SupportIndexView::Range range = index.At(local);
    bool any = false;
    for (const std::uint32_t* i = range.begin; i != range.end; ++i) {
      const Vec3f d = local - center[*i];
      const float r = kWidening * RadiusOf(*i);
      const float d2 = Dot(d, d), r2 = r * r;
      if (!(d2 < r2)) continue;
      const float weight = ShapeValue(DensityShape{}, d2 / r2);
      any = any || weight > 0;
      visit(*i, weight);
    }
    // Radii scaled up since the level was built may leave a hit outside every support of ours.
    if (!any && id >= 0 && static_cast<std::uint32_t>(id) < count) {
      visit(static_cast<std::uint32_t>(id), 1.0f);
    }
  }

  // hit: a point of the field's surface, world; ray: unit direction it was found along; id: its
  // strongest metaball; shading_normal: of the field, unit. also(i, weight) is called as ForEachAt
  // does.
  template <class Also>
  SHERD_HD SheetPoint PointAt(const Vec3d& hit, const Vec3d& ray, std::int32_t id,
                              const Vec3f& shading_normal, const Also& also) const {
    const Vec3f local = frame.LocalFromWorld(hit).cast<float>();
    Vec3f sum{};
    float height = 0;
    ForEachAt(hit, id, [&](std::uint32_t i, float weight) {
      also(i, weight);
      if (!normal) return;
      // Metaballs of the sheet behind, whose normals look away, have no say in where this one is.
      const Vec3f n = normal[i];
      const float facing = Dot(n, shading_normal);
      if (!(facing > 0)) return;
      sum += n * (weight * facing);
      const float below = depth ? depth[i] / static_cast<float>(frame.unit) : 0.0f;
      height += weight * facing * (Dot(n, local - center[i]) - below);
    });
    SheetPoint out{hit, Normalized(sum, shading_normal)};
    const float facing_total = Length(sum);
    if (facing_total > 0) {
      // Along the viewing ray, so that every pixel keeps its own ray; at grazing angles no farther
      // than three times the height.
      const double sheet = height / facing_total;
      const double cosine = std::max(-Dot(out.normal.cast<double>(), ray), 1.0 / 3);
      out.position = hit + ray * (sheet * frame.unit / cosine);
    }
    return out;
  }

  // The share of the weights at a hit that metaballs have which the photograph sees; 0 where
  // nothing is known.
  SHERD_HD float ShareOf(std::uint32_t photo, const Vec3d& hit, std::int32_t id) const {
    if (!photo_begin) return 0;
    float total = 0, seen = 0;
    ForEachAt(hit, id, [&](std::uint32_t i, float weight) {
      total += weight;
      for (std::uint32_t j = photo_begin[i]; j < photo_begin[i + 1]; ++j) {
        if (photo_idx[j] == photo) seen += weight;
      }
    });
    return seen > 0 ? seen / total : 0;
  }
};

}  // namespace sherd
