#include "reconstruction/hovering.h"

#include <algorithm>
#include <cmath>

#include "reconstruction/parallel.h"

namespace sherd {
namespace {

constexpr std::size_t kBlock = 4096;
constexpr int kNeighbors = 40;                  // on an even surface up to 3.6 spacings away
constexpr double kBehind = 1.0, kBeside = 0.5;  // spacings
// Square enough: on a plane seen at this cosine a point one spacing behind lies 0.75 beside.
constexpr double kSquare = 0.6;
constexpr std::size_t kFewestWitnesses = 3;

}  // namespace

void FindHovering(const Survey& survey, const SurveyPoints& points, const NeighborSearch& search,
                  const std::vector<float>& spacing, std::vector<char>* stray,
                  const Control& control) {
  const std::size_t n = points.size();
  if (points.photo_begin.empty() || points.normal.size() != n) return;
  std::vector<Vec3d> centers;
  for (const Photograph& photo : survey.photographs) {
    centers.push_back(photo.cam_from_world.Center());
  }
  std::vector<char> found(n, 0);
  ParallelBlocks(
      n, kBlock,
      [&](std::size_t begin, std::size_t end) {
        int idx[kNeighbors];
        float distance[kNeighbors];
        std::vector<std::uint32_t> witnesses;
        for (std::size_t i = begin; i < end; ++i) {
          if ((*stray)[i]) continue;
          const int count = search.Nearest(i, kNeighbors, idx, distance);
          // The spacing of the surface, not that of a string of noise above it.
          float around[kNeighbors];
          int known = 0;
          for (int k = 0; k < count; ++k) {
            const auto j = static_cast<std::size_t>(idx[k]);
            if (j != i && !(*stray)[j]) around[known++] = spacing[j];
          }
          if (known == 0) continue;
          std::nth_element(around, around + known / 2, around + known);
          const double step = around[known / 2];
          const std::uint32_t* const own = points.photo_idx.data() + points.photo_begin[i];
          const std::uint32_t* const own_end = points.photo_idx.data() + points.photo_begin[i + 1];
          witnesses.clear();
          for (int k = 0; k < count; ++k) {
            const auto j = static_cast<std::size_t>(idx[k]);
            if (j == i || (*stray)[j]) continue;
            const Vec3d normal = points.normal[j].cast<double>();
            const Vec3d to_point = points.position[i] - points.position[j];
            // Not above the neighbour's surface: the most, and soon found out.
            if (Dot(to_point, normal) < 0.5 * kBehind * step) continue;
            for (std::uint64_t l = points.photo_begin[j]; l < points.photo_begin[j + 1]; ++l) {
              const std::uint32_t photo = points.photo_idx[l];
              if (std::find(own, own_end, photo) != own_end) continue;
              const Vec3d way = centers[photo] - points.position[j];
              const double length = Length(way);
              if (!(Dot(way, normal) > kSquare * length)) continue;
              const double along = Dot(to_point, way) / length;
              if (along < kBehind * step) continue;
              if (Dot(to_point, to_point) - along * along > kBeside * kBeside * step * step)
                continue;
              witnesses.push_back(photo);
            }
          }
          std::sort(witnesses.begin(), witnesses.end());
          const auto against = static_cast<std::size_t>(
              std::unique(witnesses.begin(), witnesses.end()) - witnesses.begin());
          found[i] =
              against >= kFewestWitnesses && against > static_cast<std::size_t>(own_end - own);
        }
      },
      control, "finding points that hover", 0.85, 0.9);
  for (std::size_t i = 0; i < n; ++i) {
    if (found[i]) (*stray)[i] = 1;
  }
}

}  // namespace sherd
