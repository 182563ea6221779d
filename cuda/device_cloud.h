// The cloud in the machine's memory: what the kernels read of it, and no more than the scenes drawn
// so far have asked for. Brought over once; of a cloud that moves, the parts that have changed.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "cuda/kernels/binning.h"
#include "cuda/kernels/packed_color.h"
#include "cuda/kernels/trace_params.h"
#include "metaball/appearance/uv_gradients.h"
#include "metaball/channel.h"
#include "metaball/cloud.h"
#include "metaball/density/model.h"
#include "metaball/frame.h"
#include "metaball/precision.h"
#include "metaball/scene.h"

namespace sherd {

template <class Machine>
class DeviceCloud {
 public:
  // Whether `cloud` is the one held, changed or not.
  bool Holds(const std::shared_ptr<const Cloud>& cloud) const {
    return cloud_.lock() == cloud && size_ == cloud->size();
  }

  // Whether nobody else holds it any more.
  bool Expired() const { return cloud_.expired(); }

  // Makes the scene's cloud the one that is held: centres, radii, colours, and thresholds where the
  // scene's mode asks for them. Throws ResourceError where the machine has no room.
  void Use(const Scene& scene, int threads, Machine* machine) {
    const std::shared_ptr<const Cloud>& cloud = scene.cloud;
    const bool same = Holds(cloud);
    const CloudRevisions before = revisions_;
    const CloudRevisions& now = cloud->revisions;
    if (!same) Forget(machine);
    const bool own_threshold =
        scene.surface.mode != ThresholdMode::kUniform && !cloud->threshold.empty();
    if (same && before == now && own_threshold <= (threshold_.size() > 0)) return;
    // Until all is there, nothing is held: what fails half way is brought over anew.
    cloud_.reset();
    const std::size_t n = cloud->size();
    if (!same || before.frame != now.frame || before.positions != now.positions ||
        before.radii != now.radii) {
      machine->Fill(&sphere_, n, threads, "metaballs", [&](std::size_t i) {
        const Vec3f& c = cloud->center[i];
        return kernels::Sphere{c.x, c.y, c.z, cloud->RadiusOf(i)};
      });
      wide_radii_ = HasWideRadii(*cloud);
    }
    if (!same || before.colors != now.colors) {
      machine->Fill(&color_, cloud->color.size(), threads, "colours",
                    [&](std::size_t i) { return kernels::PackColor(cloud->color[i]); });
    }
    if (own_threshold && (threshold_.size() == 0 || before.thresholds != now.thresholds)) {
      machine->ResizeExactly(&threshold_, n, "thresholds");
      machine->Upload(&threshold_, 0, cloud->threshold.data(), n);
    } else if (before.thresholds != now.thresholds) {
      machine->Release(&threshold_);
    }
    if (before.channels != now.channels) ForgetChannels(machine);
    cloud_ = cloud;
    size_ = n;
    revisions_ = now;
  }

  // A channel of the cloud that is held, brought over when it is first asked for.
  ChannelView View(const Channel& channel, Machine* machine) {
    Buffer<std::byte>& bytes = channels_[channel.name()];
    if (bytes.size() != channel.bytes().size()) {
      machine->ResizeExactly(&bytes, channel.bytes().size(), "channels");
      machine->Upload(&bytes, 0, channel.bytes().data(), channel.bytes().size());
    }
    ChannelView view = channel.view();
    view.bytes = bytes.data();
    return view;
  }

  // What the kernels read of a scene whose cloud is held.
  kernels::MetaballArrays Metaballs(const Scene& scene) const {
    const ResolvedDensity density = ResolveDensity(scene.surface.density);
    kernels::MetaballArrays m;
    m.sphere = sphere_.data();
    m.radius_scale = scene.surface.radius_scale * density.support;
    m.count = static_cast<std::uint32_t>(size_);
    const bool own_threshold = scene.surface.mode != ThresholdMode::kUniform;
    m.threshold = own_threshold && threshold_.size() > 0 ? threshold_.data() : nullptr;
    m.uniform_threshold = scene.surface.threshold;
    m.threshold_scale = 1.0 / density.amplitude;
    return m;
  }
  const std::uint32_t* colors() const { return color_.size() > 0 ? color_.data() : nullptr; }
  std::size_t size() const { return size_; }
  // Whether floats cannot carry its radii (metaball/precision.h).
  bool wide_radii() const { return wide_radii_; }

  std::uint64_t Bytes() const {
    std::uint64_t bytes = sphere_.bytes() + color_.bytes() + threshold_.bytes();
    for (const auto& [name, channel] : channels_) bytes += channel.bytes();
    return bytes;
  }
  // Of the channels that the planes ask for and nothing has asked for yet.
  std::uint64_t MissingBytes(const Cloud& cloud, const Planes& planes) const {
    std::uint64_t bytes = 0;
    const auto add = [&](const std::string& name) {
      const Channel* channel = cloud.FindChannel(name);
      const auto held = channels_.find(name);
      if (channel && (held == channels_.end() || held->second.size() == 0)) {
        bytes += channel->bytes().size();
      }
    };
    for (const std::string& name : NamesOf(planes)) add(name);
    return bytes;
  }
  // Gives the channels back that the planes do not ask for.
  void ReleaseChannelsBut(const Planes& planes, Machine* machine) {
    const std::vector<std::string> kept = NamesOf(planes);
    for (auto it = channels_.begin(); it != channels_.end();) {
      if (std::find(kept.begin(), kept.end(), it->first) != kept.end()) {
        ++it;
      } else {
        machine->Release(&it->second);
        it = channels_.erase(it);
      }
    }
  }
  void Release(Machine* machine) {
    Forget(machine);
    machine->Release(&sphere_);
    machine->Release(&color_);
  }
  // What Use would take at most.
  static std::uint64_t BytesFor(const Cloud& cloud) {
    return cloud.size() * (sizeof(kernels::Sphere) + (cloud.color.empty() ? 0 : 4) +
                           (cloud.threshold.empty() ? 0 : 4));
  }

 private:
  template <class T>
  using Buffer = typename Machine::template Buffer<T>;

  static std::vector<std::string> NamesOf(const Planes& planes) {
    std::vector<std::string> names = planes.channels;
    for (const UvRequest& uv : planes.uv) {
      names.push_back(uv.channel);
      for (const int axis : {0, 1}) names.push_back(UvGradientName(uv.channel, axis));
    }
    return names;
  }

  void Forget(Machine* machine) {
    cloud_.reset();
    machine->Release(&threshold_);
    ForgetChannels(machine);
  }
  void ForgetChannels(Machine* machine) {
    for (auto& [name, bytes] : channels_) machine->Release(&bytes);
    channels_.clear();
  }

  // Weak: the renderer does not keep it alive, and a new one at the same address is not taken for
  // it.
  std::weak_ptr<const Cloud> cloud_;
  std::size_t size_ = 0;
  CloudRevisions revisions_;
  bool wide_radii_ = false;
  Buffer<kernels::Sphere> sphere_;
  Buffer<std::uint32_t> color_;
  Buffer<float> threshold_;
  std::map<std::string, Buffer<std::byte>> channels_;
};

}  // namespace sherd
