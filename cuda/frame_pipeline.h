// A frame from a scene, on whichever machine: the order of the kernels, the buffers between them,
// and what happens when memory is short. Included by host_loop.cc and cuda_renderer.cu.
#pragma once

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "cuda/kernels/binning.h"
#include "cuda/kernels/resolve.h"
#include "cuda/kernels/trace.h"
#include "cuda/machine.h"
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
    if (scene.surface.mode != ThresholdMode::kUniform) {
      throw Error("a threshold for each metaball is drawn by the CPU alone; use --backend cpu");
    }
    if (settings.planes.NeedGather()) {
      throw Error("further channels are blended by the CPU alone; use --backend cpu");
    }
    const auto begin = std::chrono::steady_clock::now();
    Frame frame = MakeFrame(camera, settings.planes);
    frame.stats.metaballs = scene.cloud->size();
    const std::uint64_t samples = static_cast<std::uint64_t>(settings.supersample);
    frame.stats.rays = frame.color.size() * samples * samples;
    work_ = {};
    if (!scene.cloud->empty()) {
      control.ThrowIfStopped();
      machine_.BeginFrame(control.stop, settings.threads);
      const auto upload = std::chrono::steady_clock::now();
      UseCloud(scene.cloud);
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
      frame.stats.bytes = machine_.ReservedBytes() - CloudBytes();
      machine_.EndFrame();
    }
    frame.stats.seconds_total = SecondsSince(begin);
    return frame;
  }

 private:
  template <class T>
  using Buffer = typename Machine::template Buffer<T>;

  struct Region {  // of the picture, in pixels
    int x0, y0, width, height;
  };
  struct Job {
    const Scene& scene;
    const Camera& camera;
    const RenderSettings& settings;
    const Control& control;
    Frame* frame;
    std::uint64_t pixels_done = 0;
  };
  struct PlaneBuffers {
    Buffer<Pixel> color;
    Buffer<float> depth;
    Buffer<Vec3f> normal;
    Buffer<std::int32_t> id;
  };

  void RenderAll(const Scene& scene, const Camera& camera, const RenderSettings& settings,
                 const Control& control, Frame* frame) {
    machine_.Resize(&counts_, 1, "counters");
    machine_.Zero(&counts_, 1);
    machine_.Resize(&totals_, 1, "counters");
    Job job{scene, camera, settings, control, frame};
    RenderRegion(job, {0, 0, camera.width, camera.height});
  }

  // Gives back all but the cloud.
  void ReleaseFrame() {
    machine_.Release(&box_);
    machine_.Release(&front_);
    machine_.Release(&tile_count_);
    machine_.Release(&offset_);
    for (auto* sort : {&key_, &item_, &tile_, &entry_}) {
      machine_.Release(&sort->content);
      machine_.Release(&sort->room);
    }
    machine_.Release(&range_);
    for (PlaneBuffers* planes : {&samples_, &pixels_}) {
      machine_.Release(&planes->color);
      machine_.Release(&planes->depth);
      machine_.Release(&planes->normal);
      machine_.Release(&planes->id);
    }
    machine_.ReleaseScratch();
    held_ = 0;
  }

  static double SecondsSince(std::chrono::steady_clock::time_point begin) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }

  // ---- the scene ------------------------------------------------------------------------------

  std::uint64_t CloudBytes() const { return sphere_.bytes() + color_.bytes(); }

  void UseCloud(const std::shared_ptr<const Cloud>& cloud) {
    if (cloud_.lock() == cloud && cloud_size_ == cloud->size() &&
        cloud_revisions_ == cloud->revisions) {
      return;
    }
    cloud_.reset();
    const std::size_t n = cloud->size();
    const std::uint64_t needed =
        n * (sizeof(kernels::Sphere) + (cloud->color.empty() ? 0 : 4) + kBytesPerMetaball);
    const std::uint64_t available = machine_.AvailableBytes() + machine_.ReservedBytes();
    if (needed > available) {
      throw ResourceError(std::to_string(n) + " metaballs need " + Megabytes(needed) + " of " +
                              machine_.memory_name() + ", of which " + Megabytes(available) +
                              " are free; choose a level with fewer metaballs or the CPU",
                          needed, available);
    }
    if (needed > machine_.AvailableBytes()) ReleaseFrame();
    machine_.Resize(&sphere_, n, "metaballs");
    machine_.Resize(&color_, cloud->color.size(), "colours");
    // In pieces, so that the packed copy never takes as much memory as the cloud.
    constexpr std::size_t kPiece = std::size_t{1} << 18;
    std::vector<kernels::Sphere> spheres(std::min(n, kPiece));
    std::vector<std::uint32_t> colors(cloud->color.empty() ? 0 : spheres.size());
    for (std::size_t begin = 0; begin < n; begin += kPiece) {
      const std::size_t count = std::min(kPiece, n - begin);
      for (std::size_t k = 0; k < count; ++k) {
        const Vec3f c = cloud->center[begin + k];
        spheres[k] = {c.x, c.y, c.z, cloud->RadiusOf(begin + k)};
      }
      machine_.Upload(&sphere_, begin, spheres.data(), count);
      if (colors.empty()) continue;
      for (std::size_t k = 0; k < count; ++k) {
        const Rgb8 c = cloud->color[begin + k];
        colors[k] =
            c.r | static_cast<std::uint32_t>(c.g) << 8 | static_cast<std::uint32_t>(c.b) << 16;
      }
      machine_.Upload(&color_, begin, colors.data(), count);
    }
    machine_.Resize(&srgb_table_, 256, "tables");
    machine_.Upload(&srgb_table_, 0, SrgbToLinearTable(), 256);
    wide_radii_ = HasWideRadii(*cloud);
    cloud_ = cloud;
    cloud_size_ = n;
    cloud_revisions_ = cloud->revisions;
  }

  static std::string Megabytes(std::uint64_t bytes) {
    return std::to_string((bytes >> 20) + 1) + " MB";
  }

  // ---- a region of the picture ----------------------------------------------------------------

  // What a metaball takes in a frame: box, front, two keys, two items, tiles, offset.
  static constexpr std::uint64_t kBytesPerMetaball = 8 + 4 + 8 + 8 + 4 + 8;
  static constexpr std::uint64_t kBytesPerEntry = 16;  // two keys, two values
  static constexpr std::uint64_t kLargestBin = (std::uint64_t{1} << 31) - 1;

  static std::uint64_t BytesPerSample(const Planes& planes) {
    return sizeof(Pixel) + (planes.depth ? 4 : 0) + (planes.normal ? sizeof(Vec3f) : 0) +
           (planes.id ? 4 : 0);
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
    std::uint64_t needed = CloudBytes() + cloud_size_ * kBytesPerMetaball + tiles * 8 +
                           (samples + (n > 1 ? pixels : 0)) * BytesPerSample(job.settings.planes);
    // Sorting and scanning want a little room of their own.
    const auto fits = [&](std::uint64_t bytes) {
      if (bytes <= held_) return true;
      return bytes + bytes / 16 <= machine_.AvailableBytes() + machine_.ReservedBytes();
    };
    const bool addressable = fine_width <= kernels::kMaxRegionSide &&
                             fine_height <= kernels::kMaxRegionSide && tiles <= kLargestBin;
    if (addressable && fits(needed)) {
      const Camera view = job.camera.Resized(job.camera.width * n, job.camera.height * n)
                              .Cropped(region.x0 * n, region.y0 * n, static_cast<int>(fine_width),
                                       static_cast<int>(fine_height));
      const Camera local = LocalCamera(view, job.scene.cloud->frame);
      machine_.Mark(FrameStage::kBegin);
      const kernels::BinTotals totals = CountEntries(job, local);
      if (region.width == job.camera.width && region.height == job.camera.height) {
        job.frame->stats.metaballs_in_view = totals.in_view;
      }
      needed += totals.entries * kBytesPerEntry;
      if (totals.entries <= kLargestBin && fits(needed)) {
        job.frame->stats.metaballs_in_view =
            std::max<std::uint64_t>(job.frame->stats.metaballs_in_view, totals.in_view);
        job.frame->stats.tile_entries += totals.entries;
        FillTiles(local, totals);
        machine_.Mark(FrameStage::kBinned);
        Trace(job, local, region);
        machine_.Mark(FrameStage::kTraced);
        CopyOut(job, region);
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

  kernels::MetaballArrays Metaballs(const Scene& scene) const {
    kernels::MetaballArrays m;
    m.sphere = sphere_.data();
    m.radius_scale = scene.surface.radius_scale * ResolveDensity(scene.surface.density).support;
    m.count = static_cast<std::uint32_t>(cloud_size_);
    return m;
  }

  // Everything up to the number of entries, which decides what is reserved next.
  kernels::BinTotals CountEntries(const Job& job, const Camera& local) {
    const std::size_t n = cloud_size_;
    const auto count = static_cast<std::uint32_t>(n);
    machine_.Resize(&box_, n, "pixel boxes");
    machine_.Resize(&front_, n, "front distances");
    for (auto* sort : {&key_, &item_}) {
      machine_.Resize(&sort->content, n, "depth order");
      machine_.Resize(&sort->room, n, "depth order");
    }
    machine_.Resize(&tile_count_, n + 1, "tile counts");
    machine_.Resize(&offset_, n + 1, "offsets");
    machine_.Zero(&totals_, 1);
    machine_.ForEach(
        "MeasureBounds", n,
        kernels::MeasureBounds{Metaballs(job.scene), ViewOf(local), box_.data(), front_.data(),
                               key_.content.data(), item_.content.data()});
    machine_.SortPairs("sort by depth", &key_, &item_, n, 32);
    machine_.ForEach("CountTiles", n + 1,
                     kernels::CountTiles{count, key_.content.data(), item_.content.data(),
                                         box_.data(), tile_count_.data(), totals_.data()});
    machine_.ExclusiveSum("scan of tile counts", tile_count_, &offset_, n + 1);
    machine_.ForEach("TakeTotal", 1, kernels::TakeTotal{count, offset_.data(), totals_.data()});
    kernels::BinTotals totals;
    machine_.Download(&totals, totals_, 1);
    return totals;
  }

  void FillTiles(const Camera& local, const kernels::BinTotals& totals) {
    tiles_x_ = (local.width + kernels::kTileSize - 1) / kernels::kTileSize;
    tiles_ = tiles_x_ * ((local.height + kernels::kTileSize - 1) / kernels::kTileSize);
    for (auto* sort : {&tile_, &entry_}) {
      machine_.Resize(&sort->content, totals.entries, "tile lists");
      machine_.Resize(&sort->room, totals.entries, "tile lists");
    }
    machine_.Resize(&range_, tiles_, "tile ranges");
    machine_.Zero(&range_, tiles_);
    machine_.ForEach("FillEntries", kernels::FillEntries::Threads(totals.entries),
                     kernels::FillEntries{totals.entries, totals.in_view, tiles_x_, offset_.data(),
                                          item_.content.data(), box_.data(), tile_.content.data(),
                                          entry_.content.data()});
    const int bits = std::bit_width(static_cast<unsigned>(std::max(1, tiles_ - 1)));
    machine_.SortPairs("sort by tile", &tile_, &entry_, totals.entries, bits);
    machine_.ForEach("FindRanges", totals.entries,
                     kernels::FindRanges{totals.entries, tile_.content.data(), range_.data()});
  }

  void ReservePlanes(PlaneBuffers* planes, const Planes& wanted, std::size_t n) {
    machine_.Resize(&planes->color, n, "picture");
    machine_.Resize(&planes->depth, wanted.depth ? n : 0, "picture");
    machine_.Resize(&planes->normal, wanted.normal ? n : 0, "picture");
    machine_.Resize(&planes->id, wanted.id ? n : 0, "picture");
  }

  void Trace(const Job& job, const Camera& local, const Region& region) {
    const Cloud& cloud = *job.scene.cloud;
    const Planes& wanted = job.settings.planes;
    ReservePlanes(&samples_, wanted, static_cast<std::size_t>(local.width) * local.height);
    kernels::TraceParams p;
    p.camera = local;
    p.metaballs = Metaballs(job.scene);
    p.color = cloud.color.empty() ? nullptr : color_.data();
    p.linear_from_srgb = srgb_table_.data();
    p.uniform_color = LinearFromRgb8(cloud.uniform_color);
    p.box = box_.data();
    p.entry = entry_.content.data();
    p.range = range_.data();
    p.front = front_.data();
    p.tiles_x = tiles_x_;
    p.right = local.right.cast<float>();
    p.down = local.down.cast<float>();
    p.inverse_fx = static_cast<float>(1.0 / local.fx);
    p.inverse_fy = static_cast<float>(1.0 / local.fy);
    if (cloud.radius.empty()) {
      p.uniform_radius = cloud.uniform_radius * p.metaballs.radius_scale;
      p.inverse_uniform_radius = 1.0 / p.uniform_radius;
    }
    const ResolvedDensity density = ResolveDensity(job.scene.surface.density);
    p.threshold = job.scene.surface.threshold / density.amplitude;
    p.shape = density.shape;
    p.world_per_local = cloud.frame.unit;
    p.light = PrepareLight(job.scene.lighting);
    p.out_color = samples_.color.data();
    p.out_depth = wanted.depth ? samples_.depth.data() : nullptr;
    p.out_normal = wanted.normal ? samples_.normal.data() : nullptr;
    p.out_id = wanted.id ? samples_.id.data() : nullptr;
    p.counts = counts_.data();
    // The features of the scene choose the kernel.
    const bool own_color = !cloud.color.empty();
    if (wide_radii_ || HasStiffThreshold(job.scene.surface)) {
      own_color ? Launch<true, true, double>(p) : Launch<true, false, double>(p);
    } else if (cloud.radius.empty()) {
      own_color ? Launch<false, true, float>(p) : Launch<false, false, float>(p);
    } else {
      own_color ? Launch<true, true, float>(p) : Launch<true, false, float>(p);
    }
    const int n = job.settings.supersample;
    if (n == 1) return;
    const std::size_t pixels = static_cast<std::size_t>(region.width) * region.height;
    ReservePlanes(&pixels_, wanted, pixels);
    machine_.ForEach(
        "ResolvePixels", pixels,
        kernels::ResolvePixels{region.width, region.height, n, samples_.color.data(),
                               samples_.depth.data(), samples_.normal.data(), samples_.id.data(),
                               pixels_.color.data(), wanted.depth ? pixels_.depth.data() : nullptr,
                               wanted.normal ? pixels_.normal.data() : nullptr,
                               wanted.id ? pixels_.id.data() : nullptr});
  }

  // Murakami's density has kernels of its own, the others share theirs.
  template <bool kOwnRadius, bool kOwnColor, class Real>
  void Launch(const kernels::TraceParams& p) {
    if (p.shape == DensityShape{}) {
      LaunchShape<kOwnRadius, kOwnColor, Real, MurakamiShape>(p);
    } else {
      LaunchShape<kOwnRadius, kOwnColor, Real, AnyShape>(p);
    }
  }
  template <bool kOwnRadius, bool kOwnColor, class Real, class Shape>
  void LaunchShape(const kernels::TraceParams& p) {
    using Traits = kernels::TraceTraits<kOwnRadius, kOwnColor, Real, Shape, Machine::kCountWork>;
    machine_.ForEachBlock("Trace", tiles_, kernels::TraceProgram<Traits>{{p}});
  }

  void CopyOut(const Job& job, const Region& region) {
    const PlaneBuffers& from = job.settings.supersample > 1 ? pixels_ : samples_;
    Frame* frame = job.frame;
    const auto copy = [&](auto& plane, const auto& buffer) {
      if (plane.empty()) return;
      machine_.DownloadRect(&plane[static_cast<std::size_t>(region.y0) * frame->width + region.x0],
                            static_cast<std::size_t>(frame->width), buffer, region.width,
                            region.height);
    };
    copy(frame->color, from.color);
    copy(frame->depth, from.depth);
    copy(frame->normal, from.normal);
    copy(frame->id, from.id);
  }

  Machine machine_;
  FrameWork work_;
  // The cloud that lies in the machine's memory. Weak: the renderer does not keep it alive, and a
  // new one at the same address is not taken for it.
  std::weak_ptr<const Cloud> cloud_;
  std::size_t cloud_size_ = 0;
  bool wide_radii_ = false;
  CloudRevisions cloud_revisions_;
  Buffer<kernels::Sphere> sphere_;
  Buffer<std::uint32_t> color_;
  Buffer<float> srgb_table_;
  // A frame's.
  Buffer<kernels::PixelBox16> box_;
  Buffer<std::uint32_t> front_, tile_count_;
  Buffer<std::uint64_t> offset_;
  SortBuffer<Buffer<std::uint32_t>> key_, item_, tile_, entry_;
  Buffer<kernels::EntryRange> range_;
  Buffer<kernels::BinTotals> totals_;
  Buffer<kernels::TraceCounts> counts_;
  int tiles_x_ = 0, tiles_ = 0;
  // What a region took that went well: one that needs no more is begun without asking the machine,
  // which takes its time. Should it fail all the same, Render gives everything back and asks.
  std::uint64_t held_ = 0;
  PlaneBuffers samples_, pixels_;
};

}  // namespace sherd
