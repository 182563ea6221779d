// Points where the survey has none: from the rims of its holes along the surface that the points
// around a hole stand for.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "reconstruction/downsample.h"
#include "reconstruction/level.h"
#include "reconstruction/memory.h"
#include "reconstruction/neighbors.h"
#include "reconstruction/parallel.h"
#include "reconstruction/point_arrays.h"
#include "reconstruction/seen_through.h"

namespace sherd {
namespace {

constexpr std::size_t kBlock = 2048;
// A rim: in the tangent plane the neighbours within kRimReach local spacings leave this much free.
constexpr int kRimNeighbors = 25;
constexpr double kRimReach = 3.0;
constexpr double kRimGap = 1.6;
constexpr int kSteps = 8;  // from a rim into the hole, a local spacing each
// The surface is taken from means of this many points, so that a hole many spacings wide has all
// that lies around it among few neighbours.
constexpr std::uint64_t kPointsPerMean = 6;
constexpr int kAround = 48;
constexpr int kProjections = 3;
// A place is closed where the means around leave no more than this free in its tangent plane: what
// juts out over a border does not grow, what is enclosed does.
constexpr double kEnclosed = 1.75;
// Of the weights, how much must be left of the sum of the normals: the two faces of a thin wall
// take each other away.
constexpr double kNormalsAgree = 0.5;
// Local spacings from the nearest surveyed point, and between the points that close a hole.
constexpr double kApart = 1.2, kBetween = 0.7;
// What closes a hole has this many others, surveyed or not, within kSurface local spacings.
constexpr int kFewest = 5;
constexpr double kSurface = 2.0;
constexpr int kMostBetween = 64;  // candidates that are looked at around one

// The widest sector that directions leave free.
struct Gap {
  double width = 2 * std::numbers::pi, middle = 0;  // radians
};

// angles: any order, radians in [-pi, pi]; sorted afterwards.
Gap WidestGap(double* angles, int count) {
  Gap gap;
  if (count == 0) return gap;
  std::sort(angles, angles + count);
  gap.width = 0;
  for (int k = 0; k < count; ++k) {
    const double next = k + 1 < count ? angles[k + 1] : angles[0] + 2 * std::numbers::pi;
    if (next - angles[k] > gap.width) gap = {next - angles[k], (next + angles[k]) / 2};
  }
  return gap;
}

struct TangentPlane {
  Vec3d u, v;

  explicit TangentPlane(const Vec3d& normal) : u(Perpendicular(normal)), v(Cross(normal, u)) {}
  double AngleOf(const Vec3d& offset) const { return std::atan2(Dot(offset, v), Dot(offset, u)); }
  Vec3d Direction(double angle) const { return u * std::cos(angle) + v * std::sin(angle); }
};

struct Means {
  std::vector<Vec3d> position;
  std::vector<Vec3d> normal;  // not of unit length where the points' normals differ
  double extent = 0;          // of what one stands for, world units
};

Means MeansOf(const SurveyPoints& points, const Control& control) {
  const PointCells cells = GroupPoints(
      points.position, std::max<std::uint64_t>(1, points.size() / kPointsPerMean), control);
  Means out;
  out.extent = cells.voxel_size;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const std::uint32_t begin = cells.cell_begin[c], end = cells.cell_begin[c + 1];
    Vec3d normal{};
    for (std::uint32_t j = begin; j < end; ++j) {
      normal += points.normal[cells.point_idx[j]].cast<double>();
    }
    out.position.push_back(CentroidOf(points.position, cells, c));
    out.normal.push_back(normal / static_cast<double>(end - begin));
  }
  return out;
}

struct Candidate {
  Vec3d position;
  Vec3f normal;
  std::uint32_t nearest;  // surveyed point
};

class HoleCloser {
 public:
  HoleCloser(const PreparedPoints& prepared, const NeighborSearch& search, const Means& means,
             const NeighborSearch& means_search)
      : points_(prepared.points),
        spacing_(prepared.spacing),
        search_(search),
        means_(means),
        means_search_(means_search) {}

