// What photographs' colours are made from, in a machine's memory (machine.h): brought over when it
// is first asked for. All but the photographs' pixels (photo_tiles.h).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <list>
#include <vector>

#include "metaball/error.h"
#include "metaball/photo/photo_choice.h"
#include "metaball/photo/photo_shader.h"
#include "metaball/photo/sheet_view.h"

namespace sherd {

// The sheet of a level's metaballs.
template <class Machine>
class DeviceSheet {
 public:
  void Use(const PhotoScene& scene, Machine* machine) {
    if (view_.index.table) return;
    const SheetView& sheet = scene.sheet;
    const std::size_t n = sheet.count;
    SheetView view = sheet;
    const auto bring = [&](auto* buffer, const auto* values, std::size_t count) {
      machine->ResizeExactly(buffer, values ? count : 0, "the metaballs' sheet");
      machine->Upload(buffer, 0, values, values ? count : 0);
      return values ? buffer->data() : nullptr;
    };
    view.center = bring(&center_, sheet.center, n);
    view.radius = bring(&radius_, sheet.radius, n);
    view.normal = bring(&normal_, sheet.normal, n);
    view.depth = bring(&depth_, sheet.depth, n);
    view.photo_begin = bring(&photo_begin_, sheet.photo_begin, n + 1);
    view.photo_idx =
        bring(&photo_idx_, sheet.photo_idx, sheet.photo_begin ? sheet.photo_begin[n] : 0);
    view.index.entries = bring(&entry_, sheet.index.entries, sheet.index.entry_count);
    view.index.table = bring(&slot_, sheet.index.table, sheet.index.slots);
    view_ = view;
  }
  const SheetView& view() const { return view_; }

  void Release(Machine* machine) {
    view_ = {};
    machine->Release(&center_);
    machine->Release(&normal_);
    machine->Release(&radius_);
    machine->Release(&depth_);
    machine->Release(&photo_begin_);
    machine->Release(&photo_idx_);
    machine->Release(&entry_);
    machine->Release(&slot_);
  }

 private:
  template <class T>
  using Buffer = typename Machine::template Buffer<T>;

  SheetView view_;  // without a table until all is there
  Buffer<Vec3f> center_, normal_;
  Buffer<float> radius_, depth_;
  Buffer<std::uint32_t> photo_begin_, entry_;
  Buffer<std::uint16_t> photo_idx_;
  Buffer<SupportIndexView::Slot> slot_;
};

// What photographs see of a surface: those of the candidates so far.
template <class Machine>
class DeviceSights {
 public:
  void Use(const PhotoScene& scene, Machine* machine) {
    views_.resize(scene.sight.size());
    std::vector<std::uint32_t> missing;
    std::size_t pixels = 0;
    for (const std::uint32_t photo : scene.candidates) {
      if (!scene.sight[photo].depth || views_[photo].depth) continue;
      missing.push_back(photo);
      pixels += scene.sight[photo].pixels();
    }
    if (!missing.empty()) {
      planes_.emplace_back();
      Planes& planes = planes_.back();
      try {
        machine->ResizeExactly(&planes.depth, pixels, "depth maps");
        machine->ResizeExactly(&planes.inside, pixels, "depth maps");
      } catch (const ResourceError&) {
        Release(&planes, machine);
        planes_.pop_back();
        throw;
      }
      std::size_t at = 0;
      for (const std::uint32_t photo : missing) {
        const SightMap& from = scene.sight[photo];
        machine->Upload(&planes.depth, at, from.depth, from.pixels());
        machine->Upload(&planes.inside, at, from.inside, from.pixels());
        at += from.pixels();
      }
      at = 0;
      for (const std::uint32_t photo : missing) {
        views_[photo] = {scene.sight[photo].camera, planes.depth.data() + at,
                         planes.inside.data() + at};
        at += views_[photo].pixels();
      }
    }
    machine->ResizeExactly(&view_, views_.size(), "depth maps");
    machine->Upload(&view_, 0, views_.data(), views_.size());
  }
  const SightMap* views() const { return view_.data(); }

  void Release(Machine* machine) {
    for (Planes& planes : planes_) Release(&planes, machine);
    planes_.clear();
    views_.clear();
    machine->Release(&view_);
  }

 private:
  template <class T>
  using Buffer = typename Machine::template Buffer<T>;

