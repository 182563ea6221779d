// A frame by the thesis's method on whichever machine (machine.h): the octree is built on the host
// and kept on the machine while cloud and radii stay the same, the rays are one kernel
// (kernels/thesis_rays.h), the picture is drawn in bands of rows. Included by the host loop and the
// device's .cu file.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cuda/cuda_thesis_renderer.h"
#include "cuda/kernels/packed_color.h"
#include "cuda/kernels/thesis_rays.h"
#include "cuda/machine.h"
#include "metaball/cloud_version.h"
#include "metaball/error.h"
#include "metaball/local_view.h"
#include "metaball/renderer.h"
#include "metaball/stopwatch.h"
#include "metaball/supersample.h"
#include "metaball/thesis/octree.h"
#include "metaball/thesis/thesis_frame.h"

namespace sherd {

// For people.
inline std::string DescribeThesis(const ThesisOptions& options, ThesisPrecision precision) {
  return "thesis, octree depth " + std::to_string(options.depth) +
         (precision == ThesisPrecision::kFloat ? ", floats" : ", doubles");
}

template <class Machine>
class ThesisPipeline {
 public:
  // Appearances and several rays a pixel are made around it (pipeline_renderer.h).
  static constexpr bool kDrawsEverything = false;

  // Throws Error for options out of range.
  ThesisPipeline(Machine machine, const ThesisOptions& options, ThesisPrecision precision)
      : machine_(std::move(machine)), options_(options), precision_(precision) {
    CheckThesisOptions(options);
  }

  Machine& machine() { return machine_; }
  const Machine& machine() const { return machine_; }
  // Renderer::Render with one ray a pixel, but for the names in the stats.
  Frame Render(const Scene& scene, const Camera& camera, const RenderSettings& settings,
               const Control& control) {
    CheckRenderInput(scene, camera, settings);
    if (settings.planes.NeedGather()) {
      throw Error("the thesis's renderer draws colour, depth, normals and metaballs alone");
    }
    const Stopwatch total;
    Frame frame = MakeFrame(camera, settings.planes);
    frame.stats.metaballs = frame.stats.metaballs_in_view = scene.cloud->size();  // no culling
    frame.stats.rays = frame.color.size();
    if (!scene.cloud->empty()) {
      control.ThrowIfStopped();
      machine_.BeginFrame(control.stop, settings.threads);
      const Stopwatch prepare;
      UseScene(scene, control);
      frame.stats.seconds_prepare = prepare.Seconds();
      Trace(scene, LocalCamera(camera, scene.cloud->frame), control, &frame);
      frame.stats.bytes = machine_.ReservedBytes() - MetaballBytes();
      machine_.EndFrame();
    }
    frame.stats.seconds_total = total.Seconds();
    return frame;
  }

 private:
  template <class T>
  using Buffer = typename Machine::template Buffer<T>;

  // Rays whose pixels are held at once.
  static constexpr std::uint64_t kBandRays = std::uint64_t{4} << 20;

  // ---- the scene ------------------------------------------------------------------------------

  std::uint64_t MetaballBytes() const {
    return sphere_.bytes() + threshold_.bytes() + color_.bytes();
  }

  void ReleaseAll() {
    cloud_ = {};
    for (auto* words : {&near_, &held_}) machine_.Release(words);
    for (auto* words : {&held_before_, &begin_, &order_, &color_}) machine_.Release(words);
    machine_.Release(&sphere_);
    machine_.Release(&threshold_);
    ReleasePicture();
  }

  template <class T>
  void Bring(Buffer<T>* buffer, std::span<const T> values, const char* what) {
    machine_.ResizeExactly(buffer, values.size(), what);
    machine_.Upload(buffer, 0, values.data(), values.size());
  }

  // Builds the octree and brings it over with the metaballs, where anything has changed.
  void UseScene(const Scene& scene, const Control& control) {
    const std::shared_ptr<const Cloud>& cloud = scene.cloud;
    const bool known = cloud_.Is(cloud);
    const double largest = known ? largest_radius_ : LargestRadius(*cloud);
    const double margin = ThesisMargin(largest, scene.surface);
    if (known && margin_ == margin) return;
    ReleaseAll();
    control.Report("building the octree", 0.0);
    MortonOctree octree;
    octree.Build(*cloud, margin, options_.depth, control);
    const std::size_t n = cloud->size();
    const std::uint64_t needed = octree.near().size_bytes() + octree.held().size_bytes() +
                                 octree.held_before().size_bytes() + octree.begin().size_bytes() +
                                 n * (sizeof(std::uint32_t) + sizeof(kernels::Sphere) +
                                      (cloud->threshold.empty() ? 0 : sizeof(float)) +
                                      (cloud->color.empty() ? 0 : sizeof(std::uint32_t)));
    const std::uint64_t available = machine_.AvailableBytes();
    if (needed > available) {
      throw ResourceError("an octree of depth " + std::to_string(options_.depth) + " with " +
                              std::to_string(n) + " metaballs needs " + Megabytes(needed) + " of " +
                              machine_.memory_name() + ", of which " + Megabytes(available) +
                              " are free; take a lower depth, a level with fewer metaballs or the "
                              "CPU",
                          needed, available);
    }
    Bring(&near_, octree.near(), "octree");
    Bring(&held_, octree.held(), "octree");
    Bring(&held_before_, octree.held_before(), "octree");
    Bring(&begin_, octree.begin(), "octree");
    Bring(&order_, octree.metaballs(), "octree");
    BringMetaballs(*cloud, octree.metaballs());
    corner_ = octree.corner();
    size_ = octree.size();
    cloud_ = CloudVersion(cloud);
    largest_radius_ = largest;
    margin_ = margin;
  }

