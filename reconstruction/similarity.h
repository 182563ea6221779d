// From one frame to another by scale, rotation and translation: what geo-registration gives.
#pragma once

#include <array>
#include <string>

#include "metaball/vec.h"
#include "reconstruction/level.h"
#include "reconstruction/survey.h"

namespace sherd {

// x_target = scale * R x_source + t.
struct Similarity3d {
  double scale = 1;
  // Its translation is t; scale is not applied by it.
  Rigid3d rotation_and_translation;

  Vec3d Apply(const Vec3d& p) const {
    return rotation_and_translation.Rotate(p) * scale + rotation_and_translation.translation;
  }
};

// Scale, quaternion w x y z, translation: the order of colmap model_aligner's file. Neither looks
// at what the numbers are.
std::array<double, 8> NumbersOf(const Similarity3d& similarity);
Similarity3d SimilarityOf(const std::array<double, 8>& numbers);

// The angle that it turns by, radians, 0 to pi.
double TurnOf(const Rigid3d& motion);

// From a to c by way of b; rotations of unit length stay so.
Similarity3d Compose(const Similarity3d& c_from_b, const Similarity3d& b_from_a);

// The file colmap model_aligner writes with --transform_path ("scale qw qx qy qz tx ty tz", w
// first), or a matrix of 3 or 4 rows of 4 numbers. Numbers are read to the last bit. Throws
// InputError with the line: other counts of numbers, a scale that is not positive, a matrix that is
// no similarity.
Similarity3d ReadSimilarity(const std::string& path);

// Moves points, normals and photographs, in double precision: everything projects where it did.
// What depends on the frame follows (up, metres_per_unit as the length of the new unit).
void TransformSurvey(const Similarity3d& target_from_source, Survey* survey);

// Moves and turns a level as its survey: centres and normals. The cloud gets a frame and an order
// of its own again; each rounding of a centre is 6e-8 of half the cloud's extent.
void TransformLevel(const Rigid3d& target_from_source, Level* level);

}  // namespace sherd