  // The places that the surface reaches from point i, none where i is at no rim.
  void StepFrom(std::size_t i, std::vector<Candidate>* out) const {
    const Vec3d position = points_.position[i];
    const double step = spacing_[i];
    int idx[kRimNeighbors];
    float distance[kRimNeighbors];
    double angle[kRimNeighbors];
    const int count = search_.Nearest(i, kRimNeighbors, idx, distance);
    const TangentPlane plane(points_.normal[i].cast<double>());
    int used = 0;
    for (int j = 0; j < count; ++j) {
      if (!(distance[j] > 0) || distance[j] > kRimReach * step) continue;
      angle[used++] = plane.AngleOf(points_.position[static_cast<std::size_t>(idx[j])] - position);
    }
    const Gap gap = WidestGap(angle, used);
    if (gap.width < kRimGap) return;
    const Vec3d way = plane.Direction(gap.middle) * step;
    for (int k = 1; k <= kSteps; ++k) {
      Candidate candidate;
      if (SurfaceAt(position + way * static_cast<double>(k), step, (k + 1) * step, &candidate)) {
        out->push_back(candidate);
      }
    }
  }

 private:
  // Moves p onto the zero set of the mean distance from the planes of the means around, weighted by
  // their inverse squared distances squared (Kolluri, "Provably good moving least squares", 2005,
  // with the weights of Shen et al., "Interpolating and approximating implicit surfaces from
  // polygon soup", 2004). False where that is no part of the surface that closes a hole.
  bool SurfaceAt(Vec3d p, double spacing, double farthest, Candidate* out) const {
    int idx[kAround];
    float distance[kAround];
    const int count = means_search_.Nearest(p, kAround, idx, distance);
    Vec3d up{};
    for (int k = 0; k < kProjections; ++k) {
      double total = 0, height = 0;
      Vec3d normal{};
      for (int j = 0; j < count; ++j) {
        const auto m = static_cast<std::size_t>(idx[j]);
        const Vec3d d = p - means_.position[m];
        const double near = Dot(d, d) + spacing * spacing;
        const double weight = 1 / (near * near);
        total += weight;
        normal += means_.normal[m] * weight;
        height += Dot(means_.normal[m], d) * weight;
      }
      const double length = Length(normal);
      if (!(length >= kNormalsAgree * total)) return false;
      up = normal / length;
      p = p - up * (height / length);
    }
    const int nearest = search_.NearestTo(p);
    const double away = Length(p - points_.position[static_cast<std::size_t>(nearest)]);
    if (!(away > kApart * spacing_[static_cast<std::size_t>(nearest)]) || away > farthest) {
      return false;
    }
    if (!IsEnclosed(p, up, idx, count)) return false;
    *out = {p, up.cast<float>(), static_cast<std::uint32_t>(nearest)};
    return true;
  }

  bool IsEnclosed(const Vec3d& p, const Vec3d& up, const int* idx, int count) const {
    double closest = INFINITY;
    for (int j = 0; j < count; ++j) {
      closest = std::min(closest, Length(means_.position[static_cast<std::size_t>(idx[j])] - p));
    }
    const double reach = 2.5 * closest + 2 * means_.extent;
    const TangentPlane plane(up);
    double angle[kAround];
    int used = 0;
    for (int j = 0; j < count; ++j) {
      const auto m = static_cast<std::size_t>(idx[j]);
      const Vec3d d = means_.position[m] - p;
      if (Length(d) <= reach && Dot(means_.normal[m], up) > 0) angle[used++] = plane.AngleOf(d);
    }
    return WidestGap(angle, used).width < kEnclosed;
  }

