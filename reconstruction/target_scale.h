// The scale of a survey from targets of known size that its photographs show: coded markers (ArUco)
// or a chessboard.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "metaball/control.h"
#include "reconstruction/survey.h"

namespace sherd {

struct TargetOptions {
  // OpenCV's dictionary of the markers: "4x4_50", "5x5_100", "6x6_250", "7x7_1000", "original",
  // "apriltag_36h11" and so on. Empty: a chessboard.
  std::string markers;
  // Inner corners of the chessboard, where four squares meet.
  int columns = 0, rows = 0;
  // The side of a marker's black square, or of one square of the chessboard.
  double size_m = 0;
};

struct TargetScale {
  double metres_per_unit = 0;
  double relative_error = 0;    // standard error of the mean over the measured lengths
  std::size_t lengths = 0;      // that were measured
  std::size_t corners = 0;      // placed in space
  std::size_t photographs = 0;  // that show a target
  double reprojection_px = 0;   // root mean square, in pixels of the cameras
  std::vector<std::string> warnings;
};

// Looks at every photograph that has a file (the original where there is one), places each corner
// in space from all photographs that show it, and compares lengths between corners of one target
// with those it is made with. Throws InputError where no corner is seen twice or the size is not
// positive, Cancelled.
TargetScale ScaleFromTargets(const TargetOptions& options, const Survey& survey,
                             const Control& control = {});

// OpenCV's names of its predefined dictionaries, as TargetOptions::markers takes them.
std::vector<std::string> MarkerDictionaries();

}  // namespace sherd
