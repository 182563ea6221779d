#include "reconstruction/ground_plane.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

#include "metaball/error.h"
#include "metaball/median.h"
#include "reconstruction/local_plane.h"
#include "reconstruction/neighbors.h"
#include "reconstruction/ransac_plane.h"

namespace sherd {
namespace {

constexpr std::size_t kSample = 20000;

// Evenly taken from their order, in `frame`.
std::vector<Vec3f> SampleOf(const std::vector<Vec3d>& positions, const SearchFrame& frame) {
  std::vector<Vec3f> sample;
  const std::size_t n = std::min(positions.size(), kSample);
  sample.reserve(n);
  for (std::size_t k = 0; k < n; ++k) {
    // 64 bits hold the product: both are far below 2^32.
    sample.push_back(frame.Local(positions[k * positions.size() / n]));
  }
  return sample;
}

// Points within `tolerance` of the plane.
std::vector<int> Near(const std::vector<Vec3d>& positions, const GroundPlane& plane,
                      double tolerance) {
  std::vector<int> near;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double distance = std::abs(Dot(positions[i] - plane.point, plane.normal));
    if (distance <= tolerance) near.push_back(static_cast<int>(i));
  }
  return near;
}

// Through the mean of `near`; the normal stays on its side.
GroundPlane Fitted(const std::vector<Vec3d>& positions, const std::vector<int>& near,
                   GroundPlane plane) {
  Vec3d sum{};
  for (const int i : near) sum += positions[static_cast<std::size_t>(i)] - plane.point;
  plane.point = plane.point + sum / static_cast<double>(near.size());
  const Vec3d normal = FitPlane(positions, near.data(), static_cast<int>(near.size())).normal;
  plane.normal = Dot(normal, plane.normal) < 0 ? -normal : normal;
  return plane;
}

// Three deviations of what is near the plane, by the median: what stands on the ground within a
// tolerance that is wide for the ground's own noise would lift the plane.
double NoiseOf(const std::vector<Vec3d>& positions, const std::vector<int>& near,
               const GroundPlane& plane) {
  std::vector<double> distances;
  distances.reserve(near.size());
  for (const int i : near) {
    distances.push_back(
        std::abs(Dot(positions[static_cast<std::size_t>(i)] - plane.point, plane.normal)));
  }
  return 3 * 1.4826 * Median(std::move(distances));
}

// What is near moves with the plane: a few rounds of least squares settle it.
void Settle(const std::vector<Vec3d>& positions, const std::optional<Vec3f>& up,
            const Control& control, GroundPlane* plane) {
  constexpr int kRounds = 20;
  double within = plane->tolerance;
  std::vector<int> near = Near(positions, *plane, within);
  for (int round = 0; round < kRounds && near.size() >= 3; ++round) {
    control.ThrowIfStopped();
    const GroundPlane fitted = Fitted(positions, near, *plane);
    // A strip of a wall may turn to the wall.
    if (up && std::abs(Dot(fitted.normal, up->cast<double>())) < std::cos(kLargestGroundTilt)) {
      return;
    }
    *plane = fitted;
    double squares = 0;
    for (const int i : near) {
      const double d = Dot(positions[static_cast<std::size_t>(i)] - plane->point, plane->normal);
      squares += d * d;
    }
    plane->rms = std::sqrt(squares / static_cast<double>(near.size()));
    // Where all points lie on the plane exactly the noise is none.
    const double noise = NoiseOf(positions, near, *plane);
    if (noise > 0) within = std::min(within, noise);
    std::vector<int> again = Near(positions, *plane, within);
    if (again == near) return;
    near = std::move(again);
  }
}

// The points that may be ground, by their normals where both these and `up` are known: walls and
// what stands on the ground hold most points of many a survey.
SurveyPoints Candidates(const SurveyPoints& points, const std::optional<Vec3d>& up,
                        bool by_normal) {
  const Vec3d unit = Normalized(up.value_or(Vec3d{}));
  SurveyPoints out;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!IsFinite(points.position[i])) continue;
    if (by_normal &&
        !(Dot(points.normal[i].cast<double>(), unit) >= std::cos(kLargestGroundTilt))) {
      continue;
    }
    out.position.push_back(points.position[i]);
    if (!points.normal.empty()) out.normal.push_back(points.normal[i]);
  }
  return out;
}

