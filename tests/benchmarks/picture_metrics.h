// How near one picture comes to another inside a mask.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "metaball/vec.h"

namespace sherd::benchmarks {

// sRGB-encoded values in [0, 1], row-major.
struct Picture {
  int width = 0, height = 0;
  std::vector<Vec3f> pixels;
};

struct PictureScore {
  std::uint64_t pixels = 0;           // that were compared
  std::array<double, 3> gain{};       // applied to the picture, least squares for each channel
  double psnr_db = 0;                 // over the three channels, peak 1
  double ssim = 0;                    // of the luma (Wang et al. 2004: Gaussian of 1.5 px, 11 x 11)
  std::array<double, 3> high_pass{};  // correlation of luma minus its Gaussian of kHighPassSigma
};
inline constexpr std::array<double, 3> kHighPassSigma = {2.0, 4.0, 8.0};  // pixels

// Compares where mask[i] != 0. Both pictures and the mask have the same size. Windows take in only
// pixels of the mask. The luma is Rec. 709's of the encoded values.
PictureScore Compare(const Picture& picture, const Picture& reference,
                     const std::vector<char>& mask);

// The mask without the pixels nearer than `radius` pixels (chessboard distance) to its outside,
// beyond the picture's edge included; and with the pixels as near to it. One after the other they
// take away what is thinner than 2 radius + 1.
std::vector<char> Eroded(const std::vector<char>& mask, int width, int height, int radius);
std::vector<char> Dilated(std::vector<char> mask, int width, int height, int radius);

}  // namespace sherd::benchmarks
