// A frame from a scene, on whichever machine: the order of the kernels, the buffers between them,
// and what happens when memory is short. Included by host_loop.cc and cuda_renderer.cu.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "cuda/device_cloud.h"
#include "cuda/frame_buffers.h"
#include "cuda/kernels/trace.h"
#include "cuda/kernels/trace_list.h"
#include "cuda/machine.h"
#include "cuda/surface_gather.h"
#include "cuda/tile_lists.h"
#include "metaball/appearance/gather.h"
#include "metaball/error.h"
#include "metaball/local_view.h"
#include "metaball/precision.h"
#include "metaball/renderer.h"
#include "metaball/supersample.h"

namespace sherd {

template <class Machine>
class FramePipeline {
 public:
  explicit FramePipeline(Machine machine) : machine_(std::move(machine)) {}

  Machine& machine() { return machine_; }
  const Machine& machine() const { return machine_; }
  const FrameWork& work() const { return work_; }

  // Renderer::Render, but for the names in the stats.
  Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
               const Control& control) {
    CheckRenderInput(scene, camera, settings);
    const auto begin = std::chrono::steady_clock::now();
    Frame frame = MakeFrame(camera, settings.planes);
    if (settings.planes.NeedGather()) AllocateGatherPlanes(*scene.cloud, settings.planes, &frame);
    frame.stats.metaballs = scene.cloud->size();
    const std::uint64_t samples = static_cast<std::uint64_t>(settings.supersample);
    frame.stats.rays = frame.color.size() * samples * samples;
    work_ = {};
    if (!scene.cloud->empty()) {
      control.ThrowIfStopped();
      machine_.BeginFrame(control.stop, settings.threads);
      const auto upload = std::chrono::steady_clock::now();
      UseCloud(scene, settings.threads);
      frame.stats.seconds_prepare = SecondsSince(upload);
      const RenderStats before = frame.stats;
      try {
        RenderAll(scene, camera, settings, control, &frame);
      } catch (const ResourceError&) {
        // Buffers of earlier frames, of other sizes, may hold what this one needs.
        ReleaseFrame();
        frame.stats = before;
        RenderAll(scene, camera, settings, control, &frame);
      }
      kernels::TraceCounts counts;
      machine_.Download(&counts, counts_, 1);
      using Counts = kernels::TraceCounts;
      frame.stats.hits = counts.rare[Counts::kHits];
      frame.stats.rays_started_inside = counts.rare[Counts::kStartedInside];
      frame.stats.grazing = counts.rare[Counts::kGrazing];
      frame.stats.unresolved = counts.rare[Counts::kUnresolved];
      work_ = {counts.work[Counts::kTests], counts.work[Counts::kAdds], counts.work[Counts::kSteps],
               counts.work[Counts::kShadeAdds], counts.rare[Counts::kWide]};
      frame.stats.bytes = machine_.ReservedBytes() - cloud_.Bytes();
      machine_.EndFrame();
    }
    frame.stats.seconds_total = SecondsSince(begin);
    return frame;
  }

 private:
  struct Job {
    const Scene& scene;
    const Camera& camera;
    const RenderSettings& settings;
    const Control& control;
    Frame* frame;
    std::uint64_t pixels_done = 0;
  };

  void RenderAll(const Scene& scene, const Camera& camera, const RenderSettings& settings,
                 const Control& control, Frame* frame) {
    machine_.Resize(&counts_, 1, "counters");
    machine_.Zero(&counts_, 1);
    Job job{scene, camera, settings, control, frame};
    RenderRegion(job, {0, 0, camera.width, camera.height});
  }

  // Gives back all but the cloud.
  void ReleaseFrame() {
    lists_.Release(&machine_);
    machine_.Release(&hit_);
    samples_.Release(&machine_);
    pixels_.Release(&machine_);
    machine_.ReleaseScratch();
    held_ = 0;
  }

