// Stray points that local density does not show. Internal to reconstruction/.
#pragma once

#include <vector>

#include "metaball/control.h"
#include "reconstruction/survey.h"

namespace sherd {

// Points the photographs see through: in more photographs than see the point itself (and in at
// least three), surface points are seen behind it, in its own and the adjoining cells of a coarse
// grid over the picture, all of them farther away by more than the noise (free-space violation;
// Merrell et al., "Real-time visibility-based fusion of depth maps", 2007, in a form that needs
// only the points). All false where no photographs are known. spacing: median local spacing, world
// units.
std::vector<bool> FindSeenThrough(const Survey& survey, const SurveyPoints& points, double spacing,
                                  const Control& control = {});

}  // namespace sherd
