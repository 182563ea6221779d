// Differences of exposure and white balance between photographs. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <vector>

#include "metaball/vec.h"

namespace sherd {

// One look of a photograph at a place that others look at too.
struct ExposureSample {
  std::uint32_t place = 0;
  std::uint32_t photo = 0;
  Vec3f color{};  // linear
};

// For each of `photos` photographs the factor by channel that its linear colours are to be
// multiplied by so that all agree on the places they have in common: with c_ij the colour of place
// j in photograph i, the g_i and a_j that minimise sum rho(log c_ij + g_i - a_j) + lambda sum g_i^2
// (the multiplicative model of Brown and Lowe, "Automatic panoramic image stitching", 2007, solved
// for all photographs at once), rho Cauchy's: highlights and passers-by have little say. The mean
// of the g_i of photographs with samples is 0; photographs without samples get 1. Samples near
// black or clipped are left out. Every factor lies within [1/4, 4]. Deterministic.
std::vector<Vec3f> EvenExposures(const std::vector<ExposureSample>& samples, std::size_t places,
                                 std::size_t photos);

}  // namespace sherd
