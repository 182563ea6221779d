#include "cuda/band_balance.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace sherd {
namespace {

// What a band took is spread over its rows as the rows took it before, but for this share, which is
// spread evenly: or a part that was empty once would be taken for empty for ever.
constexpr double kForgotten = 0.05;

}  // namespace

std::vector<int> BandRows(int height, const std::vector<double>& shares) {
  const auto bands = static_cast<int>(shares.size());
  const int steps = (height + kBandStep - 1) / kBandStep;
  const int least = steps >= bands ? 1 : 0;
  const double sum = std::accumulate(shares.begin(), shares.end(), 0.0);
  std::vector<int> rows;
  double below = 0;
  int begin = 0;
  for (int i = 0; i < bands; ++i) {
    below += shares[static_cast<std::size_t>(i)];
    int end = static_cast<int>(std::lround(below / sum * steps));
    end = std::clamp(end, begin + least, steps - least * (bands - 1 - i));
    if (i + 1 == bands) end = steps;  // whatever rounding left
    rows.push_back(std::min(end * kBandStep, height) - std::min(begin * kBandStep, height));
    begin = end;
  }
  return rows;
}

std::vector<int> BandBalance::Rows(int height, int bands) const {
  const double total = std::accumulate(seconds_.begin(), seconds_.end(), 0.0);
  std::vector<double> shares;
  double before = 0, last_border = 0;  // seconds above the slot; border in slots
  for (int slot = 0; slot < kSlots; ++slot) {
    const double here = seconds_[static_cast<std::size_t>(slot)];
    while (static_cast<int>(shares.size()) + 1 < bands) {
      const double wanted = total * static_cast<double>(shares.size() + 1) / bands;
      if (before + here < wanted) break;
      const double border = slot + (wanted - before) / here;
      shares.push_back(border - last_border);
      last_border = border;
    }
    before += here;
  }
  shares.resize(static_cast<std::size_t>(bands) - 1, 0.0);
  shares.push_back(kSlots - last_border);
  return BandRows(height, shares);
}

void BandBalance::Record(const std::vector<int>& rows, const std::vector<double>& seconds) {
  const int height = std::accumulate(rows.begin(), rows.end(), 0);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i] > 0 && !(seconds[i] > 0)) return;
  }
  std::array<double, kSlots> updated{};
  double begin = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i] == 0) continue;
    const double end = begin + static_cast<double>(rows[i]) * kSlots / height;
    const auto for_each_slot = [&](const auto& body) {
      for (int slot = static_cast<int>(begin); slot < kSlots && slot < end; ++slot) {
        const double part = std::min(end, slot + 1.0) - std::max<double>(begin, slot);
        if (part > 0) body(static_cast<std::size_t>(slot), part);
      }
    };
    double expected = 0;
    for_each_slot([&](std::size_t slot, double part) { expected += seconds_[slot] * part; });
    const double even = kForgotten * seconds[i] / (end - begin);
    const double scale = (1 - kForgotten) * seconds[i] / expected;
    for_each_slot([&](std::size_t slot, double part) {
      updated[slot] += (scale * seconds_[slot] + even) * part;
    });
    begin = end;
  }
  seconds_ = updated;
}

}  // namespace sherd
