// The synthetic excavation as the photographs of its workspace see it.
#pragma once

#include <cstddef>
#include <vector>

#include "datasets_synthetic/excavation.h"
#include "metaball/camera.h"
#include "reconstruction/survey.h"

namespace sherd {

// The photographs' own cameras, `max_side` pixels on the longer side.
std::vector<Camera> PhotographCameras(const Survey& survey, int max_side);

// What a reconstruction can be asked to show at a pixel: the truth has a surface there, inside the
// surveyed area, and at least one other photograph sees it as well (no reconstruction can hold what
// only one photograph saw). Thread-safe.
bool SurveyedTruthAt(const Excavation& truth, const std::vector<Camera>& cameras, std::size_t own,
                     const RayD& ray, TruthHit* hit);

}  // namespace sherd
