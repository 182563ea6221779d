#include "reconstruction/back_faces.h"

#include <algorithm>
#include <utility>

#include "metaball/photo/pyramid.h"
#include "reconstruction/parallel.h"

namespace sherd {
namespace {

// Cosine between the viewing ray and the normal of a pixel's strongest metaball: outlines, where it
// may have either sign, are left alone.
constexpr double kFromBehind = 0.1;
constexpr int kRimWidth = 2;       // pixels
constexpr std::size_t kRows = 16;  // worked on at once; even

// kRim: a front beside a back.
enum class Facing : char { kUnknown, kFront, kRim, kBack };

// Weighted sums of depth and normal for each cell of a coarser picture.
struct Sums {
  int width = 0, height = 0;
  struct Cell {
    float weight = 0, depth = 0;
    Vec3f normal{};
    void Add(const Cell& other, float share) {
      weight += share * other.weight;
      depth += share * other.depth;
      normal += other.normal * share;
    }
  };
  std::vector<Cell> cell;

  Sums(int w, int h) : width(w), height(h), cell(static_cast<std::size_t>(w) * h) {}
  Cell& At(int x, int y) { return cell[static_cast<std::size_t>(y) * width + x]; }
  const Cell& At(int x, int y) const { return cell[static_cast<std::size_t>(y) * width + x]; }
  // What is well known counts once.
  void Saturate() {
    for (Cell& c : cell) {
      const float over = std::max(1.0f, c.weight);
      c = {c.weight / over, c.depth / over, c.normal / over};
    }
  }
  // At the pixel (x, y) of a picture twice as wide, bilinear.
  Cell Between(int x, int y) const {
    const int x0 = x / 2, x1 = std::clamp(x % 2 ? x0 + 1 : x0 - 1, 0, width - 1);
    const int y0 = y / 2, y1 = std::clamp(y % 2 ? y0 + 1 : y0 - 1, 0, height - 1);
    Cell out;
    out.Add(At(x0, y0), 9.0f / 16);
    out.Add(At(x1, y0), 3.0f / 16);
    out.Add(At(x0, y1), 3.0f / 16);
    out.Add(At(x1, y1), 1.0f / 16);
    return out;
  }
};

Sums Pulled(const Sums& fine) {
  Sums out(HalvedSide(fine.width), HalvedSide(fine.height));
  for (int y = 0; y < fine.height; ++y) {
    for (int x = 0; x < fine.width; ++x) out.At(x / 2, y / 2).Add(fine.At(x, y), 1.0f);
  }
  out.Saturate();
  return out;
}

// Adds to every cell, as far as it is not known, what the coarser picture has there.
void Push(const Sums& coarse, Sums* fine) {
  for (int y = 0; y < fine->height; ++y) {
    for (int x = 0; x < fine->width; ++x) {
      Sums::Cell& cell = fine->At(x, y);
      const float missing = 1 - cell.weight;
      if (missing > 0) cell.Add(coarse.Between(x, y), missing);
    }
  }
}

}  // namespace

BackFaces::BackFaces(const Level& level, const SurfaceSampler& sampler, const Camera& camera,
                     const Frame& frame) {
  if (level.normal.size() != level.cloud.size()) return;
  const auto ray_of = [&](int x, int y) { return RayThrough(camera, x + 0.5, y + 0.5); };
  const auto place_of = [&](std::uint32_t i) {
    const auto width = static_cast<std::uint32_t>(frame.width);
    return std::pair(static_cast<int>(i % width), static_cast<int>(i / width));
  };
  const auto rows = static_cast<std::size_t>(frame.height);
  std::vector<Facing> facing(frame.id.size(), Facing::kUnknown);
  ParallelBlocks(rows, kRows, [&](std::size_t begin, std::size_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int x = 0; x < frame.width; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * frame.width + x;
        const std::int32_t id = frame.id[i];
        if (id < 0 || static_cast<std::size_t>(id) >= level.normal.size()) continue;
        const double cosine = Dot(level.normal[id].cast<double>(), ray_of(x, y).direction);
        facing[i] = cosine > kFromBehind ? Facing::kBack
                    : cosine < 0         ? Facing::kFront
                                         : Facing::kUnknown;
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
    for (int v = std::max(0, y - kRimWidth); v <= std::min(frame.height - 1, y + kRimWidth); ++v) {
      for (int u = std::max(0, x - kRimWidth); u <= std::min(frame.width - 1, x + kRimWidth); ++u) {
        Facing& near = facing[static_cast<std::size_t>(v) * frame.width + u];
        if (near == Facing::kFront) near = Facing::kRim;
      }
    }
  }
  // The rims, on the sheet: the field's own surface turns away there. At half the size, which is
  // all that pixels of which nothing is known are filled from; a block's rows are an even number.
  Sums rim(HalvedSide(frame.width), HalvedSide(frame.height));
  ParallelBlocks(rows, kRows, [&](std::size_t begin, std::size_t end) {
    SurfacePoint point;
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int x = 0; x < frame.width; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * frame.width + x;
        if (facing[i] != Facing::kRim) continue;
        const RayD ray = ray_of(x, y);
        sampler.Sample(level, ray.origin + ray.direction * double(frame.depth[i]), ray.direction,
                       frame.id[i], frame.normal[i], &point);
        const double depth = Dot(point.position - ray.origin, ray.direction);
        rim.At(x / 2, y / 2).Add({1, static_cast<float>(depth), point.normal}, 1);
      }
    }
  });
  rim.Saturate();
  std::vector<Sums> sizes{std::move(rim)};
  while (sizes.back().width > 1 || sizes.back().height > 1) sizes.push_back(Pulled(sizes.back()));
  for (std::size_t k = sizes.size() - 1; k > 0; --k) Push(sizes[k], &sizes[k - 1]);
  for (const std::uint32_t i : backs) {
    const auto [x, y] = place_of(i);
    const Sums::Cell filled = sizes.front().Between(x, y);
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
