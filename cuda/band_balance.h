// How the rows of a picture are divided so that renderers of different speed end together.
#pragma once

#include <array>
#include <vector>

namespace sherd {

// Bands start at multiples of so many rows.
inline constexpr int kBandStep = 8;

// Rows of each band of a picture of `height` rows, from the top, near the shares (positive, of any
// sum): multiples of kBandStep but for the last, and at least one step each where there are enough.
std::vector<int> BandRows(int height, const std::vector<double>& shares);

// What each part of the picture's height took the last time, wherever it was drawn: the speed of a
// renderer and the cost of what it draws in one figure. That figure stays with the rows, not with
// the renderer: where the costly part of a picture is narrow, a border that follows its renderer's
// mean would jump over it to and fro.
class BandBalance {
 public:
  BandBalance() { seconds_.fill(1.0); }

  // Rows of `bands` (>= 1) bands that should take equally long; even ones before the first Record.
  std::vector<int> Rows(int height, int bands) const;
  // rows[i] of a picture, from the top, took seconds[i]. Not used where a time is not known (0).
  void Record(const std::vector<int>& rows, const std::vector<double>& seconds);

 private:
  static constexpr int kSlots = 128;

  std::array<double, kSlots> seconds_;  // of equal parts of the height; only ratios count
};

}  // namespace sherd
