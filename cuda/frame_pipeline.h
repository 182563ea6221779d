// A frame from a scene, on whichever machine: the order of the kernels, the buffers between them,
// and what happens when memory is short. Included by host_loop.cc and cuda_renderer.cu.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cuda/appearance_pass.h"
#include "cuda/device_clouds.h"
#include "cuda/frame_buffers.h"
#include "cuda/kernels/box_filter.h"
#include "cuda/kernels/trace.h"
#include "cuda/kernels/trace_list.h"
#include "cuda/machine.h"
#include "cuda/surface_gather.h"
#include "cuda/tile_lists.h"
#include "metaball/appearance/deferred.h"
#include "metaball/appearance/gather.h"
#include "metaball/cloud_version.h"
#include "metaball/error.h"
#include "metaball/local_view.h"
#include "metaball/precision.h"
#include "metaball/renderer.h"
#include "metaball/stopwatch.h"
#include "metaball/supersample.h"

namespace sherd {

template <class Machine>
class FramePipeline {
 public:
  // Appearances and several rays a pixel as well (pipeline_renderer.h).
  static constexpr bool kDrawsEverything = true;

  explicit FramePipeline(Machine machine) : machine_(std::move(machine)) {}

  Machine& machine() { return machine_; }
  const Machine& machine() const { return machine_; }
  const FrameWork& work() const { return work_; }

  // Renderer::Recycle.
  void Recycle(Frame frame) { spare_ = std::move(frame); }

  // Renderer::Render, but for the names in the stats.
  Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
               const Control& control) {
    CheckRenderInput(scene, camera, settings);
    if (NeedsDeferredPasses(scene, settings.planes)) CheckAppearance(scene);
    const Stopwatch total;
    const auto content = scene.cloud->empty() ? FrameContent::kBackground : FrameContent::kAnything;
    Frame frame = MakeFrame(camera, settings.planes, std::exchange(spare_, {}), content);
    if (settings.planes.NeedGather()) AllocateGatherPlanes(*scene.cloud, settings.planes, &frame);
    frame.stats.metaballs = scene.cloud->size();
    const std::uint64_t samples = static_cast<std::uint64_t>(settings.supersample);
    frame.stats.rays = frame.color.size() * samples * samples;
    work_ = {};
    if (!scene.cloud->empty()) {
      control.ThrowIfStopped();
      machine_.BeginFrame(control.stop, settings.threads);
      const Stopwatch upload;
      try {
        UseCloud(scene, settings.threads);
      } catch (const ResourceError&) {
        ReleaseFrame();  // of earlier pictures
        clouds_.ReleaseOthers(&machine_);
        UseCloud(scene, settings.threads);
      }
      frame.stats.seconds_prepare = upload.Seconds();
      RenderInMemory(scene, camera, settings, control, &frame);
      kernels::TraceCounts counts;
      machine_.Download(&counts, counts_, 1);
      using Counts = kernels::TraceCounts;
      frame.stats.hits = counts.rare[Counts::kHits];
      frame.stats.rays_started_inside = counts.rare[Counts::kStartedInside];
      frame.stats.grazing = counts.rare[Counts::kGrazing];
      frame.stats.unresolved = counts.rare[Counts::kUnresolved];
      work_ = {counts.work[Counts::kTests],     counts.work[Counts::kAdds],
               counts.work[Counts::kSteps],     counts.work[Counts::kStaged],
               counts.work[Counts::kShadeAdds], counts.rare[Counts::kWide]};
      frame.stats.bytes = machine_.ReservedBytes() - clouds_.Bytes();
      machine_.EndFrame();
    }
    frame.stats.seconds_total = total.Seconds();
    return frame;
  }

 private:
  struct Job {
    const Scene& scene;
    const Camera& camera;
    const RenderSettings& settings;
    const Control& control;
    Frame* frame;
    bool deferred;        // colours and lights in passes of their own
    bool in_doubles;      // floats cannot carry the scene
    const Planes planes;  // that are needed
    std::uint64_t pixels_done = 0;

    int samples() const { return settings.supersample; }
    // Pixels around a part of the picture that its filter looks at.
    int border() const { return scene.appearance.filter / 2; }
    // Whether later kernels begin with where the trace ended.
    bool keeps_hits() const { return planes.NeedGather(); }
  };
  // A part of the picture, and what is held of it: its border as well, and all samples.
  struct Part {
    Part(const Job& job, const Region& wanted) : region(wanted), held(wanted.Grown(job.border())) {
      const int n = job.samples();
      camera = job.camera.Resized(job.camera.width * n, job.camera.height * n)
                   .Cropped(held.x0 * n, held.y0 * n, held.width * n, held.height * n);
      local = LocalCamera(camera, job.scene.cloud->frame);
    }
    std::uint64_t samples() const {
      return static_cast<std::uint64_t>(camera.width) * camera.height;
    }
    // As wide as the region and as high as what is held: between the filter's two passes.
    Region rows_filtered() const { return {region.x0, held.y0, region.width, held.height}; }

