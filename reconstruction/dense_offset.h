// Where dense points lie in the photographs, to a fraction of a pixel. Internal to reconstruction/.
#pragma once

#include "metaball/control.h"
#include "reconstruction/survey.h"

namespace sherd {

struct DenseOffset {
  double pixels = 0;      // Survey::dense_pixel_offset that fits
  bool measured = false;  // false: too little to compare, `documented` is returned
  double error_without = 0, error_with = 0;  // mean squared differences at 0 and at `documented`
};

// COLMAP's fusion gives a point the colour of the depth map's pixel it comes from but takes the
// pixel's corner for its position (colmap_formats 3.3), so its points lie `documented` pixels up
// and left of where their colours are; points of other programs lie on their colours. Which holds
// is measured: the points' colours are compared with the photographs at their projections, moved by
// nothing and by `documented` pixels, over a sample of points and at most a dozen photographs. The
// better one is taken where the difference is certain (five standard errors), else `documented`.
// Photographs that cannot be read are passed over.
DenseOffset MeasureDenseOffset(const Survey& survey, double documented,
                               const Control& control = {});

}  // namespace sherd
