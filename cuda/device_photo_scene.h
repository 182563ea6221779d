// What photographs' colours are made from, in a machine's memory (machine.h): brought over when it
// is first asked for. All but the photographs' pixels (photo_tiles.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "metaball/photo/photo_choice.h"
#include "metaball/photo/photo_shader.h"
#include "metaball/photo/sheet_view.h"

namespace sherd {

template <class Machine>
class DevicePhotoScene {
 public:
  void Use(const PhotoScene& scene, Machine* machine) {
    if (sheet_key_ != scene.sheet_key) {
      sheet_key_ = 0;
      UseSheet(scene.sheet, machine);
      sheet_key_ = scene.sheet_key;
    }
    UseSights(scene, machine);
    UseMasks(scene, machine);
    BringAll(&camera_, scene.camera, "photographs", machine);
    BringAll(&gain_, scene.gain, "photographs", machine);
    BringAll(&candidate_, scene.candidates, "photographs", machine);
    candidates_ = static_cast<std::uint32_t>(scene.candidates.size());
    has_gains_ = !scene.gain.empty();
  }

  const SheetView& sheet() const { return sheet_; }
  PhotosView photos() const {
    return {camera_.data(), sight_.data(), has_masks_ ? mask_.data() : nullptr, candidate_.data(),
            candidates_};
  }
  const Vec3f* gains() const { return has_gains_ ? gain_.data() : nullptr; }

 private:
  template <class T>
  using Buffer = typename Machine::template Buffer<T>;

  template <class T, class Values>
  void BringAll(Buffer<T>* buffer, const Values& values, const char* what, Machine* machine) {
    Bring(buffer, values.data(), values.size(), what, machine);
  }
  // Returns where it lies; null for null.
  template <class T>
  const T* Bring(Buffer<T>* buffer, const T* values, std::size_t n, const char* what,
                 Machine* machine) {
    if (!values) n = 0;
    machine->ResizeExactly(buffer, n, what);
    machine->Upload(buffer, 0, values, n);
    return values ? buffer->data() : nullptr;
  }

  void UseSheet(const SheetView& sheet, Machine* machine) {
    const std::size_t n = sheet.count;
    const SupportIndexView& index = sheet.index;
    constexpr const char* kWhat = "the metaballs' sheet";
    sheet_ = sheet;
    sheet_.center = Bring(&center_, sheet.center, n, kWhat, machine);
    sheet_.radius = Bring(&radius_, sheet.radius, n, kWhat, machine);
    sheet_.normal = Bring(&normal_, sheet.normal, n, kWhat, machine);
    sheet_.depth = Bring(&depth_, sheet.depth, n, kWhat, machine);
    sheet_.photo_begin = Bring(&photo_begin_, sheet.photo_begin, n + 1, kWhat, machine);
    const std::size_t listed = sheet.photo_begin ? sheet.photo_begin[n] : 0;
    sheet_.photo_idx = Bring(&photo_idx_, sheet.photo_idx, listed, kWhat, machine);
    sheet_.index.table = Bring(&slot_, index.table, index.slots, kWhat, machine);
    sheet_.index.entries = Bring(&entry_, index.entries, index.entry_count, kWhat, machine);
  }

  // Of the candidates; those of one surface stay.
  void UseSights(const PhotoScene& scene, Machine* machine) {
    if (sight_key_ != scene.sight_key || sights_.size() != scene.sight.size()) {
      for (Planes& planes : planes_) {
        machine->Release(&planes.depth);
        machine->Release(&planes.inside);
      }
      planes_.clear();
      planes_.resize(scene.sight.size());
      sights_.assign(scene.sight.size(), {});
      sight_key_ = scene.sight_key;
    }
    for (const std::uint32_t photo : scene.candidates) {
      const SightMap& from = scene.sight[photo];
      if (!from.depth || sights_[photo].depth) continue;
      Planes& planes = planes_[photo];
      constexpr const char* kWhat = "depth maps";
      SightMap sight = from;
      sight.inside = Bring(&planes.inside, from.inside, from.pixels(), kWhat, machine);
      sight.depth = Bring(&planes.depth, from.depth, from.pixels(), kWhat, machine);
      sights_[photo] = sight;
    }
    BringAll(&sight_, sights_, "depth maps", machine);
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
      MaskDistanceView mask = from;
      mask.quarters = Bring(&quarters_[i], from.quarters, from.cells(), "masks", machine);
      masks_[i] = mask;
    }
    BringAll(&mask_, masks_, "masks", machine);
  }

  std::uint64_t sheet_key_ = 0, sight_key_ = 0;  // 0: none
  SheetView sheet_;
  Buffer<Vec3f> center_, normal_;
  Buffer<float> radius_, depth_;
  Buffer<std::uint32_t> photo_begin_, entry_;
  Buffer<std::uint16_t> photo_idx_;
  Buffer<SupportIndexView::Slot> slot_;
  // By photograph.
  struct Planes {
    Buffer<float> depth;
    Buffer<std::uint8_t> inside;
  };
  std::vector<Planes> planes_;
  std::vector<SightMap> sights_;
  std::vector<Buffer<std::uint8_t>> quarters_;
  std::vector<MaskDistanceView> masks_;
  Buffer<SightMap> sight_;
  Buffer<MaskDistanceView> mask_;
  Buffer<PhotoCamera> camera_;
  Buffer<Vec3f> gain_;
  Buffer<std::uint32_t> candidate_;
  std::uint32_t candidates_ = 0;
  bool has_masks_ = false, has_gains_ = false;
};

}  // namespace sherd
