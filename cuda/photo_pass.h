// The photographs' colours on a frame, on whichever machine (machine.h): the order of the kernels
// of kernels/photo_colors.h and kernels/photo_tiles.h. Included by host_loop.cc and
// photo_shader.cu.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "cuda/device_photo_scene.h"
#include "cuda/kernels/photo_colors.h"
#include "cuda/kernels/photo_tiles.h"
#include "cuda/machine.h"
#include "cuda/photo_shader.h"
#include "cuda/photo_tiles.h"
#include "metaball/color.h"
#include "metaball/error.h"
#include "metaball/photo/pyramid.h"

namespace sherd {

template <class Machine>
class PhotoPass final : public ProfilingPhotoShader {
 public:
  // pool_bytes: PhotoTiles.
  PhotoPass(Machine machine, std::uint64_t pool_bytes)
      : machine_(std::move(machine)), tiles_(pool_bytes, machine_.memory_name()) {}

  void Shade(const PhotoScene& scene, const Camera& camera, PhotoPixels* pixels, Frame* frame,
             PhotoCounts* counts, const Control& control) override {
    for (bool again = false;; again = true) {
      try {
        ShadeOnce(scene, camera, pixels, frame, counts, control);
        return;
      } catch (const ResourceError&) {
        // Other surfaces, and pictures of other sizes, may hold what this one needs.
        scene_.ReleaseOthers(&machine_);
        ReleaseFrame();
        if (again) throw;
      }
    }
  }

  Use use() const override {
    return {tiles_.pool_bytes(), tiles_.held(), tiles_.loaded(), tiles_.rounds()};
  }
  void EnableProfile(bool enable) override { machine_.EnableProfile(enable); }
  std::vector<KernelTime> LastKernels() const override { return machine_.times(); }

 private:
  template <class T>
  using Buffer = typename Machine::template Buffer<T>;

  // Pixels whose lookups are held at once.
  static constexpr std::uint64_t kPartPixels = std::uint64_t{1} << 19;

  void ShadeOnce(const PhotoScene& scene, const Camera& camera, PhotoPixels* pixels, Frame* frame,
                 PhotoCounts* counts, const Control& control) {
    machine_.BeginFrame(control.stop, 0);
    scene_.Use(scene, &machine_);
    tiles_.Use(scene.camera, &machine_);
    const kernels::HitPlanes planes = Bring(camera, *frame);
    Clear(scene.camera.size());
    const bool backs = FindBacks(planes);
    const std::uint64_t all = frame->color.size();
    for (std::uint64_t first = 0; first < all; first += kPartPixels) {
      const std::uint64_t count = std::min(kPartPixels, all - first);
      if (first > 0) scene_.UseCameras(scene, &machine_);
      Choose(planes, backs, scene.show_unseen, first, count);
      SampleAll(kMostPhotos * count, pixels, control);
      const Vec3f unseen = LinearFromRgb8(kUnseenColor);
      machine_.ForEach(
          "BlendPixelPhotos", count,
          kernels::BlendPixelPhotos{planes, scene.show_unseen, unseen, first, lookups_.data(),
                                    colors_.data(), there_.data(), count_.data(), tally_.data()});
      control.Report("projecting the photographs",
                     static_cast<double>(first + count) / static_cast<double>(all));
    }
    // Beside the frame's own, which must stay as they are until all has gone well.
    finished_.resize(all);
    machine_.DownloadRect(finished_.data(), static_cast<std::size_t>(frame->width), color_, 0,
                          static_cast<std::size_t>(frame->width), frame->width, frame->height);
    *counts = Counts(scene.camera.size());
    machine_.EndFrame();
    frame->color.swap(finished_);
  }

  template <class T>
  const T* BringPlane(Buffer<T>* buffer, const std::vector<T>& plane) {
    machine_.Fill(buffer, plane.size(), 0, "picture", [&](std::size_t i) { return plane[i]; });
    return plane.empty() ? nullptr : buffer->data();
  }
  kernels::HitPlanes Bring(const Camera& camera, const Frame& frame) {
    kernels::HitPlanes planes;
    planes.camera = camera;
    planes.depth = BringPlane(&depth_, frame.depth);
    planes.normal = BringPlane(&normal_, frame.normal);
    planes.id = BringPlane(&id_, frame.id);
    planes.light = BringPlane(&light_, frame.light);
    BringPlane(&color_, frame.color);
    planes.color = color_.data();
    return planes;
  }

  void ReleaseFrame() {
    machine_.Release(&depth_);
    machine_.Release(&normal_);
    machine_.Release(&light_);
    machine_.Release(&id_);
    machine_.Release(&color_);
    machine_.Release(&facing_);
    machine_.Release(&cell_);
    machine_.Release(&lookups_);
    machine_.Release(&colors_);
    machine_.Release(&there_);
    machine_.Release(&count_);
    machine_.ReleaseScratch();
  }

  void Clear(std::size_t photographs) {
    machine_.Resize(&looked_into_, photographs, "counters");
    machine_.Zero(&looked_into_, photographs);
    machine_.Resize(&tally_, kernels::PhotoTally::kPlaces, "counters");
    machine_.Zero(&tally_, kernels::PhotoTally::kPlaces);
    machine_.Resize(&counter_, 1, "counters");
  }
  std::uint32_t Counter() {
    std::uint32_t count = 0;
    machine_.Download(&count, counter_, 1);
    return count;
  }

