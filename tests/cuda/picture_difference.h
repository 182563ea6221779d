// How far a backend's picture is from the CPU renderer's, plane by plane.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "metaball/frame.h"

namespace sherd {

// Equal to the byte.
template <class T>
bool SameBytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

struct PictureTolerance {
  float color = 0.01f;  // of a component, linear
  double depth = 1e-4;  // world units
};

struct PictureDifference {
  std::uint64_t pixels = 0;
  std::uint64_t drawn = 0;      // in the expected picture
  std::uint64_t color_off = 0;  // by more than the tolerance in a component
  // Where the depth planes differ by more than the tolerance: of no interest to the other planes.
  std::uint64_t elsewhere = 0;
  std::uint64_t planes_off = 0;  // at one place, another value in any plane but the metaballs' ids
  std::uint64_t ids_off = 0;     // at one place; where two are equally strong, rounding decides
  std::string shape;  // what the frames do not have in common ("planes", "size"); else empty
};

// Compares all that `expected` holds.
PictureDifference ComparePictures(const Frame& expected, const Frame& frame,
                                  const PictureTolerance& tolerance = {});

}  // namespace sherd
