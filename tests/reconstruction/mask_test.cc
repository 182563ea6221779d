// Masks where the photographs' colours are looked up.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "cuda/host_loop.h"
#include "reconstruction/mask_distance.h"
#include "reconstruction/photo_colors.h"
#include "reconstruction/photographs.h"
#include "tests/reconstruction/photo_board.h"

namespace sherd {
namespace {

using test::Board;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const Vec3f kPaint{0.1f, 0.5f, 0.3f}, kCoat{0.9f, 0.0f, 0.0f};

// A board before which somebody in a red coat stands in the first two of three photographs, towards
// a corner, where the lens distorts.
struct PassedBoard : Board {
  static bool Hidden(const Vec3d& p) { return std::hypot(p.x - 1.0, p.y - 0.8) < 0.25; }

  PassedBoard()
      : Board(1, 0, 3,
              [](int photo, const Vec3d& p) { return photo < 2 && Hidden(p) ? kCoat : kPaint; }) {}

  void MaskThem() {
    Mask(0, Hidden);
    Mask(1, Hidden);
  }
  static Camera View() {
    return Camera::LookAt({0.4, 0.3, 1.2}, {0.95, 0.75, 4}, {0, -1, 0}, 0.4, 300, 220);
  }
  Frame Shaded(PhotoShadingStats* stats) const {
    PhotographShader shader(survey, {.even_exposures = false});
    Frame frame = Render(View()), by_kernels = frame;
    *stats = shader.Shade(level, {}, View(), &frame);
    shader.ShadeOn(MakeHostLoopPhotoShader(std::uint64_t{16} << 20));
    shader.Shade(level, {}, View(), &by_kernels);
    EXPECT_TRUE(test::SameColors(frame, by_kernels));
    return frame;
  }
};

float MostRed(const Frame& frame) {
  float most = 0;
  for (const Pixel& p : frame.color) most = std::max(most, p.r);
  return most;
}

TEST(Masks, WhatIsMaskedIsNotLookedUp) {
  PassedBoard board;
  PhotoShadingStats stats;
  EXPECT_GT(MostRed(board.Shaded(&stats)), 0.5f) << "two photographs against one";
  board.MaskThem();
  EXPECT_LT(MostRed(board.Shaded(&stats)), 0.11f);
  EXPECT_EQ(stats.without_photo, 0u) << "the third photograph shows all of it";
  EXPECT_EQ(stats.photos_used, 3u);
  EXPECT_THAT(stats.warnings, ElementsAre());
}

TEST(Masks, AreOfTheOriginalAlsoWhereItsUndistortedCopyIsLookedUp) {
  PassedBoard board;
  board.survey.cameras.push_back({2, CameraModelId::kPinhole, 800, 600, {700, 700, 400, 300}});
  for (int photo = 0; photo < 3; ++photo) {
    Photograph& copy = board.survey.photographs[photo];
    copy.camera_idx = 1;
    copy.path = board.folder + "/undistorted/" + copy.name;
    test::WriteFile(copy.path, "");
    test::WritePpm(copy.path, 800, 600, [&](int x, int y) {
      const Vec3d p = board.PlaceAt(photo, 0, x + 0.5, y + 0.5);
      return Rgb8FromLinear(photo < 2 && PassedBoard::Hidden(p) ? kCoat : kPaint);
    });
  }
  board.MaskThem();
  PhotoShadingStats stats;
  EXPECT_LT(MostRed(board.Shaded(&stats)), 0.11f);
  EXPECT_EQ(stats.without_photo, 0u);
}

TEST(Masks, WhereAllAreMaskedTheSurfaceKeepsItsColour) {
  PassedBoard board;
  board.MaskThem();
  board.Mask(2, PassedBoard::Hidden);
  const Frame before = board.Render(PassedBoard::View());
  PhotoShadingStats stats;
  const Frame frame = board.Shaded(&stats);
  std::uint64_t hidden = 0;
  for (std::size_t i = 0; i < frame.color.size(); ++i) {
    const RayD ray = RayThrough(PassedBoard::View(), i % 300 + 0.5, i / 300 + 0.5);
    if (!PassedBoard::Hidden(ray.origin + ray.direction * ((4 - ray.origin.z) / ray.direction.z))) {
      continue;
    }
    ++hidden;
    EXPECT_EQ(frame.color[i].g, before.color[i].g) << i;
  }
  EXPECT_GT(hidden, 5000u);
  EXPECT_GT(stats.without_photo, hidden);
  // Nor do the eight pixels beside it.
  EXPECT_LT(static_cast<double>(stats.without_photo), 1.3 * static_cast<double>(hidden));
}

TEST(Masks, WhatIsMaskedGivesMetaballsNoColour) {
  PassedBoard board;
  const auto most_red = [&] {
    ColorFromPhotographs(board.survey, {.even_exposures = false}, &board.level);
    float most = 0;
    for (const Rgb8& c : board.level.cloud.color) most = std::max(most, LinearFromRgb8(c).x);
    return most;
  };
  EXPECT_GT(most_red(), 0.5f);
  board.MaskThem();
  EXPECT_LT(most_red(), 0.11f);
}

TEST(Masks, ThoseThatCannotBeReadAreNamedOnceAndThePhotographsUsedWhole) {
  PassedBoard board;
  PhotoShadingStats stats;
  const Frame without = board.Shaded(&stats);
  board.survey.photographs[0].mask_path = board.folder + "/gone.png";
  board.survey.photographs[1].mask_path = board.folder + "/broken.png";
  test::WriteFile(board.survey.photographs[1].mask_path, "no picture");
  const Frame with = board.Shaded(&stats);
  EXPECT_THAT(stats.warnings, ElementsAre(AllOf(HasSubstr("2 masks cannot be read"),
                                                HasSubstr("gone.png"), HasSubstr("whole"))));
  for (std::size_t i = 0; i < with.color.size(); ++i) {
    ASSERT_EQ(with.color[i].r, without.color[i].r);
  }
  EXPECT_THAT(ColorFromPhotographs(board.survey, {}, &board.level).warnings,
              ElementsAre(HasSubstr("2 masks cannot be read")));
}

// The mask of MaskDistance's tests: a bar and a dot.
bool IsBlack(double u, double v) {
  return (u > 0.3 && u < 0.34 && v < 0.6) || std::hypot(u - 0.7, v - 0.4) < 0.05;
}

std::string WriteMask(int width, int height) {
  const std::string path = test::TestFolder() + "/mask.png";
  std::string bytes = "P5\n" + std::to_string(width) + " " + std::to_string(height) + "\n255\n";
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      bytes += IsBlack((x + 0.5) / width, (y + 0.5) / height) ? '\0' : '\1';
    }
  }
  test::WriteFile(path, bytes);
  return path;
}

