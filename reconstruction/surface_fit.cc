#include "reconstruction/surface_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "reconstruction/neighbors.h"
#include "reconstruction/parallel.h"
#include "reconstruction/radii.h"
#include "reconstruction/surface_field.h"

namespace sherd {
namespace {

constexpr std::size_t kBlock = 1024;
constexpr int kSweeps = 3;               // a fourth moves the mean error by less than 2 %
constexpr std::uint32_t kMostRead = 16;  // points of a cell that a sweep reads
// How far a metaball at the rim moves outwards, in spacings.
constexpr double kRimShift = 0.5;
constexpr double kFarthestMove = 0.5;  // of a centre in all sweeps, in median spacings

// A cloud in floats around the survey's middle, so that a far stray costs the rest no digits.
class Workbench {
 public:
  explicit Workbench(const std::vector<Vec3d>& positions) : frame_(SearchFrame::For(positions)) {}

  Vec3f Local(const Vec3d& p) const { return frame_.Local(p); }
  double unit() const { return frame_.unit; }
  Cloud CloudOf(const FittedMetaballs& m) const {
    Cloud cloud;
    cloud.center.resize(m.position.size());
    cloud.radius.resize(m.position.size());
    for (std::size_t i = 0; i < m.position.size(); ++i) {
      cloud.center[i] = Local(m.CenterOf(i));
      cloud.radius[i] = static_cast<float>(m.radius[i] / unit());
    }
    return cloud;
  }

 private:
  SearchFrame frame_;
};

// The mean field in the plane of a sheet's centres (radii.cc), of densities of height 1.
double SheetField(double factor) { return std::numbers::pi / 3 * factor * factor; }

// How far from that plane the field has fallen to `share` of it, in radii; 0 where it is never that
// high.
template <class T>
T SheetDepth(T share) {
  return share < T(1) ? std::sqrt(T(1) - std::cbrt(std::max(share, T(0)))) : T(0);
}

// Normals averaged over the metaballs around that look the same way, each as much as it stands for
// points.
std::vector<Vec3f> SmoothNormals(const SurfaceField& field, const PointCells& cells,
                                 const std::vector<Vec3f>& normal, const Control& control) {
  std::vector<Vec3f> out(normal.size());
  ParallelBlocks(
      normal.size(), kBlock,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          Vec3f sum{};
          field.ForEach(field.cloud().center[i], [&](std::uint32_t k, float weight) {
            const float facing = Dot(normal[k], normal[i]);
            const auto count = static_cast<float>(cells.cell_begin[k + 1] - cells.cell_begin[k]);
            if (facing > 0) sum += normal[k] * (weight * facing * count);
          });
          out[i] = Normalized(sum, normal[i]);
        }
      },
      control);
  return out;
}

// How far each metaball is to move outwards along the surface: what lies at the rim of the points
// (of a hole, or of the survey) stands half a cell inside it.
std::vector<Vec3f> RimShifts(const SurfaceField& field, const std::vector<Vec3f>& normal,
                             float share, const Control& control) {
  std::vector<Vec3f> out(normal.size());
  ParallelBlocks(
      normal.size(), kBlock,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          const Vec3f p = field.cloud().center[i], n = normal[i];
          const float r = field.cloud().RadiusOf(i);
          Vec3f sum{};
          float total = 0;
          field.ForEach(p, [&](std::uint32_t k, float weight) {
            if (Dot(normal[k], n) < -0.5f) return;
            sum += (field.cloud().center[k] - p) * weight;
            total += weight;
          });
          sum = sum - n * Dot(sum, n);
          // 0.29 at the edge of half a plane.
          const float off = Length(sum) / (total * r);
          const float t = std::clamp((off - 0.12f) / 0.12f, 0.0f, 1.0f);
          if (t > 0) out[i] = sum * (-share * r * t * t * (3 - 2 * t) / Length(sum));
        }
      },
      control);
  return out;
}