  // In the order of the octree's lists.
  void BringMetaballs(const Cloud& cloud, std::span<const std::uint32_t> order) {
    const std::size_t n = order.size();
    std::vector<kernels::Sphere> spheres(n);
    std::vector<float> thresholds(cloud.threshold.empty() ? 0 : n);
    std::vector<std::uint32_t> colors(cloud.color.empty() ? 0 : n);
    for (std::size_t k = 0; k < n; ++k) {
      const std::uint32_t i = order[k];
      const Vec3f c = cloud.center[i];
      spheres[k] = {c.x, c.y, c.z, cloud.RadiusOf(i)};
      if (!thresholds.empty()) thresholds[k] = cloud.threshold[i];
      if (!colors.empty()) colors[k] = kernels::PackColor(cloud.color[i]);
    }
    Bring(&sphere_, std::span<const kernels::Sphere>(spheres), "metaballs");
    Bring(&threshold_, std::span<const float>(thresholds), "thresholds");
    Bring(&color_, std::span<const std::uint32_t>(colors), "colours");
    Bring(&srgb_table_, std::span<const float>(SrgbToLinearTable(), 256), "tables");
  }

  // ---- the picture ----------------------------------------------------------------------------

  void ReleasePicture() {
    machine_.Release(&out_color_);
    machine_.Release(&out_depth_);
    machine_.Release(&out_normal_);
    machine_.Release(&out_id_);
  }

  // The rows of a band, for which there is room on the machine when this returns, beside
  // launch_bytes for the kernel's threads.
  int ReserveBand(const Frame& frame, std::uint64_t launch_bytes) {
    const auto width = static_cast<std::uint64_t>(frame.width);
    const std::uint64_t wanted =
        std::clamp<std::uint64_t>(kBandRays / width, 1, static_cast<std::uint64_t>(frame.height));
    const auto planes = [&](const auto& f) {  // every plane that is drawn
      f(&out_color_, true);
      f(&out_depth_, !frame.depth.empty());
      f(&out_normal_, !frame.normal.empty());
      f(&out_id_, !frame.id.empty());
    };
    const auto bytes_of = []<class T>(const Buffer<T>*, std::uint64_t n) { return n * sizeof(T); };
    bool held = true;
    std::uint64_t row_bytes = 0;
    planes([&](auto* buffer, bool drawn) {
      if (!drawn) return;
      row_bytes += bytes_of(buffer, width);
      held = held && buffer->bytes() >= bytes_of(buffer, width * wanted);
    });
    std::uint64_t rows = wanted;
    if (!held) {  // asking the machine takes its time
      ReleasePicture();
      const std::uint64_t available = machine_.AvailableBytes();
      rows =
          available > launch_bytes ? std::min(wanted, (available - launch_bytes) / row_bytes) : 0;
      if (rows == 0) {
        const std::uint64_t needed = row_bytes + launch_bytes;
        throw ResourceError("one row of this picture needs " + Megabytes(needed) + " of " +
                                machine_.memory_name() + ", of which " + Megabytes(available) +
                                " are free; choose a level with fewer metaballs, a lower depth of "
                                "the octree or the CPU",
                            needed, available);
      }
    }
    planes([&](auto* buffer, bool drawn) {
      machine_.ResizeExactly(buffer, drawn ? width * rows : 0, "picture");
    });
    return static_cast<int>(rows);
  }

