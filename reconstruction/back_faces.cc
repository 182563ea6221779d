#include "reconstruction/back_faces.h"

#include <algorithm>
#include <cmath>

#include "reconstruction/parallel.h"

namespace sherd {
namespace {

// Cosine between the viewing ray and the normal of a pixel's strongest metaball: outlines, where it
// may have either sign, are left alone.
constexpr double kFromBehind = 0.1;
constexpr int kRim = 2;  // pixels
constexpr std::size_t kRows = 16;

enum class Facing : char { kUnknown, kFront, kBack };

// Sums of what is known, by pixel of one size of the picture.
struct Sums {
  int width = 0, height = 0;
  std::vector<float> weight, depth;
  std::vector<Vec3f> normal;

  Sums(int w, int h)
      : width(w),
        height(h),
        weight(static_cast<std::size_t>(w) * h, 0.0f),
        depth(weight.size(), 0.0f),
        normal(weight.size()) {}
  void Add(std::size_t to, const Sums& from, std::size_t at, float share) {
    weight[to] += share * from.weight[at];
    depth[to] += share * from.depth[at];
    normal[to] += from.normal[at] * share;
  }
};

// Half the size; what is well known counts once.
Sums Pulled(const Sums& fine) {
  Sums out((fine.width + 1) / 2, (fine.height + 1) / 2);
  for (int y = 0; y < fine.height; ++y) {
    for (int x = 0; x < fine.width; ++x) {
      out.Add(static_cast<std::size_t>(y / 2) * out.width + x / 2, fine,
              static_cast<std::size_t>(y) * fine.width + x, 1.0f);
    }
  }
  for (std::size_t i = 0; i < out.weight.size(); ++i) {
    const float over = std::max(1.0f, out.weight[i]);
    out.weight[i] /= over;
    out.depth[i] /= over;
    out.normal[i] = out.normal[i] / over;
  }
  return out;
}

// Adds to every pixel, as far as it is not known, what the coarser picture has there (bilinear).
void Push(const Sums& coarse, Sums* fine) {
  for (int y = 0; y < fine->height; ++y) {
    const int y0 = y / 2, y1 = std::clamp(y % 2 ? y0 + 1 : y0 - 1, 0, coarse.height - 1);
    for (int x = 0; x < fine->width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * fine->width + x;
      const float missing = 1 - fine->weight[i];
      if (!(missing > 0)) continue;
      const int x0 = x / 2, x1 = std::clamp(x % 2 ? x0 + 1 : x0 - 1, 0, coarse.width - 1);
      const auto at = [&](int px, int py) {
        return static_cast<std::size_t>(py) * coarse.width + px;
      };
      fine->Add(i, coarse, at(x0, y0), missing * 9 / 16);
      fine->Add(i, coarse, at(x1, y0), missing * 3 / 16);
      fine->Add(i, coarse, at(x0, y1), missing * 3 / 16);
      fine->Add(i, coarse, at(x1, y1), missing * 1 / 16);
    }
  }
}

}  // namespace

BackFaces::BackFaces(const Level& level, const SurfaceSampler& sampler, const Camera& camera,
                     const Frame& frame) {
  if (level.normal.size() != level.cloud.size()) return;
  const auto ray_of = [&](int x, int y) { return RayThrough(camera, x + 0.5, y + 0.5); };
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
  const auto back = [&](std::size_t i) { return facing[i] == Facing::kBack; };
  if (std::find(facing.begin(), facing.end(), Facing::kBack) == facing.end()) return;
  // The rims, on the sheet: the field's own surface turns away there.
  Sums rim(frame.width, frame.height);
  ParallelBlocks(rows, kRows, [&](std::size_t begin, std::size_t end) {
    SurfacePoint point;
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int x = 0; x < frame.width; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * frame.width + x;
        if (facing[i] != Facing::kFront) continue;
        bool near = false;
        for (int v = std::max(0, y - kRim); v <= std::min(frame.height - 1, y + kRim); ++v) {
          for (int u = std::max(0, x - kRim); u <= std::min(frame.width - 1, x + kRim); ++u) {
            near = near || back(static_cast<std::size_t>(v) * frame.width + u);
          }
        }
        if (!near) continue;
        const RayD ray = ray_of(x, y);
        sampler.Sample(level, ray.origin + ray.direction * double(frame.depth[i]), ray.direction,
                       frame.id[i], frame.normal[i], &point);
        rim.weight[i] = 1;
        rim.depth[i] = static_cast<float>(Dot(point.position - ray.origin, ray.direction));
        rim.normal[i] = point.normal;
      }
    }
  });
  std::vector<Sums> sizes{std::move(rim)};
  while (sizes.back().width > 1 || sizes.back().height > 1) sizes.push_back(Pulled(sizes.back()));
  for (std::size_t k = sizes.size() - 1; k > 0; --k) Push(sizes[k], &sizes[k - 1]);
  const Sums& filled = sizes.front();
  depth_.assign(facing.size(), 0.0f);
  normal_.assign(facing.size(), {});
  for (std::size_t i = 0; i < facing.size(); ++i) {
    if (!back(i) || !(filled.weight[i] > 0)) continue;
    depth_[i] = filled.depth[i] / filled.weight[i];
    normal_[i] = Normalized(filled.normal[i], -frame.normal[i]);
  }
}

}  // namespace sherd
