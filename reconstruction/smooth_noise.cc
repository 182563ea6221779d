// The noise of points across the surface they lie on, taken out once for all levels.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "reconstruction/level.h"
#include "reconstruction/local_plane.h"
#include "reconstruction/memory.h"
#include "reconstruction/neighbors.h"
#include "reconstruction/outliers.h"
#include "reconstruction/parallel.h"

namespace sherd {
namespace {

constexpr std::size_t kBlock = 2048;
constexpr int kFew = 17, kMany = 65;  // neighbours, the point itself included
// Estimates agree that are no farther apart than this many of their standard deviations.
constexpr double kAgree = 2.0;
// A point's own place is given up sooner than it is kept: the tail of the noise is what is seen.
constexpr double kOwnAgree = 4.0;
constexpr double kFarthest = 2.0;  // local spacings
// Surface variation above which the surroundings are no surface: 65 points of a plane that are as
// noisy as they are far apart have 1 / (1 + 65 / (2 pi)) = 0.09, a random cloud 0.2 to 0.3.
constexpr double kFillsSpace = 0.14;
// A smoothed point stands out when the tangent planes of fewer than kFewestPlanes of its kFew
// neighbours pass it within kOnPlane local spacings. On the marble bust 2 % of the points do, lone
// ones over the surface; on the synthetic excavation 0.06 %, at the tips of edges.
constexpr double kOnPlane = 0.4;
constexpr int kFewestPlanes = 3;

struct Neighbor {
  double u, v, h;  // along the surface and across it, in units of the farthest neighbour's distance
  double weight;
};

struct Estimate {
  double height = 0;
  double deviation = 0;  // standard, for points whose noise is 1
};

// Local regression: the height over the origin of the polynomial in u and v of degree 1 (3 terms)
// or 2 (6 terms) that fits best. False where the neighbours do not determine it.
template <int kTerms>
bool Regress(const Neighbor* neighbors, int count, Estimate* out) {
  using Matrix = Eigen::Matrix<double, kTerms, kTerms>;
  using Vector = Eigen::Matrix<double, kTerms, 1>;
  Matrix a = Matrix::Zero(), b = Matrix::Zero();
  Vector y = Vector::Zero();
  for (int j = 0; j < count; ++j) {
    const Neighbor& n = neighbors[j];
    Vector x;
    x.template head<3>() << 1, n.u, n.v;
    if constexpr (kTerms == 6) x.template tail<3>() << n.u * n.u, n.u * n.v, n.v * n.v;
    const Matrix xx = x * x.transpose() * n.weight;
    a += xx;
    b += xx * n.weight;
    y += x * (n.h * n.weight);
  }
  const Eigen::LDLT<Matrix> solver(a);
  const auto d = solver.vectorD();
  if (solver.info() != Eigen::Success || !(d.minCoeff() > 1e-4 * d.maxCoeff())) return false;
  const Vector row = solver.solve(Vector::Unit(0));
  out->height = row.dot(y);
  out->deviation = std::sqrt(std::max(0.0, row.dot(b * row)));
  return std::isfinite(out->height);
}

class Smoother {
 public:
  Smoother(const PreparedPoints& points, const NeighborSearch& search,
           const std::vector<float>& deviation)
      : points_(points), search_(search), deviation_(deviation) {}

  // How far point i goes along `normal`, which becomes the mean normal around.
  double ShiftOf(std::size_t i, Vec3f* normal) const {
    const SurveyPoints& p = points_.points;
    int idx[kMany];
    float distance[kMany];
    const int count = search_.Nearest(i, kMany, idx, distance);
    if (count < kFew || FitPlane(p.position, idx, count).variation > kFillsSpace) return 0;
    Vec3f few{};
    for (int j = 0; j < kFew; ++j) {
      const Vec3f& n = p.normal[static_cast<std::size_t>(idx[j])];
      few += n * std::max(0.0f, Dot(n, p.normal[i]));
    }
    const Vec3d up = Normalized(few, p.normal[i]).cast<double>();
    const Vec3d side = Perpendicular(up);
    const Vec3d ahead = Cross(up, side);
    const double noise = NoiseAround(idx, count);
    if (!(noise > 0)) return 0;

    Neighbor around[kMany];
    struct Gathered {
      int used;
      double reach;
      Vec3f normal;  // sum
    };
    const auto gather = [&](int most) {
      Gathered out{0, 1.001 * distance[most - 1], {}};
      for (int j = 0; j < most; ++j) {
        const auto k = static_cast<std::size_t>(idx[j]);
        const Vec3d n = p.normal[k].cast<double>();
        const double facing = std::clamp((Dot(n, up) - 0.3) / 0.4, 0.0, 1.0);
        const double x = 1 - std::pow(distance[j] / out.reach, 2);
        if (!(facing * x > 0)) continue;
        const Vec3d d = (p.position[k] - p.position[i]) / out.reach;
        around[out.used++] = {Dot(d, side), Dot(d, ahead), Dot(d, up), facing * x * x};
        out.normal += p.normal[k] * static_cast<float>(facing * x * x);
      }
      return out;
    };
    double low = -kOwnAgree * noise, high = kOwnAgree * noise, shift = 0;
    // False: the estimates so far exclude this one.
    const auto agrees = [&](const Estimate& e, double reach) {
      const double height = e.height * reach, deviation = kAgree * e.deviation * noise;
      low = std::max(low, height - deviation);
      high = std::min(high, height + deviation);
      if (low > high) return false;
      shift = height;
      return true;
    };
    Estimate e;
    *normal = up.cast<float>();
    const Gathered near = gather(kFew);
    if (!Regress<3>(around, near.used, &e) || !agrees(e, near.reach)) return 0;
    if (count == kMany) {
      const Gathered far = gather(kMany);
      if (Regress<6>(around, far.used, &e) && agrees(e, far.reach)) {
        *normal = Normalized(far.normal, *normal);
        if (Regress<3>(around, far.used, &e)) agrees(e, far.reach);
      }
    }
    const double most = kFarthest * points_.spacing[i];
    return std::clamp(shift * Dot(up, normal->cast<double>()), -most, most);
  }

