#include "datasets_synthetic/board_text.h"

#include <ft2build.h>
#include FT_FREETYPE_H

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>

#include "datasets_synthetic/random.h"
#include "metaball/error.h"

namespace sherd::synthetic {
namespace {

constexpr double kTexel = 0.0002;  // 20 texels in the height of the smallest letters
constexpr double kMargin = 0.030;
constexpr double kRowGap = 0.55;  // between two rows, in letter heights of the lower one

// Where Debian, Fedora, Arch and macOS (Homebrew) keep the font.
constexpr const char* kFontPaths[] = {"/usr/share/fonts/truetype/dejavu/DejaVuSans-Bold.ttf",
                                      "/usr/share/fonts/dejavu-sans-fonts/DejaVuSans-Bold.ttf",
                                      "/usr/share/fonts/TTF/DejaVuSans-Bold.ttf",
                                      "/opt/homebrew/share/fonts/DejaVuSans-Bold.ttf"};

// The typeface; lengths in texels.
class Typeface {
 public:
  Typeface() {
    if (FT_Init_FreeType(&library_) != 0) throw Error("FreeType could not be started");
    for (const char* path : kFontPaths) {
      std::error_code error;
      if (std::filesystem::exists(path, error) && FT_New_Face(library_, path, 0, &face_) == 0) {
        break;
      }
    }
    if (face_ == nullptr) {
      FT_Done_FreeType(library_);
      throw Error(
          "the font DejaVu Sans Bold, which the synthetic board is printed in, was not found; "
          "install it (Debian: apt install fonts-dejavu-core)");
    }
    FT_Load_Char(face_, 'H', FT_LOAD_NO_SCALE);
    capital_share_ = static_cast<double>(face_->glyph->metrics.height) /
                     static_cast<double>(face_->units_per_EM);
  }
  ~Typeface() {
    FT_Done_Face(face_);
    FT_Done_FreeType(library_);
  }
  Typeface(const Typeface&) = delete;
  Typeface& operator=(const Typeface&) = delete;

  void SetCapitalHeight(double texels) {
    const double em = texels / capital_share_;
    FT_Set_Char_Size(face_, 0, static_cast<FT_F26Dot6>(std::lround(em * 64)), 72, 72);
  }
  // Unhinted outlines, so that letters have the size asked for.
  FT_GlyphSlot Load(char c, bool render) {
    const FT_Int32 flags = FT_LOAD_NO_HINTING | FT_LOAD_NO_BITMAP | (render ? FT_LOAD_RENDER : 0);
    if (FT_Load_Char(face_, static_cast<FT_ULong>(static_cast<unsigned char>(c)), flags) != 0) {
      throw Error(std::string("the board's font has no letter '") + c + "'");
    }
    return face_->glyph;
  }
  double Width(const std::string& text) {
    double width = 0;
    for (const char c : text) {
      width += static_cast<double>(Load(c, false)->linearHoriAdvance) / 65536.0;
    }
    return width;
  }

