// Shadows and ambient occlusion on whichever machine: rays in batches that the memory holds.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "cuda/device_tree.h"
#include "cuda/kernels/occlusion.h"
#include "cuda/machine.h"
#include "metaball/appearance/light_pass.h"
#include "metaball/appearance/light_view.h"
#include "metaball/cloud_version.h"
#include "metaball/control.h"
#include "metaball/error.h"
#include "metaball/scene.h"

namespace sherd {

// What the passes over a frame are told.
struct PassContext {
  const Scene& scene;
  bool in_doubles;  // floats cannot carry the scene
  int threads;      // of the host
  const Control& control;
  kernels::TraceCounts* counts;  // in the machine's memory
};

template <class Machine>
class OcclusionPass {
 public:
  // Bytes it may take for each sample, at most, besides its batches.
  static std::uint64_t BytesPerSample(const Scene& scene) {
    const Appearance& a = scene.appearance;
    std::uint64_t bytes = a.occlusion.enabled ? sizeof(float) : 0;
    if (a.shadows.enabled) bytes += std::max<std::size_t>(1, a.lights.size());
    return bytes;
  }
  // Bytes it takes for the scene's cloud.
  static std::uint64_t SceneBytes(const Scene& scene) {
    const Appearance& a = scene.appearance;
    const bool casts = a.shadows.enabled || a.occlusion.enabled;
    return casts ? DeviceTree<Machine>::BytesFor(scene.cloud->size()) : 0;
  }
  // Bytes of batches that do not make the work tedious, for so many samples.
  static std::uint64_t WantedBatchBytes(const Scene& scene, std::uint64_t samples) {
    const Appearance& a = scene.appearance;
    if (!a.shadows.enabled && !a.occlusion.enabled) return 0;
    constexpr std::uint64_t kPlenty = std::uint64_t{256} << 20;
    const int directions = a.occlusion.enabled ? a.occlusion.directions : 1;
    return std::min(kPlenty, samples * static_cast<std::uint64_t>(directions) * 2 * kBytesPerRay);
  }
  // Bytes that are held for batches, and may be given back between frames or their parts.
  std::uint64_t BatchBytes() const {
    return count_.bytes() + offset_.bytes() + occluded_.bytes() + entry_.bytes();
  }
  void ReleaseBatches(Machine* machine) {
    machine->Release(&count_);
    machine->Release(&offset_);
    machine->Release(&occluded_);
    machine->Release(&entry_);
  }

  // Casts the rays that the scene asks for. samples: of the picture; rays: all of a batch but what
  // it is about. Points `lights` at what they shine on and `view` at the ambient light's share.
  void Cast(const PassContext& context, const kernels::RayBatch& rays, std::uint64_t samples,
            std::vector<PreparedLight>* lights, LightView* view, Machine* machine) {
    const Scene& scene = context.scene;
    const Appearance& a = scene.appearance;
    if (!a.shadows.enabled && !a.occlusion.enabled) return;
    const auto casts = [&a](const PreparedLight& light) {
      return a.shadows.enabled && light.kind != PreparedLight::Kind::kViewer;
    };
    const std::vector<Vec3d> directions = AmbientDirections(a.occlusion);
    const auto casting = static_cast<std::uint64_t>(std::ranges::count_if(*lights, casts));
    if (casting == 0 && !a.occlusion.enabled) return;
    const SupportTreeView tree = tree_.Use(scene.cloud, rays.metaballs, context.threads, machine);
    machine->Resize(&visible_, casting * samples, "shadows");
    machine->Resize(&direction_, directions.size(), "directions");
    machine->Upload(&direction_, 0, directions.data(), directions.size());
    machine->Resize(&share_, a.occlusion.enabled ? samples : 0, "ambient light");
    // Half of what is left: two batches of different shapes may leave buffers that large.
    batch_room_ = (BatchBytes() + machine->AvailableBytes()) / 2;

    std::uint8_t* free = visible_.data();
    for (PreparedLight& light : *lights) {
      if (!casts(light)) continue;
      kernels::RayBatch batch = rays;
      batch.bias = a.shadows.bias;
      batch.light = ShadowLight::Of(light, scene.cloud->frame);
      light.visible = free;
      InBatches(context, batch, tree, samples, machine, [&](const kernels::RayBatch& part) {
        machine->ForEach("TakeVisible", part.count,
                         kernels::TakeVisible{part, occluded_.data(), free});
      });
      free += samples;
    }
    if (a.occlusion.enabled) {
      kernels::RayBatch batch = rays;
      batch.ambient = true;
      batch.bias = a.occlusion.bias;
      batch.direction = direction_.data();
      batch.directions = static_cast<int>(directions.size());
      batch.reach = ReachOf(scene);
      InBatches(context, batch, tree, samples, machine, [&](const kernels::RayBatch& part) {
        machine->ForEach("SumAmbient", part.count,
                         kernels::SumAmbient{part, occluded_.data(), share_.data()});
      });
      view->ambient_share = share_.data();
    }
  }