 private:
  // The lower quartile: where an edge passes, the surroundings stray from their plane too.
  double NoiseAround(const int* idx, int count) const {
    float around[kMany];
    for (int j = 0; j < count; ++j) around[j] = deviation_[static_cast<std::size_t>(idx[j])];
    std::nth_element(around, around + count / 4, around + count);
    return around[count / 4];
  }

  const PreparedPoints& points_;
  const NeighborSearch& search_;
  const std::vector<float>& deviation_;  // of each point's few (LocalPlane)
};

bool StandsOut(const PreparedPoints& points, const NeighborSearch& search, std::size_t i) {
  int idx[kFew], planes = 0;
  float distance[kFew];
  const int count = search.Nearest(i, kFew, idx, distance);
  const SurveyPoints& p = points.points;
  for (int j = 0; j < count; ++j) {
    const auto k = static_cast<std::size_t>(idx[j]);
    const double height = Dot(p.normal[k].cast<double>(), p.position[i] - p.position[k]);
    planes += k != i && std::abs(height) < kOnPlane * points.spacing[i];
  }
  return count == kFew && planes < kFewestPlanes;
}

std::vector<char> FindStandingOut(const PreparedPoints& prepared) {
  const NeighborSearch search(prepared.points.position);
  std::vector<char> stray(prepared.points.size(), 0);
  const auto look = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) stray[i] = StandsOut(prepared, search, i);
  };
  ParallelBlocks(stray.size(), kBlock, look, {});  // not to be cancelled halfway
  return stray;
}

struct Smoothed {
  std::vector<float> shift;  // of each point along its new normal
  std::vector<Vec3f> normal;
};

Smoothed Smooth(const PreparedPoints& prepared, const Control& control) {
  const SurveyPoints& points = prepared.points;
  const std::size_t n = points.size();
  const NeighborSearch search(points.position);
  std::vector<float> deviation(n);
  ParallelBlocks(
      n, kBlock,
      [&](std::size_t begin, std::size_t end) {
        int idx[kFew];
        float distance[kFew];
        for (std::size_t i = begin; i < end; ++i) {
          const int count = search.Nearest(i, kFew, idx, distance);
          deviation[i] = static_cast<float>(FitPlane(points.position, idx, count).deviation);
        }
      },
      control, "measuring the noise", 0.0, 0.3);
  const Smoother smoother(prepared, search, deviation);
  Smoothed out{std::vector<float>(n, 0.0f), points.normal};
  ParallelBlocks(
      n, kBlock,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          out.shift[i] = static_cast<float>(smoother.ShiftOf(i, &out.normal[i]));
        }
      },
      control, "smoothing the noise", 0.3, 1.0);
  return out;
}

}  // namespace

void SmoothNoise(bool remove_outliers, PreparedPoints* prepared, const Control& control) {
  SurveyPoints& points = prepared->points;
  const std::size_t n = points.size();
  // The tree, deviations, shifts, the new normals.
  CheckMemory("smoothing the noise of " + std::to_string(n) + " points", n * (15 + 4 + 4 + 12));
  Smoothed smoothed = Smooth(*prepared, control);
  points.normal = std::move(smoothed.normal);
  for (std::size_t i = 0; i < n; ++i) {
    points.position[i] += points.normal[i].cast<double>() * static_cast<double>(smoothed.shift[i]);
  }
  prepared->shift = std::move(smoothed.shift);
  if (remove_outliers) RemoveStray(FindStandingOut(*prepared), prepared);
}

}  // namespace sherd
