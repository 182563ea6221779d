// The rows of printed text on the white board: what they say, where they stand, and how dark they
// make any place of the board.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace sherd::synthetic {

inline constexpr double kBoardWidth = 0.64, kBoardHeight = 0.48;

// Letter heights of the rows (capital H), from the top, metres.
inline constexpr double kLetterHeights[] = {0.060, 0.045,  0.034, 0.025, 0.019,
                                            0.014, 0.0105, 0.008, 0.006, 0.004};

class BoardText {
 public:
  // Sets the text of all rows, which depends on the seed, in DejaVu Sans Bold. Throws Error where
  // the font is not installed, naming the package.
  explicit BoardText(std::uint32_t seed);

  struct Row {
    std::string text;
    double letter_height_m = 0;
    double left_m = 0, right_m = 0, baseline_m = 0;  // from the board's lower left corner
  };
  const std::vector<Row>& rows() const { return rows_; }

  // The share of ink, [0, 1], in a square of `footprint_m` around (x, y), metres from the board's
  // lower left corner.
  float Ink(double x, double y, double footprint_m) const;

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<std::uint8_t> ink;  // 255: ink; row 0 at the top
    float At(int x, int y) const;
  };
  float Bilinear(const Level& level, double u, double v) const;
  void BuildPyramid();

  std::vector<Row> rows_;
  std::vector<Level> levels_;  // each half as large as the one before
};

}  // namespace sherd::synthetic
