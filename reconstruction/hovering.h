// Points that hover close above a surface. Internal to reconstruction/.
#pragma once

#include <vector>

#include "metaball/control.h"
#include "reconstruction/neighbors.h"
#include "reconstruction/survey.h"

namespace sherd {

// Marks with 1 in `stray` the points that photographs look past at points close behind them: a
// photograph testifies against a point that it does not list when it lists a neighbour that lies
// behind the point, seen from there, by more than a spacing and beside the line of sight by less
// than half of one, on a surface that it sees squarely enough for that to be no slope (free-space
// violation at the scale of the spacing; seen_through.h has the same for what floats farther away).
// A point goes when more photographs testify against it than list it, and at least three. Depth
// maps are blurred across outlines, so this noise lies in strings along them. Nothing is marked
// where no photographs are known or normals are missing; points that are marked already do not
// testify. spacing: local, of each point, world units.
void FindHovering(const Survey& survey, const SurveyPoints& points, const NeighborSearch& search,
                  const std::vector<float>& spacing, std::vector<char>* stray,
                  const Control& control = {});

}  // namespace sherd