  const SurveyPoints& points_;
  const std::vector<float>& spacing_;
  const NeighborSearch& search_;
  const Means& means_;
  const NeighborSearch& means_search_;
};

std::vector<Vec3d> PositionsOf(const std::vector<Candidate>& candidates) {
  std::vector<Vec3d> out;
  out.reserve(candidates.size());
  for (const Candidate& c : candidates) out.push_back(c.position);
  return out;
}

// Those that are no nearer to each other than kBetween spacings: the first, and of the others each
// that is not near one taken already.
std::vector<Candidate> Thinned(const std::vector<Candidate>& candidates,
                               const std::vector<float>& spacing) {
  const std::vector<Vec3d> positions = PositionsOf(candidates);
  const NeighborSearch search(positions);
  std::vector<char> taken_away(candidates.size(), 0);
  std::vector<Candidate> out;
  int idx[kMostBetween];
  float distance[kMostBetween];
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (taken_away[i]) continue;
    out.push_back(candidates[i]);
    const double radius = kBetween * static_cast<double>(spacing[candidates[i].nearest]);
    const int count = search.Within(i, radius, kMostBetween, idx, distance);
    for (int j = 0; j < count; ++j) taken_away[static_cast<std::size_t>(idx[j])] = 1;
  }
  return out;
}

// Those that are part of a surface: kFewest others, surveyed or not, within kSurface spacings.
std::vector<Candidate> WithoutLone(const std::vector<Candidate>& candidates,
                                   const std::vector<float>& spacing,
                                   const NeighborSearch& surveyed) {
  const std::vector<Vec3d> positions = PositionsOf(candidates);
  const NeighborSearch closing(positions);
  std::vector<Candidate> out;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Candidate& c = candidates[i];
    const double radius = kSurface * static_cast<double>(spacing[c.nearest]);
    int idx[kFewest];
    float distance[kFewest];
    int others = static_cast<int>(closing.CountWithin(i, radius)) - 1;
    const int count = surveyed.Nearest(c.position, kFewest, idx, distance);
    for (int j = 0; j < count; ++j) others += distance[j] <= radius;
    if (others >= kFewest) out.push_back(c);
  }
  return out;
}

}  // namespace

void CloseHoles(const Survey& survey, PreparedPoints* prepared, const Control& control) {
  SurveyPoints& points = prepared->points;
  const std::size_t n = points.size();
  if (points.photo_begin.empty() || survey.photographs.empty() || n < kAround) return;
  // The tree, the cells of the means, these and their tree.
  CheckMemory("closing holes between " + std::to_string(n) + " points", n * (15 + 8 + 70 / 6));
  control.Report("finding holes", 0.0);
  const Means means = MeansOf(points, control);
  const NeighborSearch search(points.position), means_search(means.position);
  const HoleCloser closer(*prepared, search, means, means_search);
  std::vector<std::vector<Candidate>> found((n + kBlock - 1) / kBlock);
  ParallelBlocks(
      n, kBlock,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) closer.StepFrom(i, &found[begin / kBlock]);
      },
      control, "closing holes", 0.2, 0.7);
  std::vector<Candidate> candidates;
  for (const auto& block : found) candidates.insert(candidates.end(), block.begin(), block.end());
  if (candidates.empty()) return;
  candidates = Thinned(candidates, prepared->spacing);
  candidates = WithoutLone(candidates, prepared->spacing, search);

  std::vector<std::uint32_t> nearest;
  std::vector<float> spacing;
  for (const Candidate& c : candidates) {
    nearest.push_back(c.nearest);
    spacing.push_back(prepared->spacing[c.nearest]);
  }
  SurveyPoints closing = Gather(points, nearest);  // its colour and photographs
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    closing.position[k] = candidates[k].position;
    closing.normal[k] = candidates[k].normal;
    if (!closing.error.empty()) closing.error[k] = -1.0f;
  }
  std::vector<char> open(closing.size(), 0);
  FindSeenThrough(survey, points, {}, closing, spacing, &open, control);
  std::vector<std::uint32_t> kept;
  for (std::size_t k = 0; k < open.size(); ++k) {
    if (!open[k]) kept.push_back(static_cast<std::uint32_t>(k));
  }
  Keep(kept, &closing);
  Keep(kept, &spacing);
  Append(closing, &points);
  prepared->spacing.insert(prepared->spacing.end(), spacing.begin(), spacing.end());
  if (!prepared->shift.empty()) prepared->shift.resize(points.size(), 0.0f);
  prepared->closing = kept.size();
}

}  // namespace sherd
