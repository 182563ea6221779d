// The axes of a survey's views: where up is, and in which direction "front" looks.
#pragma once

#include <optional>
#include <vector>

#include "metaball/vec.h"
#include "reconstruction/survey.h"

namespace sherd {

// The axes the presets look along, world, orthonormal, right-handed: up; north, the direction in
// which "front" looks and which is up in "top"; east = north x up.
struct PresetAxes {
  Vec3d east{1, 0, 0}, north{0, 1, 0}, up{0, 0, 1};
};
// Without `front`, north is where the shortest turn that takes +z to `up` takes +y: +y for a survey
// with z up, +z for COLMAP's first camera (y down).
PresetAxes AxesFor(const std::optional<Vec3d>& up, const std::optional<Vec3d>& front);

// The direction in which most photographs look, made horizontal; nullopt where they look all round,
// or where `up` is the z axis already (a survey that is oriented to the world keeps its north).
std::optional<Vec3d> EstimateFront(const std::vector<Photograph>& photographs,
                                   const std::optional<Vec3d>& up);

}  // namespace sherd
