// What is summed over the metaballs at a surface point for the planes beyond colour: the field and
// its kin, a channel of V (thesis 2.1.1, 3.1), coordinates in a texture. The renderers differ in
// how they come by the metaballs; what they add up stands here.
#pragma once

#include <cmath>
#include <cstdint>

#include "metaball/channel.h"
#include "metaball/frame.h"
#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd {

// F = sum f, sum f^2 / F (thesis 3.2) and sum (f / F) (p - c) / |p - c| (thesis 3.5).
struct FieldSums {
  float weight = 0.0f, squares = 0.0f;
  Vec3f direction{};

  // offset: point minus centre; f: the density over its amplitude, > 0.
  SHERD_HD void Add(const Vec3f& offset, float f) {
    weight += f;
    squares += f * f;
    // A point at the centre has no direction: it adds nothing.
    direction += Normalized(offset, Vec3f{}) * f;
  }
  // amplitude: of the density.
  SHERD_HD float Weight(float amplitude) const { return amplitude * weight; }
  SHERD_HD float Intensity(float amplitude) const { return amplitude * squares * Inverse(); }
  SHERD_HD Vec3f Influence() const { return direction * Inverse(); }

 private:
  SHERD_HD float Inverse() const { return weight != 0.0f ? 1.0f / weight : 0.0f; }
};

// sum (f / F) v of one channel.
struct ChannelSums {
  float weight = 0.0f;
  ChannelValue sum;

  SHERD_HD void Add(const ChannelValue& value, float f) {
    weight += f;
    for (int k = 0; k < 4; ++k) sum.v[k] += f * value.v[k];
  }
  SHERD_HD float Mean(int component) const {
    return sum.v[component] * (weight != 0.0f ? 1.0f / weight : 0.0f);
  }
};

// Coordinates in an image, and what a metaball knows of them.
struct UvChannel {
  ChannelView uv;      // two components
  ChannelView du, dv;  // gradients (uv_gradients.h); no bytes: not known
  bool periodic = false;
  float unit = 1.0f;  // world length of a local unit

  SHERD_HD bool know_gradients() const { return du.bytes && dv.bytes; }
};

// Coordinates at the point as one metaball sees them: its own, moved along its gradients.
struct UvSample {
  float u = 0.0f, v = 0.0f;
  Vec3f du{}, dv{};
  float reach_u = 0.0f, reach_v = 0.0f;  // how far they may vary over the metaball
};

// offset: point minus centre, inverse_radius: of the support; both local units.
SHERD_HD UvSample SampleUv(const UvChannel& channel, std::uint32_t metaball, const Vec3f& offset,
                           float inverse_radius) {
  const auto vector_of = [metaball](const ChannelView& view) {
    if (!view.bytes) return Vec3f{};
    const ChannelValue value = view.Get(metaball);
    return Vec3f{value.v[0], value.v[1], value.v[2]};
  };
  const ChannelValue uv = channel.uv.Get(metaball);
  const Vec3f in_world = offset * channel.unit;
  const float radius = channel.unit / inverse_radius;
  UvSample sample;
  sample.du = vector_of(channel.du);
  sample.dv = vector_of(channel.dv);
  sample.u = uv.v[0] + Dot(sample.du, in_world);
  sample.v = uv.v[1] + Dot(sample.dv, in_world);
  sample.reach_u = 0.5f * radius * Length(sample.du);
  sample.reach_v = 0.5f * radius * Length(sample.dv);
  return sample;
}

// Everything is blended as a difference from the strongest metaball's coordinates. Where these
// wrap, the difference is taken the short way round; metaballs on the far side of a seam between
// two charts of a texture, whose coordinates lie elsewhere in the image, take no part.
struct UvSums {
  UvSample base;  // of the strongest metaball
  float weight = 0.0f, u = 0.0f, v = 0.0f;
  Vec3f du{}, dv{};

  // f > 0.
  SHERD_HD void Add(const UvChannel& channel, const UvSample& sample, float f) {
    float difference_u = sample.u - base.u, difference_v = sample.v - base.v;
    if (channel.periodic) {
      difference_u -= roundf(difference_u);
      difference_v -= roundf(difference_v);
    }
    if (channel.know_gradients() && (fabsf(difference_u) > base.reach_u + sample.reach_u + 1e-6f ||
                                     fabsf(difference_v) > base.reach_v + sample.reach_v + 1e-6f)) {
      return;
    }
    weight += f;
    u += f * difference_u;
    v += f * difference_v;
    du += sample.du * f;
    dv += sample.dv * f;
  }
  // Zero where nothing was added.
  SHERD_HD SurfaceUv Mean() const {
    if (!(weight > 0.0f)) return {};
    return {base.u + u / weight, base.v + v / weight, du / weight, dv / weight};
  }
};

}  // namespace sherd
