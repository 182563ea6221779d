#include "reconstruction/back_faces.h"

#include <algorithm>
#include <utility>

#include "metaball/photo/back_face.h"
#include "metaball/photo/pyramid.h"
#include "reconstruction/parallel.h"

namespace sherd {
namespace {

constexpr std::size_t kRows = 16;  // worked on at once; even

struct RimPicture {
  RimPicture(int width, int height) : cells(static_cast<std::size_t>(width) * height) {
    level = {cells.data(), width, height};
  }
  std::vector<RimCell> cells;
  RimLevel level;
};

}  // namespace

BackFaces::BackFaces(const SheetView& sheet, const Camera& camera, const Frame& frame) {
  if (!sheet.normal) return;
  const int width = frame.width, height = frame.height;
  const auto ray_of = [&](int x, int y) { return RayThrough(camera, x + 0.5, y + 0.5); };
  const auto place_of = [&](std::uint32_t i) {
    const auto row = static_cast<std::uint32_t>(width);
    return std::pair(static_cast<int>(i % row), static_cast<int>(i / row));
  };
  const auto rows = static_cast<std::size_t>(height);
  std::vector<Facing> facing(frame.id.size(), Facing::kUnknown);
  ParallelBlocks(rows, kRows, [&](std::size_t begin, std::size_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int x = 0; x < width; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * width + x;
        const std::int32_t id = frame.id[i];
        if (id < 0 || static_cast<std::uint32_t>(id) >= sheet.count) continue;
        facing[i] = FacingOf(sheet.normal[id], ray_of(x, y).direction);
      }
    }
  });
  std::vector<std::uint32_t> backs;
  for (std::size_t i = 0; i < facing.size(); ++i) {
    if (facing[i] == Facing::kBack) backs.push_back(static_cast<std::uint32_t>(i));
  }
  if (backs.empty()) return;
  for (const std::uint32_t i : backs) {
    const auto [x, y] = place_of(i);
    for (int v = std::max(0, y - kRimWidth); v <= std::min(height - 1, y + kRimWidth); ++v) {
      for (int u = std::max(0, x - kRimWidth); u <= std::min(width - 1, x + kRimWidth); ++u) {
        Facing& near = facing[static_cast<std::size_t>(v) * width + u];
        if (near == Facing::kFront) near = Facing::kRim;
      }
    }
  }
  // The rims, on the sheet: the field's own surface turns away there. At half the size, which is
  // all that pixels of which nothing is known are filled from; a block's rows are an even number.
  std::vector<RimPicture> sizes;
  sizes.emplace_back(HalvedSide(width), HalvedSide(height));
  const RimLevel rim = sizes.front().level;
  ParallelBlocks(rows, kRows, [&](std::size_t begin, std::size_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int x = 0; x < width; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * width + x;
        if (facing[i] != Facing::kRim) continue;
        rim.At(x / 2, y / 2)
            .Add(RimOf(sheet, ray_of(x, y), frame.depth[i], frame.id[i], frame.normal[i]), 1);
      }
    }
  });
  for (RimCell& cell : sizes.front().cells) cell.Saturate();
  while (sizes.back().level.width > 1 || sizes.back().level.height > 1) {
    const RimLevel fine = sizes.back().level;
    sizes.emplace_back(HalvedSide(fine.width), HalvedSide(fine.height));
    const RimLevel& coarse = sizes.back().level;
    for (int y = 0; y < coarse.height; ++y) {
      for (int x = 0; x < coarse.width; ++x) coarse.Pull(fine, x, y);
    }
  }
  for (std::size_t k = sizes.size() - 1; k > 0; --k) {
    const RimLevel& fine = sizes[k - 1].level;
    for (int y = 0; y < fine.height; ++y) {
      for (int x = 0; x < fine.width; ++x) fine.Push(sizes[k].level, x, y);
    }
  }
  for (const std::uint32_t i : backs) {
    const auto [x, y] = place_of(i);
    const RimCell filled = rim.Between(x, y);
    if (!(filled.weight > 0)) continue;
    pixels_.push_back(
        {i, filled.depth / filled.weight, Normalized(filled.normal, -frame.normal[i])});
  }
}

const BackFaces::Pixel* BackFaces::Find(std::size_t pixel) const {
  const auto found =
      std::lower_bound(pixels_.begin(), pixels_.end(), pixel,
                       [](const Pixel& p, std::size_t wanted) { return p.pixel < wanted; });
  return found != pixels_.end() && found->pixel == pixel ? &*found : nullptr;
}

}  // namespace sherd