  struct Planes {  // of several photographs, one after another
    Buffer<float> depth;
    Buffer<std::uint8_t> inside;
  };
  static void Release(Planes* planes, Machine* machine) {
    machine->Release(&planes->depth);
    machine->Release(&planes->inside);
  }
  std::vector<Planes> planes_;
  std::vector<SightMap> views_;  // by photograph
  Buffer<SightMap> view_;
};

template <class Machine>
class DevicePhotoScene {
 public:
  void Use(const PhotoScene& scene, Machine* machine) {
    UseOne(scene, scene.sheet_key, &sheets_, machine);
    UseOne(scene, scene.sight_key, &sights_, machine);
    UseMasks(scene, machine);
    BringAll(&gain_, scene.gain, machine);
    BringAll(&candidate_, scene.candidates, machine);
    candidates_ = static_cast<std::uint32_t>(scene.candidates.size());
    has_gains_ = !scene.gain.empty();
    UseCameras(scene, machine);
  }
  // Anew where a photograph may have become unusable meanwhile.
  void UseCameras(const PhotoScene& scene, Machine* machine) {
    BringAll(&camera_, scene.camera, machine);
  }

  // Gives back what other surfaces need; false where there is none.
  bool ReleaseOthers(Machine* machine) {
    const bool any = sheets_.size() > 1 || sights_.size() > 1;
    while (sheets_.size() > 1) DropLast(&sheets_, machine);
    while (sights_.size() > 1) DropLast(&sights_, machine);
    return any;
  }

  const SheetView& sheet() const { return sheets_.front().content.view(); }
  PhotosView photos() const {
    return {camera_.data(), sights_.front().content.views(), has_masks_ ? mask_.data() : nullptr,
            candidate_.data(), candidates_};
  }
  const Vec3f* gains() const { return has_gains_ ? gain_.data() : nullptr; }

 private:
  template <class T>
  using Buffer = typename Machine::template Buffer<T>;

  // Those used last stay: views beside each other are drawn in turn.
  static constexpr std::size_t kMost = 4;
  template <class Content>
  struct Keyed {
    std::uint64_t key = 0;
    Content content;
  };

  // Makes the one of that key the first.
  template <class Content>
  void UseOne(const PhotoScene& scene, std::uint64_t key, std::list<Keyed<Content>>* held,
              Machine* machine) {
    const auto known = std::ranges::find_if(
        *held, [key](const Keyed<Content>& keyed) { return keyed.key == key; });
    if (known != held->end()) {
      held->splice(held->begin(), *held, known);
    } else {
      while (held->size() >= kMost) DropLast(held, machine);
      held->emplace_front();
      held->front().key = key;
    }
    try {
      held->front().content.Use(scene, machine);
    } catch (const ResourceError&) {
      if (!ReleaseOthers(machine)) throw;
      held->front().content.Use(scene, machine);
    }
  }
  template <class Content>
  static void DropLast(std::list<Keyed<Content>>* held, Machine* machine) {
    held->back().content.Release(machine);
    held->pop_back();
  }

  // Each once: they do not change.
  void UseMasks(const PhotoScene& scene, Machine* machine) {
    has_masks_ = !scene.mask.empty();
    if (!has_masks_) return;
    quarters_.resize(scene.mask.size());
    masks_.resize(scene.mask.size());
    for (std::size_t i = 0; i < masks_.size(); ++i) {
      const MaskDistanceView& from = scene.mask[i];
      if (!from.quarters || masks_[i].quarters) continue;
      machine->ResizeExactly(&quarters_[i], from.cells(), "masks");
      machine->Upload(&quarters_[i], 0, from.quarters, from.cells());
      masks_[i] = from;
      masks_[i].quarters = quarters_[i].data();
    }
    BringAll(&mask_, masks_, machine);
  }

  template <class T, class Values>
  void BringAll(Buffer<T>* buffer, const Values& values, Machine* machine) {
    machine->ResizeExactly(buffer, values.size(), "photographs");
    machine->Upload(buffer, 0, values.data(), values.size());
  }

  std::list<Keyed<DeviceSheet<Machine>>> sheets_;  // the one in use first
  std::list<Keyed<DeviceSights<Machine>>> sights_;
  // By photograph.
  std::vector<Buffer<std::uint8_t>> quarters_;
  std::vector<MaskDistanceView> masks_;
  Buffer<MaskDistanceView> mask_;
  Buffer<PhotoCamera> camera_;
  Buffer<Vec3f> gain_;
  Buffer<std::uint32_t> candidate_;
  std::uint32_t candidates_ = 0;
  bool has_masks_ = false, has_gains_ = false;
};

}  // namespace sherd