// How deep each centre may lie: half way to the surface behind it that looks the other way.
std::vector<double> DepthLimits(const SurfaceField& field, const Workbench& bench,
                                const FittedMetaballs& m, const std::vector<double>& wanted,
                                const Control& control) {
  std::vector<double> out(wanted);
  ParallelBlocks(
      wanted.size(), kBlock,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          const auto depth = static_cast<float>(wanted[i] / bench.unit());
          const Vec3f p = field.cloud().center[i], n = m.normal[i];
          // Opposite ones straight behind; a few make a surface, one may be a mistake.
          const float beside = field.cloud().RadiusOf(i) * 0.6f;
          float count = 0, sum = 0;
          const auto range = field.Around(p - n * depth);
          for (const std::uint32_t* k = range.begin; k != range.end; ++k) {
            if (Dot(m.normal[*k], n) > -0.3f) continue;
            const Vec3f d = p - field.cloud().center[*k];
            const float behind = Dot(d, n);
            const float weight = 1 - (Dot(d, d) - behind * behind) / (beside * beside);
            if (!(weight > 0) || behind > 2 * depth || behind < -depth) continue;
            count += weight;
            sum += weight * std::max(behind, 0.0f);
          }
          if (!(count > 0)) continue;
          const double share = std::min(1.0f, count);
          const double half = 0.5 * static_cast<double>(sum / count) * bench.unit();
          out[i] = share * std::min(half, wanted[i]) + (1 - share) * wanted[i];
        }
      },
      control);
  return out;
}

// Smooths the normals, moves the rim and sinks the centres; returns how deep each may lie.
std::vector<double> Sink(const Workbench& bench, const PointCells& cells, double factor,
                         double threshold, FittedMetaballs* m, const Control& control) {
  const std::size_t n = m->position.size();
  const Cloud cloud = bench.CloudOf(*m);
  const SurfaceField field(cloud);
  m->normal = SmoothNormals(field, cells, m->normal, control);
  const double offset = SheetDepth(threshold / SheetField(factor));
  std::vector<double> wanted(n);
  for (std::size_t i = 0; i < n; ++i) wanted[i] = offset * m->radius[i];
  m->depth = DepthLimits(field, bench, *m, wanted, control);
  // Metaballs of nested levels stand for points of the survey and stay where these are.
  if (cells.seed.empty()) {
    const auto share = static_cast<float>(kRimShift / factor);
    const std::vector<Vec3f> rim = RimShifts(field, m->normal, share, control);
    for (std::size_t i = 0; i < n; ++i) m->position[i] += rim[i].cast<double>() * bench.unit();
  }
  // Where the back of a wall sets the limit, it holds for the sweeps too.
  std::vector<double> deepest(n, std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < n; ++i) {
    if (m->depth[i] < 0.999 * wanted[i]) deepest[i] = m->depth[i];
  }
  return deepest;
}

// How high the surface stands over the points of cell c along its normal, in the mean, local units:
// by the depths at which a sheet has the field at the point and the threshold. That is straight
// across a sheet, where the field itself falls steeply within and flatly without: its slope would
// take the points' noise for height.
float SurfaceHeight(const SurveyPoints& points, const PointCells& cells, const Workbench& bench,
                    const SurfaceField& field, std::size_t c, const Vec3f& normal, float threshold,
                    float sheet) {
  const float surface = SheetDepth(threshold / sheet);
  const float most = 1 - surface;  // seen above the surface, so no more below it
  float sum = 0;
  int count = 0;
  const std::uint32_t first = cells.cell_begin[c], last = cells.cell_begin[c + 1];
  const std::uint32_t stride = (last - first + kMostRead - 1) / kMostRead;
  for (std::uint32_t j = first; j < last; j += stride) {
    const auto value = field.At(bench.Local(points.position[cells.point_idx[j]]));
    const float outwards = -Dot(value.gradient, normal);
    if (value.field > 0 && !(outwards > 0.3f * Length(value.gradient))) continue;  // another side
    sum += std::clamp(surface - SheetDepth(value.field / sheet), -most, most);
    ++count;
  }
  return count > 0 ? sum / static_cast<float>(count) * field.cloud().RadiusOf(c) : 0.0f;
}

}  // namespace