// The side of the plane that its points show.
Vec3d UpOf(const SurveyPoints& points, const std::vector<int>& near,
           const std::optional<Vec3d>& up) {
  if (up) return *up;
  Vec3d sum{};
  if (!points.normal.empty()) {
    for (const int i : near) sum += points.normal[static_cast<std::size_t>(i)].cast<double>();
  }
  return Normalized(sum);
}

std::string Rounded(double v) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.3g", v);
  return text;
}

}  // namespace

GroundPlane FindGround(const SurveyPoints& survey, const GroundOptions& options,
                       const std::string& source, const Control& control) {
  control.Report("looking for the ground", 0);
  if (options.tolerance && !(*options.tolerance > 0 && *options.tolerance < INFINITY)) {
    throw InputError("", "", "the tolerance of the ground must be a length above 0");
  }
  GroundPlane plane;
  plane.by_normals = options.up && !survey.normal.empty();
  plane.tolerance =
      options.tolerance.value_or(kGroundTolerance * RobustBounds(survey.position).Diagonal());
  const SurveyPoints points = Candidates(survey, options.up, plane.by_normals);
  const std::vector<Vec3d>& positions = points.position;
  control.ThrowIfStopped();
  const SearchFrame frame = SearchFrame::For(positions);
  std::optional<Vec3f> axis;
  if (options.up) axis = Normalized(*options.up).cast<float>();
  const std::optional<FoundPlane> found = RansacPlane(
      SampleOf(positions, frame), plane.tolerance / frame.unit, axis, kLargestGroundTilt);
  control.ThrowIfStopped();
  std::vector<int> near;
  if (found) {
    plane.normal = Normalized(found->normal.cast<double>());
    plane.point = frame.origin - plane.normal * (static_cast<double>(found->offset) * frame.unit);
    Settle(positions, axis, control, &plane);
    near = Near(positions, plane, plane.tolerance);
  }
  plane.points = near.size();
  if (!positions.empty()) {
    plane.share = static_cast<double>(near.size()) / static_cast<double>(positions.size());
  }
  const double least = plane.by_normals ? kLeastShareFacingUp : kLeastGroundShare;
  if (!(plane.share >= least)) {
    throw InputError(source, "",
                     std::string("no ground to level: the best plane") +
                         (options.up ? " within 30 degrees of level has " : " has ") +
                         Rounded(100 * plane.share) + " % of the points" +
                         (plane.by_normals ? " that face up" : "") + " within " +
                         Rounded(plane.tolerance) + " units, and " + Rounded(100 * least) +
                         " % are needed",
                     "say what is up, or allow more: sherd scale --level-ground takes --up and "
                     "--ground-tolerance");
  }
  if (Dot(plane.normal, UpOf(points, near, options.up)) < 0) plane.normal = -plane.normal;
  return plane;
}

Similarity3d LevelWith(const GroundPlane& ground) {
  const Vec3d& n = ground.normal;
  Similarity3d out;
  Rigid3d& turn = out.rotation_and_translation;
  // Half the angle: the quaternion of 1 + n . z and n x z, made unit; half a turn where n is -z.
  const double length = std::sqrt(2 * (1 + n.z));
  if (length > 1e-8) {
    turn.qw = length / 2;
    turn.qx = n.y / length;
    turn.qy = -n.x / length;
  } else {
    turn.qw = 0;
    turn.qx = 1;
  }
  const Vec3d& p = ground.point;
  turn.translation = Vec3d{p.x, p.y, 0} - turn.Rotate(p);
  return out;
}

}  // namespace sherd