    Region region, held;
    Camera camera, local;  // of the samples held
  };

  // RenderAll, until it succeeds or the smallest part of the picture does not.
  void RenderInMemory(const Scene& scene, const Camera& camera, const RenderSettings& settings,
                      const Control& control, Frame* frame) {
    const RenderStats before = frame->stats;
    const std::uint64_t pixel_bytes = BytesPerPixel(scene, settings);
    const std::uint64_t tried =
        std::min<std::uint64_t>(frame->color.size(), KnownLimit(scene, pixel_bytes));
    most_pixels_ = tried;
    for (bool again = false;; again = true) {
      region_pixels_ = most_pixels_;
      try {
        RenderAll(scene, camera, settings, control, frame);
        if (most_pixels_ < tried) {
          const std::uint64_t room = Room();
          limit_ = {CloudVersion(scene.cloud), most_pixels_ * pixel_bytes, room + room / 8};
        }
        return;
      } catch (const ResourceError&) {
        // Buffers of earlier frames, of other sizes, may hold what this one needs; and what a part
        // of it needs is known to a few per cent only.
        ReleaseFrame();
        clouds_.ReleaseOthers(&machine_);
        cloud().ReleaseChannelsBut(PlanesNeeded(scene, settings.planes), &machine_);
        frame->stats = before;
        if (!again) continue;
        most_pixels_ = std::min(most_pixels_, region_pixels_) / 2;
        if (most_pixels_ < kernels::kTileRays) throw;
      }
    }
  }

  // Pixels of a part that pictures of this cloud were drawn with which did not fit in larger ones,
  // as long as the machine has no more room than then: the next need not find out anew.
  std::uint64_t KnownLimit(const Scene& scene, std::uint64_t pixel_bytes) {
    if (limit_ && !(limit_->cloud.Is(scene.cloud) && Room() <= limit_->room)) limit_.reset();
    if (!limit_) return std::numeric_limits<std::uint64_t>::max();
    return std::max<std::uint64_t>(kernels::kTileRays, limit_->bytes / pixel_bytes);
  }
  static std::uint64_t BytesPerPixel(const Scene& scene, const RenderSettings& settings) {
    const auto n = static_cast<std::uint64_t>(settings.supersample);
    return n * n * PlanesNeeded(scene, settings.planes).BytesPerPixel();
  }
  // Bytes that are free or held.
  std::uint64_t Room() const { return machine_.AvailableBytes() + machine_.ReservedBytes(); }

  void RenderAll(const Scene& scene, const Camera& camera, const RenderSettings& settings,
                 const Control& control, Frame* frame) {
    machine_.Resize(&counts_, 1, "counters");
    machine_.Zero(&counts_, 1);
    Job job{scene,
            camera,
            settings,
            control,
            frame,
            NeedsDeferredPasses(scene, settings.planes),
            cloud().wide_radii() || HasStiffThreshold(scene.surface),
            PlanesNeeded(scene, settings.planes)};
    if (job.deferred) {
      appearance_.Begin(scene, camera, clouds_.linear_from_srgb(), &machine_);
    }
    RenderRegion(job, {0, 0, camera.width, camera.height});
  }

  // Gives back all but the clouds.
  void ReleaseFrame() {
    lists_.Release(&machine_);
    machine_.Release(&hit_);
    samples_.Release(&machine_);
    pixels_.Release(&machine_);
    appearance_.Release(&machine_);
    machine_.Release(&rows_);
    machine_.Release(&filtered_);
    machine_.ReleaseScratch();
    held_ = 0;
  }

  // The one of the scene in the making.
  DeviceCloud<Machine>& cloud() { return clouds_.current(); }