  // Fills rim_ where a pixel shows a back; false where none does.
  bool FindBacks(const kernels::HitPlanes& planes) {
    const SheetView& sheet = scene_.sheet();
    if (!sheet.normal) return false;
    const int width = planes.camera.width, height = planes.camera.height;
    const std::uint64_t pixels = static_cast<std::uint64_t>(width) * height;
    machine_.Resize(&facing_, pixels, "picture");
    machine_.Zero(&counter_, 1);
    machine_.ForEach("FacePixels", pixels,
                     kernels::FacePixels{planes, sheet, facing_.data(), counter_.data()});
    if (Counter() == 0) return false;
    std::vector<RimLevel> levels;
    std::size_t cells = 0;
    const auto add = [&](int w, int h) {
      levels.push_back({nullptr, w, h});
      cells += static_cast<std::size_t>(w) * h;
    };
    add(HalvedSide(width), HalvedSide(height));
    while (levels.back().width > 1 || levels.back().height > 1) {
      add(HalvedSide(levels.back().width), HalvedSide(levels.back().height));
    }
    machine_.Resize(&cell_, cells, "picture");
    RimCell* free = cell_.data();
    for (RimLevel& level : levels) {
      level.cell = free;
      free += CellsOf(level);
    }
    rim_ = levels.front();
    machine_.ForEach("SumRims", CellsOf(rim_),
                     kernels::SumRims{planes, sheet, facing_.data(), rim_});
    for (std::size_t k = 1; k < levels.size(); ++k) {
      machine_.ForEach("PullRims", CellsOf(levels[k]), kernels::PullRims{levels[k - 1], levels[k]});
    }
    for (std::size_t k = levels.size() - 1; k > 0; --k) {
      machine_.ForEach("PushRims", CellsOf(levels[k - 1]),
                       kernels::PushRims{levels[k], levels[k - 1]});
    }
    return true;
  }
  static std::size_t CellsOf(const RimLevel& level) {
    return static_cast<std::size_t>(level.width) * level.height;
  }

  void Choose(const kernels::HitPlanes& planes, bool backs, bool show_unseen, std::uint64_t first,
              std::uint64_t count) {
    machine_.Resize(&lookups_, kMostPhotos * count, "lookups");
    machine_.Resize(&colors_, kMostPhotos * count, "lookups");
    machine_.Resize(&there_, kMostPhotos * count, "lookups");
    machine_.Resize(&count_, count, "lookups");
    machine_.ForEach("ChoosePixelPhotos", count,
                     kernels::ChoosePixelPhotos{planes, scene_.sheet(), scene_.photos(),
                                                backs ? facing_.data() : nullptr, rim_, show_unseen,
                                                first, lookups_.data(), count_.data()});
  }

  // Looks up all lookups of a part, in pieces where the pool does not hold their tiles together.
  void SampleAll(std::uint64_t lookups, PhotoPixels* pixels, const Control& control) {
    std::uint64_t at_once = lookups;
    for (std::uint64_t first = 0; first < lookups;) {
      const std::uint64_t count = std::min(at_once, lookups - first);
      if (Sample(first, count, pixels, control)) {
        first += count;
        continue;
      }
      control.ThrowIfStopped();
      if (count == 1) {
        throw ResourceError(
            "a lookup reads more of a photograph than " + machine_.memory_name() + " may hold",
            tiles_.kTilesOfOneLookup * tiles_.kTileBytes, tiles_.pool_bytes());
      }
      at_once = count / 2;
    }
  }
  bool Sample(std::uint64_t first, std::uint64_t count, PhotoPixels* pixels,
              const Control& control) {
    for (;;) {
      const kernels::PhotoTilesView tiles = tiles_.BeginRound();
      machine_.Zero(&counter_, 1);
      machine_.ForEach("SamplePhotos", count,
                       kernels::SamplePhotos{tiles, lookups_.data(), count_.data(), scene_.gains(),
                                             first, colors_.data(), there_.data(),
                                             looked_into_.data(), counter_.data()});
      if (Counter() == 0) return true;
      if (!tiles_.Load(pixels, control, &machine_)) return false;
    }
  }

  PhotoCounts Counts(std::size_t photographs) {
    constexpr int kPlaces = kernels::PhotoTally::kPlaces;
    std::array<kernels::PhotoTally, kPlaces> tally;
    machine_.Download(tally.data(), tally_, kPlaces);
    PhotoCounts counts;
    for (const kernels::PhotoTally& place : tally) {
      counts.pixels += place.pixels;
      counts.from_photos += place.from_photos;
      counts.across_holes += place.across_holes;
      counts.without_photo += place.without_photo;
    }
    std::vector<std::uint32_t> into(photographs);
    if (photographs > 0) {
      machine_.DownloadRect(into.data(), photographs, looked_into_, 0, photographs,
                            static_cast<int>(photographs), 1);
    }
    for (const std::uint32_t looked : into) counts.used.push_back(looked != 0);
    return counts;
  }

  Machine machine_;
  DevicePhotoScene<Machine> scene_;
  PhotoTiles<Machine> tiles_;
  // A frame's.
  Buffer<float> depth_;
  Buffer<Vec3f> normal_, light_;
  Buffer<std::int32_t> id_;
  Buffer<Pixel> color_;
  Buffer<Facing> facing_;
  Buffer<RimCell> cell_;
  RimLevel rim_;  // half the frame's size, in cell_
  Buffer<std::uint32_t> looked_into_, counter_;
  Buffer<kernels::PhotoTally> tally_;
  std::vector<Pixel> finished_;
  // A part's.
  Buffer<PhotoLookup> lookups_;
  Buffer<PhotoColors> colors_;
  Buffer<std::uint8_t> there_, count_;
};

}  // namespace sherd
