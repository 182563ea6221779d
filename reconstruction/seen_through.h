// Points the photographs see through. Internal to reconstruction/.
#pragma once

#include <vector>

#include "metaball/control.h"
#include "reconstruction/survey.h"

namespace sherd {

// Marks with 1 in `stray` the points the photographs see through: in more photographs than see the
// point itself (and in at least three), surface points are seen behind it, in its own and the
// adjoining cells of a coarse grid over the picture, all of them farther away by more than the
// noise (free-space violation; Merrell et al., "Real-time visibility-based fusion of depth maps",
// 2007, in a form that needs only the points). None where no photographs are known. Points that are
// marked already do not testify. spacing: local, of each point, world units.
void FindSeenThrough(const Survey& survey, const SurveyPoints& points,
                     const std::vector<float>& spacing, std::vector<char>* stray,
                     const Control& control = {});

}  // namespace sherd