TEST(MaskDistance, IsNeverMoreThanTheDistanceAndLittleLess) {
  struct Case {
    int mask_width, mask_height;
    std::size_t max_bytes;
  };
  const SurveyCamera camera{1, CameraModelId::kSimplePinhole, 200, 150, {1, 1, 1}};
  // Of the photograph's size; larger; smaller and of another shape; with little memory.
  for (const Case& c : {Case{200, 150, 1 << 20}, Case{500, 375, 1 << 20}, Case{45, 50, 1 << 20},
                        Case{200, 150, 900}}) {
    const MaskDistance mask(WriteMask(c.mask_width, c.mask_height), camera, c.max_bytes);
    EXPECT_LE(mask.MemoryBytes(), c.max_bytes);
    const double px = 200.0 / c.mask_width, py = 150.0 / c.mask_height;
    std::vector<Vec3d> black;  // the pixels' corners
    for (int j = 0; j < c.mask_height; ++j) {
      for (int i = 0; i < c.mask_width; ++i) {
        if (IsBlack((i + 0.5) / c.mask_width, (j + 0.5) / c.mask_height)) {
          black.push_back({i * px, j * py, 0});
        }
      }
    }
    for (double x = 0; x <= 200; x += 5.3) {
      for (double y = 0; y <= 150; y += 4.7) {
        double truth = std::numeric_limits<double>::infinity();
        for (const Vec3d& b : black) {
          truth = std::min(truth, std::hypot(std::max({0.0, b.x - x, x - b.x - px}),
                                             std::max({0.0, b.y - y, y - b.y - py})));
        }
        const double told = mask.At(x, y);
        ASSERT_LE(told, truth + 1e-9) << x << " " << y;
        ASSERT_GE(told, std::min(truth - 3.5 * mask.cell_px(), 62 * mask.cell_px()))
            << x << " " << y;
      }
    }
  }
}

TEST(MaskDistance, WithoutBlackPixelsNothingIsHeld) {
  const std::string path = test::TestFolder() + "/white.png";
  test::WriteFile(path, "P5\n4 3\n255\n" + std::string(12, '\1'));
  const SurveyCamera camera{1, CameraModelId::kSimplePinhole, 400, 300, {1, 1, 1}};
  const MaskDistance white(path, camera, 1 << 20);
  EXPECT_EQ(white.MemoryBytes(), 0u);
  EXPECT_EQ(white.At(200, 150), std::numeric_limits<double>::infinity());
  test::WriteFile(path, "P5\n4 3\n255\n" + std::string(12, '\0'));
  EXPECT_EQ(MaskDistance(path, camera, 1 << 20).At(200, 150), 0);
  EXPECT_LE(MaskDistance(path, {1, CameraModelId::kSimplePinhole, 8688, 5792, {1, 1, 1}}, 64 << 20)
                .MemoryBytes(),
            std::size_t{MaskDistance::kLargestSide} * MaskDistance::kLargestSide);
}

}  // namespace
}  // namespace sherd
