// Where, and over what area, a photograph is looked up.
#pragma once

#include <cstdint>

namespace sherd {

struct PhotoLookup {
  std::uint32_t target = 0;  // whose colour it is part of
  std::uint32_t photo = 0;   // into Survey::photographs
  float x = 0, y = 0;        // pixels of the file
  // The footprint: a parallelogram around (x, y) with these sides, cut into along x across cells.
  float along_x = 0, along_y = 0, across_x = 0, across_y = 0;
  std::uint8_t along = 1, across = 1;  // 1 .. kMostCells
  std::uint8_t level = 0;              // of the pyramid
  float width_px = 1;                  // the footprint's shorter side, pixels of the file
  float weight = 0;

  static constexpr int kMostCells = 8;
};

// Gives the lookup the footprint whose sides have the images (ax, ay) and (bx, by): the axes of the
// ellipse they span (the singular vectors of [a b]). The level is the coarsest whose pixels are
// well below the shorter axis (a quarter to three quarters of it), so that the cells, not the
// pyramid's averages, shape the filter; a footprint too long for kMostCells takes a coarser one.
void SetFootprint(double ax, double ay, double bx, double by, PhotoLookup* lookup);

// How far from (x, y) SampleFootprint looks where the pyramid holds the lookup's level, pixels of
// the file.
double FootprintReach(const PhotoLookup& lookup);

// Over what width SampleSurroundings smooths, pixels of the file.
double SurroundingsWidth(const PhotoLookup& lookup);

}  // namespace sherd
