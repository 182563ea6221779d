// Points the photographs see through. Internal to reconstruction/.
#pragma once

#include <vector>

#include "metaball/control.h"
#include "reconstruction/survey.h"

namespace sherd {

// Marks with 1 in `stray` the points the photographs see through (free-space violation; Merrell et
// al., "Real-time visibility-based fusion of depth maps", 2007, in a form that needs only the
// points). A photograph sees through a point when it lists at least three others within a spacing
// of the line of sight, and all it lists there lie behind the point by more than a spacing. A point
// goes when at least three photographs do, and more than half as many as list it. Depth maps are
// blurred across outlines: most of this noise hangs along them, in front of what other photographs
// see. None where no photographs are known. Points that are marked already do not testify.
// spacing: local, of each point, world units.
void FindSeenThrough(const Survey& survey, const SurveyPoints& points,
                     const std::vector<float>& spacing, std::vector<char>* stray,
                     const Control& control = {});

}  // namespace sherd
