// The planes beyond colour, depth, normal and id, on whichever machine: which kernels of
// kernels/gather.h are launched, and with what.
#pragma once

#include <cstddef>

#include "cuda/device_cloud.h"
#include "cuda/frame_buffers.h"
#include "cuda/kernels/gather.h"
#include "cuda/kernels/trace_params.h"
#include "metaball/appearance/gather.h"
#include "metaball/appearance/uv_gradients.h"
#include "metaball/frame.h"
#include "metaball/scene.h"

namespace sherd {

// After a trace with `params`, whose out_hit is there: fills the planes that Planes::NeedGather
// speaks of in `buffers`. tiles: of the picture.
template <class Machine>
void GatherPlanes(const Scene& scene, const Planes& planes, const kernels::TraceParams& params,
                  bool in_doubles, int tiles, DeviceCloud<Machine>* cloud,
                  FrameBuffers<Machine>* buffers, Machine* machine) {
  const bool gated = scene.surface.mode == ThresholdMode::kGated;
  const auto launch = [&](const char* name, const auto& gather) {
    using Gather = std::decay_t<decltype(gather)>;
    if (in_doubles) {
      machine->ForEachBlock(name, tiles,
                            kernels::GatherProgram<double, Gather>(params, gated, gather));
    } else {
      machine->ForEachBlock(name, tiles,
                            kernels::GatherProgram<float, Gather>(params, gated, gather));
    }
  };
  if (planes.weight || planes.intensity || planes.influence) {
    kernels::GatherField field;
    if (planes.weight) field.weight = buffers->weight.data();
    if (planes.intensity) field.intensity = buffers->intensity.data();
    if (planes.influence) field.influence = buffers->influence.data();
    field.amplitude = static_cast<float>(ResolveDensity(scene.surface.density).amplitude);
    launch("GatherField", field);
  }
  const Cloud& host = *scene.cloud;
  for (std::size_t k = 0; k < planes.channels.size(); ++k) {
    kernels::GatherChannel gather;
    gather.channel = cloud->View(ChannelNamed(host, planes.channels[k]), machine);
    gather.plane = buffers->channels[k].values.data();
    launch("GatherChannel", gather);
  }
  for (std::size_t k = 0; k < planes.uv.size(); ++k) {
    const std::string& name = planes.uv[k].channel;
    const auto gradient = [&](int axis) {
      const Channel* channel = host.FindChannel(UvGradientName(name, axis));
      return channel ? cloud->View(*channel, machine) : ChannelView{};
    };
    kernels::GatherUv gather;
    gather.channel.uv = cloud->View(UvChannelNamed(host, name), machine);
    gather.channel.du = gradient(0);
    gather.channel.dv = gradient(1);
    gather.channel.periodic = planes.uv[k].periodic;
    gather.channel.unit = static_cast<float>(host.frame.unit);
    gather.plane = buffers->uv[k].values.data();
    launch("GatherUv", gather);
  }
}

}  // namespace sherd