  void UseCloud(const Scene& scene, int threads) {
    const Cloud& cloud = *scene.cloud;
    if (!clouds_.Holds(scene.cloud)) {
      const std::uint64_t needed = DeviceCloud<Machine>::BytesFor(cloud) +
                                   cloud.size() * TileLists<Machine>::kBytesPerMetaball;
      const std::uint64_t available = Room();
      if (needed > available) {
        throw ResourceError(std::to_string(cloud.size()) + " metaballs need " + Megabytes(needed) +
                                " of " + machine_.memory_name() + ", of which " +
                                Megabytes(available) +
                                " are free; choose a level with fewer metaballs or the CPU",
                            needed, available);
      }
      if (needed > machine_.AvailableBytes()) ReleaseFrame();
    }
    clouds_.Use(scene, threads, &machine_);
  }

  // ---- a region of the picture ----------------------------------------------------------------

  // Bytes that the planes of a part take.
  static std::uint64_t PlaneBytes(const Job& job, const Region& region) {
    const std::uint64_t n = static_cast<std::uint64_t>(job.samples());
    const std::uint64_t held = region.Grown(job.border()).pixels();
    std::uint64_t of_sample = job.planes.BytesPerPixel() + (job.keeps_hits() ? sizeof(double) : 0);
    if (job.deferred) of_sample += AppearancePass<Machine>::BytesPerSample(job.scene);
    std::uint64_t of_pixel = n > 1 ? job.planes.BytesPerPixel() : 0;
    if (job.border() > 0) of_pixel += 2 * sizeof(Pixel);
    return held * (n * n * of_sample + of_pixel);
  }