  static double SecondsSince(std::chrono::steady_clock::time_point begin) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }

  void UseCloud(const Scene& scene, int threads) {
    const Cloud& cloud = *scene.cloud;
    if (!cloud_.Holds(scene.cloud)) {
      const std::uint64_t needed = DeviceCloud<Machine>::BytesFor(cloud) +
                                   cloud.size() * TileLists<Machine>::kBytesPerMetaball;
      const std::uint64_t available = machine_.AvailableBytes() + machine_.ReservedBytes();
      if (needed > available) {
        throw ResourceError(std::to_string(cloud.size()) + " metaballs need " + Megabytes(needed) +
                                " of " + machine_.memory_name() + ", of which " +
                                Megabytes(available) +
                                " are free; choose a level with fewer metaballs or the CPU",
                            needed, available);
      }
      if (needed > machine_.AvailableBytes()) ReleaseFrame();
    }
    cloud_.Use(scene, threads, &machine_);
  }

  static std::string Megabytes(std::uint64_t bytes) {
    return std::to_string((bytes >> 20) + 1) + " MB";
  }

  // ---- a region of the picture ----------------------------------------------------------------

  // Bytes a sample takes.
  static std::uint64_t BytesPerSample(const Planes& planes) {
    return planes.BytesPerPixel() + (planes.NeedGather() ? sizeof(double) : 0);
  }

  // Renders a region, or its halves where memory does not hold it at once.
  void RenderRegion(Job& job, const Region& region) {
    job.control.ThrowIfStopped();
    const int n = job.settings.supersample;
    const std::uint64_t fine_width = static_cast<std::uint64_t>(region.width) * n;
    const std::uint64_t fine_height = static_cast<std::uint64_t>(region.height) * n;
    const std::uint64_t pixels = static_cast<std::uint64_t>(region.width) * region.height;
    const std::uint64_t samples = pixels * n * n;
    const std::uint64_t tiles =
        (fine_width / kernels::kTileSize + 1) * (fine_height / kernels::kTileSize + 1);
    using Lists = TileLists<Machine>;
    const Planes& planes = job.settings.planes;
    std::uint64_t needed = cloud_.Bytes() + cloud_.size() * Lists::kBytesPerMetaball +
                           tiles * Lists::kBytesPerTile + samples * BytesPerSample(planes) +
                           (n > 1 ? pixels * planes.BytesPerPixel() : 0);
    // Sorting and scanning want a little room of their own.
    const auto fits = [&](std::uint64_t bytes) {
      if (bytes <= held_) return true;
      return bytes + bytes / 16 <= machine_.AvailableBytes() + machine_.ReservedBytes();
    };
    const bool addressable = fine_width <= kernels::kMaxRegionSide &&
                             fine_height <= kernels::kMaxRegionSide && tiles <= Lists::kMostEntries;
    if (addressable && fits(needed)) {
      const Camera view = job.camera.Resized(job.camera.width * n, job.camera.height * n)
                              .Cropped(region.x0 * n, region.y0 * n, static_cast<int>(fine_width),
                                       static_cast<int>(fine_height));
      const Camera local = LocalCamera(view, job.scene.cloud->frame);
      machine_.Mark(FrameStage::kBegin);
      const kernels::MetaballArrays metaballs = cloud_.Metaballs(job.scene);
      const kernels::BinTotals totals = lists_.Count(metaballs, local, &machine_);
      if (region.width == job.camera.width && region.height == job.camera.height) {
        job.frame->stats.metaballs_in_view = totals.in_view;
      }
      needed += totals.entries * Lists::kBytesPerEntry;
      if (totals.entries <= Lists::kMostEntries && fits(needed)) {
        job.frame->stats.metaballs_in_view =
            std::max<std::uint64_t>(job.frame->stats.metaballs_in_view, totals.in_view);
        job.frame->stats.tile_entries += totals.entries;
        lists_.Fill(local, totals, &machine_);
        machine_.Mark(FrameStage::kBinned);
        Trace(job, local, region);
        machine_.Mark(FrameStage::kTraced);
        (n > 1 ? pixels_ : samples_).CopyOut(region, region, job.frame, &machine_);
        machine_.Mark(FrameStage::kEnd);
        held_ = std::max(held_, needed);
        RenderStats& stats = job.frame->stats;
        stats.seconds_bin += machine_.Seconds(FrameStage::kBegin, FrameStage::kBinned);
        stats.seconds_trace += machine_.Seconds(FrameStage::kBinned, FrameStage::kTraced);
        job.pixels_done += pixels;
        job.control.Report("rendering", static_cast<double>(job.pixels_done) /
                                            static_cast<double>(job.frame->color.size()));
        return;
      }
    }
    SplitRegion(job, region, needed);
  }

  void SplitRegion(Job& job, const Region& region, std::uint64_t needed) {
    constexpr int kSmallest = kernels::kTileSize;
    const auto half = [](int length) {
      return (length / 2 + kSmallest - 1) / kSmallest * kSmallest;
    };
    if (region.height > kSmallest) {  // bands: rows are whole
      const int h = half(region.height);
      RenderRegion(job, {region.x0, region.y0, region.width, h});
      RenderRegion(job, {region.x0, region.y0 + h, region.width, region.height - h});
    } else if (region.width > kSmallest) {
      const int w = half(region.width);
      RenderRegion(job, {region.x0, region.y0, w, region.height});
      RenderRegion(job, {region.x0 + w, region.y0, region.width - w, region.height});
    } else {
      const std::uint64_t available = machine_.AvailableBytes() + machine_.ReservedBytes();
      throw ResourceError("even " + std::to_string(kSmallest) + " x " + std::to_string(kSmallest) +
                              " pixels of this picture need " + Megabytes(needed) + " of " +
                              machine_.memory_name() + ", of which " + Megabytes(available) +
                              " are free; choose a level with fewer metaballs, a smaller radius "
                              "factor or the CPU",
                          needed, available);
    }
  }

  // What all kernels that look along the samples' rays are given.
  kernels::TraceParams ParamsOf(const Job& job, const Camera& local) {
    const Cloud& cloud = *job.scene.cloud;
    kernels::TraceParams p;
    p.camera = local;
    p.metaballs = cloud_.Metaballs(job.scene);
    p.color = cloud_.colors();
    p.linear_from_srgb = cloud_.linear_from_srgb();
    p.uniform_color = LinearFromRgb8(cloud.uniform_color);
    p.box = lists_.boxes();
    p.entry = lists_.entries();
    p.range = lists_.ranges();
    p.front = lists_.fronts();
    p.tiles_x = lists_.tiles_x();
    p.right = local.right.cast<float>();
    p.down = local.down.cast<float>();
    p.inverse_fx = static_cast<float>(1.0 / local.fx);
    p.inverse_fy = static_cast<float>(1.0 / local.fy);
    if (cloud.radius.empty()) {
      p.uniform_radius = cloud.uniform_radius * p.metaballs.radius_scale;
      p.inverse_uniform_radius = 1.0 / p.uniform_radius;
    }
    p.threshold = p.metaballs.uniform_threshold * p.metaballs.threshold_scale;
    p.shape = ResolveDensity(job.scene.surface.density).shape;
    p.world_per_local = cloud.frame.unit;
    p.light = PrepareLight(job.scene.lighting);
    const auto plane = [](auto& buffer) { return buffer.size() > 0 ? buffer.data() : nullptr; };
    p.out_color = plane(samples_.color);
    p.out_depth = plane(samples_.depth);
    p.out_normal = plane(samples_.normal);
    p.out_id = plane(samples_.id);
    p.out_hit = plane(hit_);
    p.counts = counts_.data();
    return p;
  }

  void Trace(const Job& job, const Camera& local, const Region& region) {
    const Cloud& cloud = *job.scene.cloud;
    const Planes& planes = job.settings.planes;
    const std::size_t samples = static_cast<std::size_t>(local.width) * local.height;
    samples_.Reserve(cloud, planes, samples, &machine_);
    machine_.Resize(&hit_, planes.NeedGather() ? samples : 0, "picture");
    const kernels::TraceParams p = ParamsOf(job, local);
    const bool in_doubles = cloud_.wide_radii() || HasStiffThreshold(job.scene.surface);
    LaunchTrace(job.scene.surface.mode, cloud, in_doubles, p);
    if (planes.NeedGather()) {
      GatherPlanes(job.scene, planes, p, in_doubles, lists_.tiles(), &cloud_, &samples_, &machine_);
    }
    const int n = job.settings.supersample;
    if (n == 1) return;
    pixels_.Reserve(cloud, planes, region.pixels(), &machine_);
    pixels_.ResolveFrom(samples_, region, n, &machine_);
  }

  // The features of the scene choose the kernel.
  void LaunchTrace(ThresholdMode mode, const Cloud& cloud, bool in_doubles,
                   const kernels::TraceParams& p) {
    using enum ThresholdMode;
    const bool own_color = p.color != nullptr;
    switch (mode) {
      case kUniform:
        if (in_doubles) {
          own_color ? LaunchAny<true, true, double>(p) : LaunchAny<true, false, double>(p);
        } else if (cloud.radius.empty()) {
          own_color ? LaunchAny<false, true, float>(p) : LaunchAny<false, false, float>(p);
        } else {
          own_color ? LaunchAny<true, true, float>(p) : LaunchAny<true, false, float>(p);
        }
        break;
      case kBlended:
        in_doubles ? Launch<kBlended, true, true, double, AnyShape>(p)
                   : Launch<kBlended, true, true, float, AnyShape>(p);
        break;
      case kSummed:
        LaunchList<kSummed>(p);
        break;
      case kGated:
        LaunchList<kGated>(p);
        break;
    }
  }
  // Murakami's density has kernels of its own, the others share theirs.
  template <bool kOwnRadius, bool kOwnColor, class Real>
  void LaunchAny(const kernels::TraceParams& p) {
    if (p.shape == DensityShape{}) {
      Launch<ThresholdMode::kUniform, kOwnRadius, kOwnColor, Real, MurakamiShape>(p);
    } else {
      Launch<ThresholdMode::kUniform, kOwnRadius, kOwnColor, Real, AnyShape>(p);
    }
  }
  template <ThresholdMode kMode, bool kOwnRadius, bool kOwnColor, class Real, class Shape>
  void Launch(const kernels::TraceParams& p) {
    using Traits =
        kernels::TraceTraits<kMode, kOwnRadius, kOwnColor, Real, Shape, Machine::kCountWork>;
    machine_.ForEachBlock("Trace", lists_.tiles(), kernels::TraceProgram<Traits>{{p}});
  }
  template <ThresholdMode kMode>
  void LaunchList(const kernels::TraceParams& p) {
    const kernels::TraceList<kMode> body{p, lists_.tiles_y()};
    machine_.ForEach("TraceList", body.Threads(), body);
  }

  template <class T>
  using Buffer = typename Machine::template Buffer<T>;

  Machine machine_;
  FrameWork work_;
  DeviceCloud<Machine> cloud_;
  // A frame's.
  TileLists<Machine> lists_;
  Buffer<kernels::TraceCounts> counts_;
  Buffer<double> hit_;  // local depth of each sample's hit, where later kernels ask for it
  FrameBuffers<Machine> samples_, pixels_;
  // What a region took that went well: one that needs no more is begun without asking the machine,
  // which takes its time. Should it fail all the same, Render gives everything back and asks.
  std::uint64_t held_ = 0;
};

}  // namespace sherd