FittedMetaballs FitSurface(const SurveyPoints& points, const PointCells& cells,
                           std::vector<Vec3d> position, std::vector<Vec3f> normal,
                           double radius_factor, double threshold, const Control& control) {
  const std::size_t n = position.size();
  const double factor = radius_factor > 0
                            ? radius_factor
                            : DefaultRadiusFactor(static_cast<double>(points.size()) /
                                                  static_cast<double>(std::max<std::size_t>(1, n)));
  FittedMetaballs m;
  m.position = std::move(position);
  m.normal = std::move(normal);
  m.depth.assign(n, 0.0);
  Radii radii = ComputeRadii(m.position, factor, control);
  m.radius = std::move(radii.radius);
  m.median_spacing = radii.median_spacing;
  m.open_share = radii.open_share;
  const Workbench bench(m.position);
  std::vector<double> deepest = Sink(bench, cells, factor, threshold, &m, control);
  {
    // On a curved surface the centres are closer together or farther apart than the points.
    std::vector<Vec3d> centers(n);
    for (std::size_t i = 0; i < n; ++i) centers[i] = m.CenterOf(i);
    m.radius = ComputeRadii(centers, factor, control).radius;
  }
  const double farthest = kFarthestMove * m.median_spacing;
  std::vector<double> shallowest(n);
  for (std::size_t i = 0; i < n; ++i) {
    shallowest[i] = std::max(0.0, m.depth[i] - farthest);
    deepest[i] = std::min(deepest[i], m.depth[i] + farthest);
  }
  Cloud cloud = bench.CloudOf(m);
  const SurfaceField field(cloud, static_cast<float>(farthest / bench.unit()));
  const auto sheet = static_cast<float>(SheetField(factor));
  std::vector<float> height(n);
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    ParallelBlocks(
        n, kBlock,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t c = begin; c < end; ++c) {
            height[c] = SurfaceHeight(points, cells, bench, field, c, m.normal[c],
                                      static_cast<float>(threshold), sheet);
          }
        },
        control);
    for (std::size_t c = 0; c < n; ++c) {
      m.depth[c] = std::clamp(m.depth[c] + static_cast<double>(height[c]) * bench.unit(),
                              shallowest[c], deepest[c]);
      cloud.center[c] = bench.Local(m.CenterOf(c));
    }
  }
  return m;
}

SurfaceErrors MeasureErrors(const PreparedPoints& prepared, const PointCells& cells,
                            const FittedMetaballs& m, double threshold, const Control& control) {
  const SurveyPoints& points = prepared.points;
  const Workbench bench(m.position);
  const Cloud cloud = bench.CloudOf(m);
  const SurfaceField field(cloud);
  std::vector<float> distance(points.size(), NAN);
  ParallelBlocks(
      cells.size(), kBlock,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) {
          for (std::uint32_t j = cells.cell_begin[c]; j < cells.cell_begin[c + 1]; ++j) {
            if (cells.point_idx[j] >= prepared.surveyed()) continue;
            const Vec3f p = bench.Local(prepared.SurveyedPosition(cells.point_idx[j]));
            distance[j] = std::abs(field.SignedDistance(
                p, m.normal[c], static_cast<float>(threshold), static_cast<std::uint32_t>(c)));
          }
        }
      },
      control);
  SurfaceErrors out;
  const auto end =
      std::remove_if(distance.begin(), distance.end(), [](float d) { return !std::isfinite(d); });
  distance.erase(end, distance.end());
  if (distance.empty()) return out;
  double sum = 0;
  for (const float d : distance) sum += d;
  out.mean = sum / static_cast<double>(distance.size()) * bench.unit();
  out.largest =
      static_cast<double>(*std::max_element(distance.begin(), distance.end())) * bench.unit();
  const auto at = distance.begin() + static_cast<std::ptrdiff_t>(
                                         0.95 * static_cast<double>(distance.size() - 1) + 0.5);
  std::nth_element(distance.begin(), at, distance.end());
  out.p95 = static_cast<double>(*at) * bench.unit();
  return out;
}

}  // namespace sherd