  // Renders a region, or its halves where memory does not hold it at once.
  void RenderRegion(Job& job, const Region& region) {
    using Lists = TileLists<Machine>;
    job.control.ThrowIfStopped();
    region_pixels_ = region.pixels();
    const Region held = region.Grown(job.border());
    const auto n = static_cast<std::uint64_t>(job.samples());
    const std::uint64_t width = held.width * n, height = held.height * n;
    const std::uint64_t tiles =
        (width / kernels::kTileSize + 1) * (height / kernels::kTileSize + 1);
    std::uint64_t needed = cloud().Bytes() + cloud().MissingBytes(*job.scene.cloud, job.planes) +
                           cloud().size() * Lists::kBytesPerMetaball +
                           tiles * Lists::kBytesPerTile + PlaneBytes(job, region);
    if (job.deferred) {
      using Pass = AppearancePass<Machine>;
      needed +=
          Pass::SceneBytes(job.scene) + Pass::WantedBatchBytes(job.scene, held.pixels() * n * n);
    }
    // Sorting and scanning want a little room of their own.
    const auto fits = [&](std::uint64_t bytes) {
      if (bytes <= held_ && appearance_.BatchBytes() == 0) return true;
      const std::uint64_t room = Room();
      bytes += bytes / 16;
      if (bytes + appearance_.BatchBytes() > room) appearance_.ReleaseBatches(&machine_);
      if (bytes + clouds_.OtherBytes() > room) clouds_.ReleaseOthers(&machine_);
      return bytes <= room;
    };
    const bool allowed = region.pixels() <= most_pixels_ && width <= kernels::kMaxRegionSide &&
                         height <= kernels::kMaxRegionSide && tiles <= Lists::kMostEntries;
    if (allowed && fits(needed)) {
      const Part part(job, region);
      machine_.Mark(FrameStage::kBegin);
      const kernels::BinTotals totals =
          lists_.Count(cloud().Metaballs(job.scene), part.local, &machine_);
      RenderStats& stats = job.frame->stats;
      if (region.width == job.camera.width && region.height == job.camera.height) {
        stats.metaballs_in_view = totals.in_view;
      }
      needed += totals.entries * Lists::kBytesPerEntry;
      if (totals.entries <= Lists::kMostEntries && fits(needed)) {
        stats.metaballs_in_view = std::max<std::uint64_t>(stats.metaballs_in_view, totals.in_view);
        stats.tile_entries += totals.entries;
        lists_.Fill(part.local, totals, &machine_);
        machine_.Mark(FrameStage::kBinned);
        Draw(job, part);
        machine_.Mark(FrameStage::kTraced);
        FilterAndCopyOut(job, part);
        machine_.Mark(FrameStage::kEnd);
        held_ = std::max(held_, needed);
        stats.seconds_bin += machine_.Seconds(FrameStage::kBegin, FrameStage::kBinned);
        stats.seconds_trace += machine_.Seconds(FrameStage::kBinned, FrameStage::kTraced);
        job.pixels_done += region.pixels();
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
      const std::uint64_t available = Room();
      throw ResourceError("even " + std::to_string(kSmallest) + " x " + std::to_string(kSmallest) +
                              " pixels of this picture need " + Megabytes(needed) + " of " +
                              machine_.memory_name() + ", of which " + Megabytes(available) +
                              " are free; choose a level with fewer metaballs, a smaller radius "
                              "factor or the CPU",
                          needed, available);
    }
  }

  // What all kernels that look along the samples' rays are given.
  kernels::TraceParams ParamsOf(const Job& job, const Part& part) {
    const Camera& local = part.local;
    const Cloud& cloud = *job.scene.cloud;
    const DeviceCloud<Machine>& held = clouds_.current();
    kernels::TraceParams p;
    p.camera = local;
    p.metaballs = held.Metaballs(job.scene);
    p.color = held.colors();
    p.linear_from_srgb = clouds_.linear_from_srgb();
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
    if (job.deferred) p.light.unlit = true;
    const auto plane = [](auto& buffer) { return buffer.size() > 0 ? buffer.data() : nullptr; };
    p.out_color = plane(samples_.color);
    p.out_depth = plane(samples_.depth);
    p.out_normal = plane(samples_.normal);
    p.out_id = plane(samples_.id);
    p.out_hit = plane(hit_);
    p.counts = counts_.data();
    return p;
  }

  void ReservePlanes(const Job& job, const Part& part) {
    const Cloud& cloud = *job.scene.cloud;
    samples_.Reserve(cloud, job.planes, part.samples(), &machine_);
    machine_.Resize(&hit_, job.keeps_hits() ? part.samples() : 0, "picture");
    if (job.samples() > 1) pixels_.Reserve(cloud, job.planes, part.held.pixels(), &machine_);
    if (job.border() > 0) {
      machine_.Resize(&rows_, part.rows_filtered().pixels(), "picture");
      machine_.Resize(&filtered_, part.region.pixels(), "picture");
    }
  }

  // Everything from the tile lists to the part's planes, one value a pixel.
  void Draw(const Job& job, const Part& part) {
    ReservePlanes(job, part);
    const Cloud& cloud = *job.scene.cloud;
    const kernels::TraceParams p = ParamsOf(job, part);
    LaunchTrace(job.scene.surface.mode, cloud, job.in_doubles, p);
    if (job.planes.NeedGather()) {
      GatherPlanes(job.scene, job.planes, p, job.in_doubles, lists_.tiles(), &clouds_.current(),
                   &samples_, &machine_);
    }
    if (job.deferred) {
      appearance_.Shade(
          {job.scene, job.in_doubles, job.settings.threads, job.control, counts_.data()},
          part.camera, job.planes, p.metaballs, &samples_, &machine_);
    }
    if (job.samples() > 1) {
      pixels_.ResolveFrom(samples_, part.held, job.samples(), &machine_);
    }
  }

  void FilterAndCopyOut(const Job& job, const Part& part) {
    const FrameBuffers<Machine>& planes = job.samples() > 1 ? pixels_ : samples_;
    Frame* frame = job.frame;
    if (job.border() == 0) {
      planes.CopyOut(part.held, part.region, frame, &machine_);
      return;
    }
    const int size = job.scene.appearance.filter, width = part.region.width;
    machine_.ForEach("FilterRows", part.rows_filtered().pixels(),
                     kernels::FilterRows{planes.color.data(), width, size, rows_.data()});
    machine_.ForEach("FilterColumns", part.region.pixels(),
                     kernels::FilterColumns{rows_.data(), width, size, filtered_.data()});
    FrameBuffers<Machine>::CopyPlane(filtered_, part.region, part.region, 1, &frame->color,
                                     frame->width, &machine_);
    planes.CopyPlanes(part.held, part.region, frame, &machine_);
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
  Frame spare_;
  DeviceClouds<Machine> clouds_;
  // A frame's.
  TileLists<Machine> lists_;
  Buffer<kernels::TraceCounts> counts_;
  Buffer<double> hit_;  // local depth of each sample's hit, where later kernels ask for it
  FrameBuffers<Machine> samples_, pixels_;
  AppearancePass<Machine> appearance_;
  Buffer<Pixel> rows_, filtered_;
  // What a region took that went well: one that needs no more is begun without asking the machine,
  // which takes its time. Should it fail all the same, Render gives everything back and asks.
  std::uint64_t held_ = 0;
  // Of a part of the frame in the making, and of the one that was begun last.
  std::uint64_t most_pixels_ = 0, region_pixels_ = 0;
  struct Limit {
    CloudVersion cloud;
    std::uint64_t bytes;  // of the pixels of a part
    std::uint64_t room;   // of the machine, which more than that makes void
  };
  std::optional<Limit> limit_;  // KnownLimit
};

}  // namespace sherd