 private:
  FT_Library library_ = nullptr;
  FT_Face face_ = nullptr;
  double capital_share_ = 0.73;
};

// Capitals and digits that are not mistaken for each other and do not reach below the line.
std::string Code(Rng* rng, int length) {
  static constexpr char kLetters[] = "ABCDEFGHKLMNPRSTUVWXYZ23456789";
  std::string code;
  for (int i = 0; i < length; ++i) code += kLetters[rng->Index(sizeof(kLetters) - 1)];
  return code;
}

std::string NextWord(Rng* rng) {
  static constexpr std::array<const char*, 14> kWords{
      "SITE",  "TRENCH", "CONTEXT", "LAYER", "FLOOR", "SECTION", "FIND",
      "LEVEL", "DATUM",  "NORTH",   "WALL",  "CUT",   "FILL",    "SAMPLE"};
  if (rng->Uniform() < 0.5) return kWords[static_cast<std::size_t>(rng->Index(14))];
  return Code(rng, 3 + rng->Index(3));
}

}  // namespace

float BoardText::Level::At(int x, int y) const {
  if (x < 0 || y < 0 || x >= width || y >= height) return 0;
  return static_cast<float>(ink[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                static_cast<std::size_t>(x)]) *
         (1.0f / 255.0f);
}

BoardText::BoardText(std::uint32_t seed) {
  Typeface face;
  Rng rng(HashOf(seed, 70));
  Level level;
  level.width = static_cast<int>(std::lround(kBoardWidth / kTexel));
  level.height = static_cast<int>(std::lround(kBoardHeight / kTexel));
  level.ink.assign(static_cast<std::size_t>(level.width) * static_cast<std::size_t>(level.height),
                   0);
  const double room = (kBoardWidth - 2 * kMargin) / kTexel;
  double y_m = kBoardHeight - kMargin;  // upper edge of the next row
  for (const double height_m : kLetterHeights) {
    face.SetCapitalHeight(height_m / kTexel);
    std::string text;
    for (int word = 0, tries = 0; word < 6 && tries < 60; ++tries) {
      const std::string longer = text + (text.empty() ? "" : " ") + NextWord(&rng);
      if (face.Width(longer) > room) continue;
      text = longer;
      ++word;
    }
    Row row;
    row.text = text;
    row.letter_height_m = height_m;
    row.baseline_m = y_m - height_m;
    y_m = row.baseline_m - kRowGap * height_m;
    double pen = kMargin / kTexel;
    const int baseline = static_cast<int>(std::lround((kBoardHeight - row.baseline_m) / kTexel));
    row.left_m = pen * kTexel;
    for (const char c : text) {
      const FT_GlyphSlot glyph = face.Load(c, true);
      const FT_Bitmap& bitmap = glyph->bitmap;
      const int x0 = static_cast<int>(std::lround(pen)) + glyph->bitmap_left;
      const int y0 = baseline - glyph->bitmap_top;
      for (int y = 0; y < static_cast<int>(bitmap.rows); ++y) {
        for (int x = 0; x < static_cast<int>(bitmap.width); ++x) {
          const int tx = x0 + x, ty = y0 + y;
          if (tx < 0 || ty < 0 || tx >= level.width || ty >= level.height) continue;
          std::uint8_t& texel =
              level.ink[static_cast<std::size_t>(ty) * static_cast<std::size_t>(level.width) +
                        static_cast<std::size_t>(tx)];
          texel = std::max(texel, bitmap.buffer[y * bitmap.pitch + x]);
        }
      }
      pen += static_cast<double>(glyph->linearHoriAdvance) / 65536.0;
    }
    row.right_m = pen * kTexel;
    rows_.push_back(row);
  }
  levels_.push_back(std::move(level));
  BuildPyramid();
}

void BoardText::BuildPyramid() {
  while (levels_.back().width % 2 == 0 && levels_.back().height % 2 == 0) {
    const Level& fine = levels_.back();
    Level coarse;
    coarse.width = fine.width / 2;
    coarse.height = fine.height / 2;
    coarse.ink.resize(static_cast<std::size_t>(coarse.width) *
                      static_cast<std::size_t>(coarse.height));
    for (int y = 0; y < coarse.height; ++y) {
      for (int x = 0; x < coarse.width; ++x) {
        const float sum = fine.At(2 * x, 2 * y) + fine.At(2 * x + 1, 2 * y) +
                          fine.At(2 * x, 2 * y + 1) + fine.At(2 * x + 1, 2 * y + 1);
        coarse.ink[static_cast<std::size_t>(y) * static_cast<std::size_t>(coarse.width) +
                   static_cast<std::size_t>(x)] =
            static_cast<std::uint8_t>(sum * (255.0f / 4.0f) + 0.5f);
      }
    }
    levels_.push_back(std::move(coarse));
  }
}

float BoardText::Bilinear(const Level& level, double u, double v) const {
  const double x = u * level.width - 0.5, y = v * level.height - 0.5;
  const int ix = static_cast<int>(std::floor(x)), iy = static_cast<int>(std::floor(y));
  const float fx = static_cast<float>(x - ix), fy = static_cast<float>(y - iy);
  const float top = level.At(ix, iy) * (1 - fx) + level.At(ix + 1, iy) * fx;
  const float bottom = level.At(ix, iy + 1) * (1 - fx) + level.At(ix + 1, iy + 1) * fx;
  return top * (1 - fy) + bottom * fy;
}

float BoardText::Ink(double x, double y, double footprint_m) const {
  const double u = x / kBoardWidth, v = 1.0 - y / kBoardHeight;
  if (!(u > 0 && u < 1 && v > 0 && v < 1)) return 0;
  const double level = std::clamp(std::log2(std::max(footprint_m, kTexel) / kTexel), 0.0,
                                  static_cast<double>(levels_.size() - 1));
  const auto fine = static_cast<std::size_t>(level);
  const std::size_t coarse = std::min(fine + 1, levels_.size() - 1);
  const float blend = static_cast<float>(level - static_cast<double>(fine));
  return Bilinear(levels_[fine], u, v) * (1 - blend) + Bilinear(levels_[coarse], u, v) * blend;
}

}  // namespace sherd::synthetic
