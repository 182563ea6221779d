// Which photographs see a point, where no file says so. Internal to reconstruction/.
#pragma once

#include <cstdint>

#include "metaball/control.h"
#include "reconstruction/survey.h"

namespace sherd {

struct VisibilityOptions {
  // Of each point the photographs that see it best: squarely and finely.
  int most_photographs = 12;
  std::uint64_t memory_limit_bytes = 0;
};

struct FoundVisibility {
  std::uint64_t points = 0;  // that had no photographs
  std::uint64_t seen = 0;    // of these, now have some
};

// Gives every point without photographs (all of them where photo_begin is empty) those that see it:
// it projects into the picture, faces the camera where its normal is known, and nothing lies in
// front of it. What lies in front is asked of the points themselves, in a grid over each picture
// that is as fine as the points are close: a point is hidden where one in its own cell, or in most
// of the cells around it, is nearer by more than a slanted surface and the noise of stereo explain.
// The same for any number of threads. Throws ResourceError, Cancelled.
FoundVisibility FindVisibility(const VisibilityOptions& options, Survey* survey,
                               const Control& control = {});

}  // namespace sherd
