// The ground that a survey stands on, and the turn that makes it level.
#pragma once

#include <cstdint>
#include <numbers>
#include <optional>
#include <string>

#include "metaball/control.h"
#include "metaball/vec.h"
#include "reconstruction/similarity.h"
#include "reconstruction/survey.h"

namespace sherd {

struct GroundOptions {
  // What is up as far as is known (Survey::up); the ground's normal is sought within
  // kLargestGroundTilt of it. Without, the largest plane of any direction is the ground, and the
  // points' normals say which of its sides is above; where there are none, +z does.
  std::optional<Vec3d> up;
  // How far points of the ground may lie from its plane, world units, > 0; default
  // kGroundTolerance times the diagonal of the survey's robust bounds.
  std::optional<double> tolerance;
};
inline constexpr double kLargestGroundTilt = std::numbers::pi / 6;  // radians
inline constexpr double kGroundTolerance = 0.005;
// What of its points a plane must hold to be the ground: of all, or, where `up` and normals are
// known, of those that face up, of which a ball's top would hold more than a quarter.
inline constexpr double kLeastGroundShare = 0.1, kLeastShareFacingUp = 0.4;

struct GroundPlane {
  Vec3d normal{0, 0, 1};     // unit, upward
  Vec3d point{};             // on the plane, the mean of its points
  double tolerance = 0;      // world units
  std::uint64_t points = 0;  // within the tolerance
  bool by_normals = false;   // only points that face up were looked at
  double share = 0;          // of the points that were looked at
  double rms = 0;            // distance of those the plane was fitted to, world units
};

// The plane with most points: of those whose normal is within kLargestGroundTilt of `up` where both
// are known, else of all. By RANSAC on up to 20 000 of them, evenly taken, and then the least
// squares of all near it, in double precision. Deterministic. Throws InputError, naming `source`,
// where no plane holds enough; Cancelled.
GroundPlane FindGround(const SurveyPoints& points, const GroundOptions& options,
                       const std::string& source, const Control& control = {});

// By the shortest turn from the ground's normal to +z: the ground comes to lie at z = 0, and its
// mean point keeps x and y.
Similarity3d LevelWith(const GroundPlane& ground);

}  // namespace sherd
