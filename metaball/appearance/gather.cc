#include "metaball/appearance/gather.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "metaball/appearance/uv_gradients.h"
#include "metaball/density/shapes.h"
#include "metaball/error.h"

namespace sherd {
namespace {

// Coordinates at the point as one metaball sees them: its own, moved along its gradients.
struct UvSample {
  float u, v;
  Vec3f du, dv;
  float reach_u, reach_v;  // how far they may vary over the metaball
};

Vec3f VectorOf(const Channel* channel, std::uint32_t i) {
  if (!channel) return {};
  const ChannelValue value = channel->Get(i);
  return {value.v[0], value.v[1], value.v[2]};
}

}  // namespace

const Channel& ChannelNamed(const Cloud& cloud, const std::string& name) {
  if (const Channel* channel = cloud.FindChannel(name)) return *channel;
  std::string known;
  for (const Channel& channel : cloud.channels) {
    known += (known.empty() ? "" : ", ") + channel.name();
  }
  throw Error("the cloud has no channel '" + name + "'; " +
              (known.empty() ? "it has none" : "it has " + known));
}

std::vector<GatherSphere>& GatherScratch() {
  static thread_local std::vector<GatherSphere> spheres;
  spheres.clear();
  return spheres;
}

SurfaceGather::SurfaceGather(const Cloud& cloud, const Surface& surface, const Planes& planes,
                             Frame* frame)
    : cloud_(cloud),
      surface_(surface),
      density_(ResolveDensity(surface.density)),
      frame_(frame),
      unit_(static_cast<float>(cloud.frame.unit)) {
  const std::size_t n = frame->color.size();
  frame->channels.resize(planes.channels.size());
  for (std::size_t k = 0; k < planes.channels.size(); ++k) {
    const Channel& channel = ChannelNamed(cloud, planes.channels[k]);
    ChannelPlane& plane = frame->channels[k];
    plane.name = channel.name();
    plane.components = channel.components();
    plane.values.assign(n * static_cast<std::size_t>(plane.components), 0.0f);
    sources_.push_back({&channel, &plane});
  }
  if (planes.weight) frame->weight.assign(n, 0.0f);
  if (planes.intensity) frame->intensity.assign(n, 0.0f);
  if (planes.influence) frame->influence.assign(n, {});
  frame->uv.resize(planes.uv.size());
  for (std::size_t k = 0; k < planes.uv.size(); ++k) {
    const std::string& name = planes.uv[k].channel;
    UvSource source;
    source.uv = &ChannelNamed(cloud, name);
    if (source.uv->components() != 2) {
      throw Error("channel '" + name + "' cannot hold texture coordinates: it has " +
                  std::to_string(source.uv->components()) + " components, not 2");
    }
    source.du = cloud.FindChannel(UvGradientName(name, 0));
    source.dv = cloud.FindChannel(UvGradientName(name, 1));
    source.periodic = planes.uv[k].periodic;
    source.plane = &frame->uv[k];
    source.plane->channel = name;
    source.plane->values.assign(n, {});
    uv_sources_.push_back(source);
  }
}

float SurfaceGather::WeightAt(const Vec3f& point, const GatherSphere& sphere) const {
  const Vec3f offset = (point - sphere.center) * sphere.inverse_radius;
  return std::max(ShapeValue(density_.shape, Dot(offset, offset)), 0.0f);
}

GatherSphere SurfaceGather::OwnerOf(const Vec3f& point,
                                    const std::vector<GatherSphere>& spheres) const {
  GatherSphere owner = spheres[0];
  double highest = -INFINITY;
  for (const GatherSphere& sphere : spheres) {
    const double threshold =
        cloud_.threshold.empty() ? surface_.threshold : cloud_.threshold[sphere.idx];
    const double excess = density_.amplitude * WeightAt(point, sphere) - threshold;
    if (!(excess > highest)) continue;
    highest = excess;
    owner = sphere;
  }
  return owner;
}

void SurfaceGather::AtHit(std::size_t pixel, const Vec3f& point,
                          const std::vector<GatherSphere>& spheres) const {
  if (surface_.mode == ThresholdMode::kGated && !spheres.empty()) {
    Blend(pixel, point, {OwnerOf(point, spheres)});
  } else {
    Blend(pixel, point, spheres);
  }
}

void SurfaceGather::Blend(std::size_t pixel, const Vec3f& point,
                          const std::vector<GatherSphere>& spheres) const {
  const auto amplitude = static_cast<float>(density_.amplitude);
  float weight = 0.0f, squares = 0.0f;
  Vec3f influence{};
  for (const GatherSphere& sphere : spheres) {
    const Vec3f offset = point - sphere.center;
    const float f = WeightAt(point, sphere);
    if (f == 0.0f) continue;
    weight += f;
    squares += f * f;
    // A point at the centre has no direction: it adds nothing.
    influence += Normalized(offset, Vec3f{}) * f;
    for (const Source& source : sources_) {
      const ChannelValue value = source.channel->Get(sphere.idx);
      const int components = source.plane->components;
      float* sum = &source.plane->values[pixel * static_cast<std::size_t>(components)];
      for (int k = 0; k < components; ++k) sum[k] += f * value.v[k];
    }
  }
  const float inverse = weight != 0.0f ? 1.0f / weight : 0.0f;
  for (const Source& source : sources_) {
    const int components = source.plane->components;
    float* sum = &source.plane->values[pixel * static_cast<std::size_t>(components)];
    for (int k = 0; k < components; ++k) sum[k] *= inverse;
  }
  if (!frame_->weight.empty()) frame_->weight[pixel] = amplitude * weight;
  if (!frame_->intensity.empty()) frame_->intensity[pixel] = amplitude * squares * inverse;
  if (!frame_->influence.empty()) frame_->influence[pixel] = influence * inverse;
  for (const UvSource& source : uv_sources_) {
    source.plane->values[pixel] = BlendUv(source, point, spheres);
  }
}

SurfaceUv SurfaceGather::BlendUv(const UvSource& source, const Vec3f& point,
                                 const std::vector<GatherSphere>& spheres) const {
  const auto sample_of = [&](const GatherSphere& sphere) {
    const ChannelValue uv = source.uv->Get(sphere.idx);
    const Vec3f offset = (point - sphere.center) * unit_;
    const float radius = unit_ / sphere.inverse_radius;
    UvSample sample;
    sample.du = VectorOf(source.du, sphere.idx);
    sample.dv = VectorOf(source.dv, sphere.idx);
    sample.u = uv.v[0] + Dot(sample.du, offset);
    sample.v = uv.v[1] + Dot(sample.dv, offset);
    sample.reach_u = 0.5f * radius * Length(sample.du);
    sample.reach_v = 0.5f * radius * Length(sample.dv);
    return sample;
  };
  const GatherSphere* strongest = nullptr;
  float most = 0.0f;
  for (const GatherSphere& sphere : spheres) {
    const float f = WeightAt(point, sphere);
    if (f > most) {
      most = f;
      strongest = &sphere;
    }
  }
  SurfaceUv result;
  if (!strongest) return result;
  // Everything is blended as a difference from the strongest metaball's coordinates. Where these
  // wrap, the difference is taken the short way round; metaballs on the far side of a seam between
  // two charts of a texture, whose coordinates lie elsewhere in the image, take no part.
  const UvSample base = sample_of(*strongest);
  const bool know_gradients = source.du && source.dv;
  float weight = 0.0f, u = 0.0f, v = 0.0f;
  for (const GatherSphere& sphere : spheres) {
    const float f = WeightAt(point, sphere);
    if (!(f > 0.0f)) continue;
    const UvSample sample = sample_of(sphere);
    float difference_u = sample.u - base.u, difference_v = sample.v - base.v;
    if (source.periodic) {
      difference_u -= std::round(difference_u);
      difference_v -= std::round(difference_v);
    }
    if (know_gradients && (std::abs(difference_u) > base.reach_u + sample.reach_u + 1e-6f ||
                           std::abs(difference_v) > base.reach_v + sample.reach_v + 1e-6f)) {
      continue;
    }
    weight += f;
    u += f * difference_u;
    v += f * difference_v;
    result.du += sample.du * f;
    result.dv += sample.dv * f;
  }
  result.u = base.u + u / weight;
  result.v = base.v + v / weight;
  result.du = result.du / weight;
  result.dv = result.dv / weight;
  return result;
}

}  // namespace sherd