  void Release(Machine* machine) {
    tree_.Release(machine);
    machine->Release(&visible_);
    machine->Release(&share_);
    machine->Release(&direction_);
    ReleaseBatches(machine);
  }

 private:
  template <class T>
  using Buffer = typename Machine::template Buffer<T>;
  static constexpr std::uint64_t kMostRays = std::uint64_t{1} << 22;
  static constexpr std::uint64_t kBytesPerRay = 4 + 8 + 1;

  // AmbientReach, which goes through the whole cloud where no distance is given: once for each.
  double ReachOf(const Scene& scene) {
    if (scene.appearance.occlusion.distance > 0) return AmbientReach(scene);
    if (!reach_of_.Is(scene.cloud)) {
      reach_ = AmbientReach(scene);
      reach_of_ = CloudVersion(scene.cloud);
    }
    return reach_;
  }

  // Casts the batch's rays from all samples, part by part; finish(part) takes what came out.
  template <class Finish>
  void InBatches(const PassContext& context, const kernels::RayBatch& all,
                 const SupportTreeView& tree, std::uint64_t samples, Machine* machine,
                 const Finish& finish) {
    kernels::RayBatch part = all;
    std::uint64_t at_once = std::max<std::uint64_t>(1, kMostRays / all.directions);
    for (part.first = 0; part.first < samples; part.first += part.count) {
      for (part.count = std::min(at_once, samples - part.first);
           !CastPart(context, part, tree, machine); part.count = at_once) {
        context.control.ThrowIfStopped();
        if (part.count == 1) ThrowTooMany(machine);
        at_once = part.count / 2;  // and so for what follows
      }
      finish(part);
    }
  }

  // False where memory does not hold the batch.
  bool CastPart(const PassContext& context, const kernels::RayBatch& part,
                const SupportTreeView& tree, Machine* machine) {
    const std::uint64_t rays = part.rays();
    needed_ = (rays + 1) * kBytesPerRay;
    if (needed_ > batch_room_) return false;
    machine->Resize(&count_, rays + 1, "shadow rays");
    machine->Resize(&offset_, rays + 1, "shadow rays");
    machine->Resize(&occluded_, rays, "shadow rays");
    machine->ForEach("CountOnRays", rays + 1, kernels::CountOnRays{part, tree, count_.data()});
    machine->ExclusiveSum("scan of ray lists", count_, &offset_, rays + 1);
    std::uint64_t entries = 0;
    machine->DownloadRect(&entries, 1, offset_, rays, 1, 1, 1);
    needed_ += entries * sizeof(TileEntry);
    if (needed_ > batch_room_) return false;
    machine->Resize(&entry_, entries, "shadow rays");
    machine->ForEach("ListOnRays", rays,
                     kernels::ListOnRays{part, tree, offset_.data(), entry_.data(), count_.data()});
    March(context, part, machine);
    return true;
  }

  // The usual case for Murakami's density by itself; the rest, less often asked for, for any.
  void March(const PassContext& context, const kernels::RayBatch& part, Machine* machine) {
    using enum ThresholdMode;
    const DensityShape shape = ResolveDensity(context.scene.surface.density).shape;
    const auto launch = [&]<ThresholdMode kMode, class Real, class Shape>() {
      machine->ForEach(
          "MarchRays", part.rays(),
          kernels::MarchRays<kMode, Real, Shape>{part, shape, offset_.data(), count_.data(),
                                                 entry_.data(), occluded_.data(), context.counts});
    };
    switch (context.scene.surface.mode) {
      case kUniform:
        if (context.in_doubles) {
          launch.template operator()<kUniform, double, AnyShape>();
        } else if (shape == DensityShape{}) {
          launch.template operator()<kUniform, float, MurakamiShape>();
        } else {
          launch.template operator()<kUniform, float, AnyShape>();
        }
        break;
      case kBlended:
        launch.template operator()<kBlended, double, AnyShape>();
        break;
      case kSummed:
        launch.template operator()<kSummed, double, AnyShape>();
        break;
      case kGated:
        launch.template operator()<kGated, double, AnyShape>();
        break;
    }
  }

  [[noreturn]] void ThrowTooMany(Machine* machine) const {
    throw ResourceError("the shadow rays of a single pixel need " + Megabytes(needed_) + " of " +
                            machine->memory_name() + "; draw with fewer directions or on the CPU",
                        needed_, machine->AvailableBytes());
  }

  CloudVersion reach_of_;
  double reach_ = 0.0;
  std::uint64_t batch_room_ = 0;  // bytes
  std::uint64_t needed_ = 0;      // by the last batch
  DeviceTree<Machine> tree_;
  Buffer<std::uint8_t> visible_;  // by light and sample
  Buffer<float> share_;
  Buffer<Vec3d> direction_;
  // Of a batch.
  Buffer<std::uint32_t> count_;
  Buffer<std::uint64_t> offset_;
  Buffer<std::uint8_t> occluded_;
  Buffer<TileEntry> entry_;
};

}  // namespace sherd