  void Trace(const Scene& scene, const Camera& local, const Control& control, Frame* frame) {
    using Counts = std::array<kernels::ThesisCounts, kernels::kThesisCounts>;
    machine_.Resize(&counts_, kernels::kThesisCounts, "counters");
    machine_.Zero(&counts_, kernels::kThesisCounts);
    // What CUDA once took for the threads of a kernel, it keeps.
    std::uint64_t launch_bytes = 0;
    WithKernel(scene, [&]<class Kernel>(const auto&) {
      launch_bytes = machine_.template LaunchBytes<Kernel>();
    });
    const int rows =
        ReserveBand(*frame, launch_bytes > launched_bytes_ ? launch_bytes - launched_bytes_ : 0);
    for (int y = 0; y < frame->height; y += rows) {
      control.ThrowIfStopped();
      const int count = std::min(rows, frame->height - y);
      machine_.Mark(FrameStage::kBegin);
      WithKernel(scene, [&]<class Kernel>(const auto& shape) {
        Launch<Kernel>(shape, scene, local, y, count);
      });
      launched_bytes_ = std::max(launched_bytes_, launch_bytes);
      machine_.Mark(FrameStage::kTraced);
      CopyOut(y, count, frame);
      machine_.Mark(FrameStage::kEnd);
      frame->stats.seconds_trace += machine_.Seconds(FrameStage::kBegin, FrameStage::kTraced);
      control.Report("tracing", static_cast<double>(y + count) / frame->height);
    }
    Counts counts;
    machine_.Download(counts.data(), counts_, counts.size());
    for (const kernels::ThesisCounts& c : counts) {
      frame->stats.hits += c.hits;
      frame->stats.rays_started_inside += c.started_inside;
      frame->stats.unresolved += c.unresolved;
    }
  }

  // Calls visit.operator()<Kernel>(shape) with the kernel that the features of the scene choose.
  template <class Visit>
  void WithKernel(const Scene& scene, const Visit& visit) const {
    if (precision_ == ThesisPrecision::kFloat) {
      WithKernelIn<float>(scene, visit);
    } else {
      WithKernelIn<double>(scene, visit);
    }
  }
  template <class Real, class Visit>
  static void WithKernelIn(const Scene& scene, const Visit& visit) {
    const DensityShape shape = ResolveDensity(scene.surface.density).shape;
    const bool own = !scene.cloud->radius.empty() || HasOwnThresholds(scene);
    const auto with = [&]<class Shape>(const Shape& s) {
      using kernels::ThesisRays, kernels::ThesisTraits;
      own ? visit.template operator()<ThesisRays<ThesisTraits<Real, Shape, true>>>(s)
          : visit.template operator()<ThesisRays<ThesisTraits<Real, Shape, false>>>(s);
    };
    if (shape == DensityShape{}) {
      with(MurakamiShape{});
    } else {
      with(AnyShape{shape});
    }
  }

  template <class Kernel, class Shape>
  void Launch(const Shape& shape, const Scene& scene, const Camera& local, int first_row,
              int rows) {
    using Real = typename Kernel::Real;
    const Cloud& cloud = *scene.cloud;
    const kernels::ListedArrays metaballs{
        sphere_.data(),     HasOwnThresholds(scene) ? threshold_.data() : nullptr,
        order_.data(),      cloud.color.empty() ? nullptr : color_.data(),
        srgb_table_.data(), LinearFromRgb8(cloud.uniform_color)};
    const auto plane = [](auto& buffer) { return buffer.size() > 0 ? buffer.data() : nullptr; };
    machine_.ForEach("ThesisRays", Kernel::Threads(local.width, rows),
                     Kernel{{local, 1.0 / local.fx, 1.0 / local.fy},
                            first_row,
                            rows,
                            {options_.depth, corner_.cast<Real>(), static_cast<Real>(size_),
                             near_.data(), held_.data(), held_before_.data(), begin_.data()},
                            {metaballs},
                            ThesisDensityOf<Real>(scene, shape),
                            ThesisRulesOf<Real>(scene, options_),
                            PrepareLight(scene.lighting),
                            cloud.frame.unit,
                            out_color_.data(),
                            plane(out_depth_),
                            plane(out_normal_),
                            plane(out_id_),
                            counts_.data()});
  }

  void CopyOut(int first_row, int rows, Frame* frame) {
    const auto copy = [&](auto& plane, const auto& buffer) {
      if (plane.empty()) return;
      const auto width = static_cast<std::size_t>(frame->width);
      machine_.DownloadRect(&plane[first_row * width], width, buffer, 0, width, frame->width, rows);
    };
    copy(frame->color, out_color_);
    copy(frame->depth, out_depth_);
    copy(frame->normal, out_normal_);
    copy(frame->id, out_id_);
  }

  Machine machine_;
  ThesisOptions options_;
  ThesisPrecision precision_;
  // What lies in the machine's memory, and of which scene.
  CloudVersion cloud_;
  double largest_radius_ = 0.0, margin_ = 0.0;
  Vec3d corner_{};
  double size_ = 1.0;
  Buffer<std::uint64_t> near_, held_;
  Buffer<std::uint32_t> held_before_, begin_, order_, color_;
  Buffer<kernels::Sphere> sphere_;
  Buffer<float> threshold_, srgb_table_;
  // A band's.
  Buffer<Pixel> out_color_;
  Buffer<float> out_depth_;
  Buffer<Vec3f> out_normal_;
  Buffer<std::int32_t> out_id_;
  Buffer<kernels::ThesisCounts> counts_;
  std::uint64_t launched_bytes_ = 0;  // LaunchBytes of the kernels so far, at most
};

}  // namespace sherd
