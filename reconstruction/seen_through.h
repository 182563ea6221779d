// Points the photographs see through. Internal to reconstruction/.
#pragma once

#include <vector>

#include "metaball/control.h"
#include "reconstruction/survey.h"

namespace sherd {

// Marks with 1 in `stray` those of the points `asked` that the photographs see through (free-space
// violation; Merrell et al., "Real-time visibility-based fusion of depth maps", 2007, in a form
// that needs only points). A photograph sees through a point when it lists at least three of the
// points `seen` within a spacing of the line of sight, and all it lists there lie behind the point
// by more than a spacing. A point goes when at least three photographs do, and more than half as
// many as list it. Depth maps are blurred across outlines: most of this noise hangs along them, in
// front of what other photographs see. None where no photographs are known.
//
// unseen: 1 for each of `seen` that does not testify, or empty. spacing: local, of each of `asked`,
// world units. stray: of each of `asked`; those marked already are not asked. `asked` and `seen`
// may be the same points, `unseen` and `stray` then too; both have lists of photographs, or
// neither.
void FindSeenThrough(const Survey& survey, const SurveyPoints& seen,
                     const std::vector<char>& unseen, const SurveyPoints& asked,
                     const std::vector<float>& spacing, std::vector<char>* stray,
                     const Control& control = {});

}  // namespace sherd
