// A COLMAP workspace of a bumpy square, small enough to be made and imported in a moment: sparse
// text model with tracks, four photographs, no dense cloud.
#pragma once

#include <QString>

namespace sherd {

// How high the bumps of the square are.
inline constexpr double kRelief = 0.25;

// Writes into `folder` (made if missing): sparse/0/*.txt and images/. About `points` points on
// [-1, 1]^2, z up; z rises by a tenth of x, with bumps of `relief` either way.
void writeSmallWorkspace(const QString& folder, int points, double relief = kRelief);

// The same surface as a PLY with x y z radius red green blue; the radius only where asked for.
void writeSmallPly(const QString& path, int points, bool radii = true);

}  // namespace sherd
