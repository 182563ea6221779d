#include "metaball/appearance/gather.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "metaball/appearance/uv_gradients.h"
#include "metaball/density/shapes.h"
#include "metaball/error.h"

namespace sherd {

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

void AllocateGatherPlanes(const Cloud& cloud, const Planes& planes, Frame* frame) {
  const std::size_t n = frame->color.size();
  frame->channels.resize(planes.channels.size());
  for (std::size_t k = 0; k < planes.channels.size(); ++k) {
    const Channel& channel = ChannelNamed(cloud, planes.channels[k]);
    ChannelPlane& plane = frame->channels[k];
    plane.name = channel.name();
    plane.components = channel.components();
    plane.values.assign(n * static_cast<std::size_t>(plane.components), 0.0f);
  }
  if (planes.weight) frame->weight.assign(n, 0.0f);
  if (planes.intensity) frame->intensity.assign(n, 0.0f);
  if (planes.influence) frame->influence.assign(n, {});
  frame->uv.resize(planes.uv.size());
  for (std::size_t k = 0; k < planes.uv.size(); ++k) {
    UvChannelNamed(cloud, planes.uv[k].channel);
    frame->uv[k].channel = planes.uv[k].channel;
    frame->uv[k].values.assign(n, {});
  }
}

const Channel& UvChannelNamed(const Cloud& cloud, const std::string& name) {
  const Channel& channel = ChannelNamed(cloud, name);
  if (channel.components() == 2) return channel;
  throw Error("channel '" + name + "' cannot hold texture coordinates: it has " +
              std::to_string(channel.components()) + " components, not 2");
}

SurfaceGather::SurfaceGather(const Cloud& cloud, const Surface& surface, const Planes& planes,
                             Frame* frame)
    : cloud_(cloud), surface_(surface), density_(ResolveDensity(surface.density)), frame_(frame) {
  AllocateGatherPlanes(cloud, planes, frame);
  for (std::size_t k = 0; k < planes.channels.size(); ++k) {
    sources_.push_back({ChannelNamed(cloud, planes.channels[k]).view(), &frame->channels[k]});
  }
  for (std::size_t k = 0; k < planes.uv.size(); ++k) {
    const std::string& name = planes.uv[k].channel;
    const auto view_of = [&](int axis) {
      const Channel* gradient = cloud.FindChannel(UvGradientName(name, axis));
      return gradient ? gradient->view() : ChannelView{};
    };
    uv_sources_.push_back({{UvChannelNamed(cloud, name).view(), view_of(0), view_of(1),
                            planes.uv[k].periodic, static_cast<float>(cloud.frame.unit)},
                           &frame->uv[k]});
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
  FieldSums field;
  for (const GatherSphere& sphere : spheres) {
    const float f = WeightAt(point, sphere);
    if (f != 0.0f) field.Add(point - sphere.center, f);
  }
  const auto amplitude = static_cast<float>(density_.amplitude);
  if (!frame_->weight.empty()) frame_->weight[pixel] = field.Weight(amplitude);
  if (!frame_->intensity.empty()) frame_->intensity[pixel] = field.Intensity(amplitude);
  if (!frame_->influence.empty()) frame_->influence[pixel] = field.Influence();
  for (const Source& source : sources_) {
    ChannelSums sums;
    for (const GatherSphere& sphere : spheres) {
      const float f = WeightAt(point, sphere);
      if (f != 0.0f) sums.Add(source.channel.Get(sphere.idx), f);
    }
    const auto components = static_cast<std::size_t>(source.plane->components);
    for (std::size_t k = 0; k < components; ++k) {
      source.plane->values[pixel * components + k] = sums.Mean(static_cast<int>(k));
    }
  }
  for (const UvSource& source : uv_sources_) {
    source.plane->values[pixel] = BlendUv(source.channel, point, spheres);
  }
}

SurfaceUv SurfaceGather::BlendUv(const UvChannel& channel, const Vec3f& point,
                                 const std::vector<GatherSphere>& spheres) const {
  const auto sample_of = [&](const GatherSphere& sphere) {
    return SampleUv(channel, sphere.idx, point - sphere.center, sphere.inverse_radius);
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
  if (!strongest) return {};
  UvSums sums;
  sums.base = sample_of(*strongest);
  for (const GatherSphere& sphere : spheres) {
    const float f = WeightAt(point, sphere);
    if (f > 0.0f) sums.Add(channel, sample_of(sphere), f);
  }
  return sums.Mean();
}

}  // namespace sherd
