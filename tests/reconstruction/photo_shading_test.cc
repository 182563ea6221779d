// Photographs looked up at the points of a surface.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "cuda/host_loop.h"
#include "metaball/error.h"
#include "metaball/photo/photo_choice.h"
#include "reconstruction/dense_offset.h"
#include "reconstruction/photo_colors.h"
#include "reconstruction/photo_exposure.h"
#include "reconstruction/photo_set.h"
#include "reconstruction/photographs.h"
#include "reconstruction/surface_depths.h"
#include "tests/reconstruction/photo_board.h"

namespace sherd {
namespace {

using test::Board;
using test::BoardColor;
using ::testing::Contains;
using ::testing::HasSubstr;

// On the CPU, and by the kernels' bodies.
class Shading : public ::testing::TestWithParam<bool> {
 protected:
  static PhotographShader ShaderOf(const Survey& survey, const PhotoShadingOptions& options = {}) {
    PhotographShader shader(survey, options);
    if (GetParam()) shader.ShadeOn(MakeHostLoopPhotoShader(std::uint64_t{64} << 20));
    return shader;
  }
};
INSTANTIATE_TEST_SUITE_P(All, Shading, ::testing::Bool(), [](const auto& param_info) {
  return param_info.param ? "host_loop" : "cpu";
});

TEST_P(Shading, DetailFarFinerThanTheMetaballsIsThere) {
  const Board board;
  const Camera camera = Board::View();
  Frame frame = board.Render(camera);
  EXPECT_GT(Board::Difference(frame, camera), 0.15) << "one colour a metaball shows no stripes";
  PhotographShader shader = ShaderOf(board.survey);
  const PhotoShadingStats stats = shader.Shade(board.level, {}, camera, &frame);
  EXPECT_LT(Board::Difference(frame, camera), 0.03);
  EXPECT_EQ(stats.pixels, 400u * 300);
  EXPECT_EQ(stats.from_photos, stats.pixels);
  EXPECT_EQ(stats.without_photo, 0u);
  EXPECT_EQ(stats.photos_used, 3u);
  EXPECT_TRUE(stats.warnings.empty());
  EXPECT_GT(stats.seconds_once, 0.0);
  EXPECT_LE(stats.seconds_once, stats.seconds);
  // Once more, from what is held, the same.
  Frame again = board.Render(camera);
  shader.Shade(board.level, {}, camera, &again);
  for (std::size_t i = 0; i < frame.color.size(); ++i) {
    ASSERT_EQ(frame.color[i].r, again.color[i].r);
  }
}

TEST_P(Shading, AResizedFileIsScaled) {
  const Board board(1.5);
  const Camera camera = Board::View();
  Frame frame = board.Render(camera);
  ShaderOf(board.survey).Shade(board.level, {}, camera, &frame);
  EXPECT_LT(Board::Difference(frame, camera), 0.03);
}

TEST_P(Shading, TheDensePixelOffsetIsApplied) {
  Board board(1, 3.0);
  const Camera camera = Board::View();
  Frame without = board.Render(camera), with = without;
  ShaderOf(board.survey).Shade(board.level, {}, camera, &without);
  board.survey.dense_pixel_offset = 3.0;
  ShaderOf(board.survey).Shade(board.level, {}, camera, &with);
  EXPECT_GT(Board::Difference(without, camera), 0.06);
  EXPECT_LT(Board::Difference(with, camera), 0.03);
}

TEST_P(Shading, LightIsAppliedToThePhotographs) {
  const Board board;
  const Camera camera = Board::View();
  Frame lit = board.Render(camera), plain = lit;
  lit.light.assign(lit.color.size(), {0.5f, 0.25f, 8});
  PhotographShader shader = ShaderOf(board.survey);
  shader.Shade(board.level, {}, camera, &plain);
  shader.Shade(board.level, {}, camera, &lit);
  for (std::size_t i = 0; i < lit.color.size(); i += 97) {
    EXPECT_NEAR(lit.color[i].r, plain.color[i].r / 2, 1e-5);
    EXPECT_NEAR(lit.color[i].g, plain.color[i].g / 4, 1e-5);
    EXPECT_NEAR(lit.color[i].b, std::min(plain.color[i].b * 8, 1.0f), 1e-5);
  }
}

// A board with a screen before it, at z = 2, that hides its middle from the photographs, which show
// the screen in red there. No lists say which photograph sees what.
struct HiddenBoard : Board {
  static constexpr double kScreenX = 0.35, kScreenY = 0.3, kScreenZ = 2;

  static bool OnScreen(int photo, const Vec3d& p) {
    const Vec3d eye = EyeOf(photo);
    const Vec3d q = eye + (p - eye) * ((kScreenZ - eye.z) / (p.z - eye.z));
    return std::abs(q.x) < kScreenX && std::abs(q.y) < kScreenY;
  }
  HiddenBoard()
      : Board(1, 0, 3, [](int photo, const Vec3d& p) {
          return OnScreen(photo, p) ? Vec3f{0.8f, 0, 0} : Vec3f{0.1f, 0.5f, 0.3f};
        }) {
    SurveyPoints& points = survey.points;
    for (double x = -kScreenX; x <= kScreenX + 1e-9; x += 0.035) {
      for (double y = -kScreenY; y <= kScreenY + 1e-9; y += 0.03) {
        points.position.push_back({x, y, kScreenZ});
        points.normal.push_back({0, 0, -1});
        points.color.push_back({200, 0, 0});
      }
    }
    points.photo_begin.clear();
    points.photo_idx.clear();
    Build();
  }
  // From between the screen and the board.
  static Camera Behind() {
    return Camera::LookAt({0, 0, 2.3}, {0, 0, 4}, {0, -1, 0}, 1.2, 300, 220);
  }
};

TEST_P(Shading, WhatStandsInFrontIsNotProjectedOntoWhatItHides) {
  HiddenBoard board;
  const Camera camera = HiddenBoard::Behind();
  const Frame before = board.Render(camera);
  Frame frame = before;
  const PhotoShadingStats stats = ShaderOf(board.survey).Shade(board.level, {}, camera, &frame);
  EXPECT_EQ(stats.without_photo + stats.from_photos, stats.pixels);
  EXPECT_GT(stats.without_photo, 1000u) << "hidden from all three";
  EXPECT_GT(stats.from_photos, 20000u);
  std::uint64_t kept = 0;
  for (std::size_t i = 0; i < frame.color.size(); ++i) {
    const Pixel& p = frame.color[i];
    EXPECT_LT(p.r, 0.2f) << "the screen's red at pixel " << i;
    kept += p.r == before.color[i].r && p.g == before.color[i].g && p.b == before.color[i].b;
  }
  EXPECT_EQ(kept, stats.without_photo);
}

// The board with a hole, through which the inside of another one behind it shows, where its points
// are of quite another colour.
struct BoardWithHole : Board {
  static bool IsHole(const Vec3d& p) { return std::hypot(p.x - 0.05, p.y) < 0.2; }

  BoardWithHole() {
    const SurveyPoints whole = survey.points;
    SurveyPoints& points = survey.points;
    points = {};
    points.photo_begin.push_back(0);
    const auto add = [&](const Vec3d& position, const Vec3f& normal, Rgb8 color) {
      points.position.push_back(position);
      points.normal.push_back(normal);
      points.color.push_back(color);
      for (std::uint32_t k = 0; k < 3; ++k) points.photo_idx.push_back(k);
      points.photo_begin.push_back(points.photo_idx.size());
    };
    for (const Vec3d& p : whole.position) {
      if (!IsHole(p)) add(p, {0, 0, -1}, {10, 200, 30});
    }
    for (const Vec3d& p : whole.position) {
      if (std::hypot(p.x, p.y) < 0.6) add({p.x, p.y, 5}, {0, 0, 1}, {250, 20, 20});
    }
    Build();
  }
};

TEST_P(Shading, AHoleShowsTheSurfaceThatWouldBeThere) {
  const BoardWithHole board;
  const Camera camera = Board::View();
  Frame frame = board.Render(camera);
  const auto shows_back = [&](const Frame& f) {
    return std::count_if(f.depth.begin(), f.depth.end(), [](float d) { return d > 3.4f; });
  };
  const auto back_pixels = static_cast<std::uint64_t>(shows_back(frame));
  ASSERT_GT(back_pixels, 1000u);
  EXPECT_GT(Board::Difference(frame, camera), 0.15);
  Frame marked = frame;
  const PhotoShadingStats stats = ShaderOf(board.survey).Shade(board.level, {}, camera, &frame);
  EXPECT_LT(Board::Difference(frame, camera), 0.03);
  double sum = 0;
  for (std::size_t i = 0; i < frame.depth.size(); ++i) {
    if (!(frame.depth[i] > 3.4f)) continue;
    const RayD ray =
        RayThrough(camera, static_cast<double>(i % 400) + 0.5, static_cast<double>(i / 400) + 0.5);
    const double depth = (4 - ray.origin.z) / ray.direction.z;
    const Vec3f truth = BoardColor(ray.origin + ray.direction * depth);
    sum += std::pow(frame.color[i].r - truth.x, 2);
  }
  EXPECT_LT(std::sqrt(sum / static_cast<double>(back_pixels)), 0.05)
      << "the stripes are 0.8 from crest to trough, 8 pixels apart";
  EXPECT_EQ(stats.from_photos, stats.pixels);
  EXPECT_EQ(stats.across_holes, back_pixels);
  EXPECT_EQ(shows_back(frame), shows_back(marked)) << "the planes stay what was rendered";

  const PhotoShadingStats shown =
      ShaderOf(board.survey, {.show_unseen = true}).Shade(board.level, {}, camera, &marked);
  EXPECT_EQ(shown.across_holes, 0u);
  EXPECT_EQ(shown.without_photo, back_pixels);
}

TEST_P(Shading, ASurfaceSeenFromBehindAloneHasNoHoles) {
  const Board board;
  const Camera camera = Camera::LookAt({0, 0, 6}, {0, 0, 4}, {0, -1, 0}, 0.5, 120, 90);
  Frame frame = board.Render(camera);
  const PhotoShadingStats stats = ShaderOf(board.survey).Shade(board.level, {}, camera, &frame);
  EXPECT_GT(stats.pixels, 5000u);
  EXPECT_EQ(stats.across_holes, 0u);
  EXPECT_EQ(stats.without_photo, stats.pixels) << "nobody photographed that side";
}

TEST_P(Shading, WhatNoPhotographSeesCanBeShown) {
  HiddenBoard board;
  const Camera camera = HiddenBoard::Behind();
  Frame frame = board.Render(camera);
  const PhotoShadingStats stats =
      ShaderOf(board.survey, {.show_unseen = true}).Shade(board.level, {}, camera, &frame);
  const Vec3f marked = LinearFromRgb8(kUnseenColor);
  const auto count = std::count_if(frame.color.begin(), frame.color.end(), [&](const Pixel& p) {
    return p.r == marked.x && p.g == marked.y && p.b == marked.z;
  });
  EXPECT_GT(stats.without_photo, 1000u);
  EXPECT_EQ(static_cast<std::uint64_t>(count), stats.without_photo);
}

TEST_P(Shading, PhotographsThatAreLeftOutAreNotUsed) {
  const Board board(1, 0, 3, [](int photo, const Vec3d&) {
    return photo == 1 ? Vec3f{0.6f, 0.1f, 0.1f} : Vec3f{0.1f, 0.3f, 0.1f};
  });
  const Camera camera = Board::View();
  Frame frame = board.Render(camera);
  PhotoShadingOptions options;
  options.leave_out = {1};
  options.even_exposures = false;
  const PhotoShadingStats stats =
      ShaderOf(board.survey, options).Shade(board.level, {}, camera, &frame);
  EXPECT_EQ(stats.photos_used, 2u);
  EXPECT_EQ(stats.photos_unreadable, 0u);
  for (const Pixel& p : frame.color) EXPECT_LT(p.r, 0.12f);
  EXPECT_THROW(ShaderOf(board.survey, {.leave_out = {3}}), Error);
}

TEST_P(Shading, ThePhotographThatLooksTheSameWayDecides) {
  // The same luma, so that none is taken for one that contradicts the others.
  const Vec3f shown[] = {{0.4f, 0.2f, 0.2f}, {0.2f, 0.26f, 0.1f}, {0.2f, 0.2f, 0.8f}};
  Board board(1, 0, 3, [&](int photo, const Vec3d&) { return shown[photo]; });
  PhotoShadingOptions options;
  options.even_exposures = false;
  PhotographShader shader = ShaderOf(board.survey, options);
  for (int photo = 0; photo < 3; ++photo) {
    const Camera camera = CameraOfPhotograph(board.survey, photo, 200, 150).Cropped(80, 60, 40, 30);
    Frame frame = board.Render(camera);
    shader.Shade(board.level, {}, camera, &frame);
    for (const Pixel& p : frame.color) {
      ASSERT_GT(p.a, 0);
      EXPECT_NEAR(p.r, shown[photo].x, 0.04);
      EXPECT_NEAR(p.b, shown[photo].z, 0.1);
    }
  }
}

TEST_P(Shading, ExposuresAreEvenedOut) {
  const float exposure[] = {0.6f, 1.0f, 1.5f};
  const Board board(
      1, 0, 3, [&](int photo, const Vec3d& p) { return BoardColor(p) * (0.6f * exposure[photo]); });
  const Camera camera = Board::View();
  const auto ratio_spread = [&](bool even) {
    Frame frame = board.Render(camera);
    PhotoShadingOptions options;
    options.even_exposures = even;
    ShaderOf(board.survey, options).Shade(board.level, {}, camera, &frame);
    // The green channel is smooth: shown over painted must be one factor everywhere.
    double least = 1e9, most = 0;
    for (int y = 40; y < frame.height - 40; y += 5) {
      for (int x = 40; x < frame.width - 40; x += 5) {
        const RayD ray = RayThrough(camera, x + 0.5, y + 0.5);
        const Vec3f truth =
            BoardColor(ray.origin + ray.direction * ((4 - ray.origin.z) / ray.direction.z));
        const double r = frame.color[static_cast<std::size_t>(y) * frame.width + x].g / truth.y;
        least = std::min(least, r);
        most = std::max(most, r);
      }
    }
    return most / least;
  };
  EXPECT_GT(ratio_spread(false), 1.2);
  EXPECT_LT(ratio_spread(true), 1.06);
}

TEST(Exposure, GainsAreFoundAmongHighlights) {
  constexpr std::size_t kPlaces = 600, kPhotos = 8;
  std::uint32_t state = 1;
  const auto uniform = [&] {
    state = state * 1664525u + 1013904223u;
    return static_cast<float>(state >> 8) / static_cast<float>(1 << 24);
  };
  std::vector<Vec3f> gain(kPhotos);
  Vec3f mean{};
  for (Vec3f& g : gain) {
    g = {std::exp(0.8f * uniform() - 0.4f), std::exp(0.8f * uniform() - 0.4f),
         std::exp(0.8f * uniform() - 0.4f)};
    mean += Vec3f{std::log(g.x), std::log(g.y), std::log(g.z)} * (1.0f / kPhotos);
  }
  std::vector<ExposureSample> samples;
  for (std::uint32_t place = 0; place < kPlaces; ++place) {
    const Vec3f albedo{0.1f + 0.3f * uniform(), 0.1f + 0.3f * uniform(), 0.1f + 0.3f * uniform()};
    // A chain: each place is seen by three photographs that follow each other.
    const std::uint32_t first = place % (kPhotos - 2);
    for (std::uint32_t photo = first; photo < first + 3; ++photo) {
      Vec3f c{albedo.x / gain[photo].x, albedo.y / gain[photo].y, albedo.z / gain[photo].z};
      if (uniform() < 0.1f) c = {0.9f, 0.9f, 0.9f};  // a highlight
      samples.push_back({place, photo, c});
    }
  }
  const std::vector<Vec3f> found = EvenExposures(samples, kPlaces, kPhotos + 1);
  for (std::size_t i = 0; i < kPhotos; ++i) {
    EXPECT_NEAR(std::log(found[i].x), std::log(gain[i].x) - mean.x, 0.03);
    EXPECT_NEAR(std::log(found[i].y), std::log(gain[i].y) - mean.y, 0.03);
    EXPECT_NEAR(std::log(found[i].z), std::log(gain[i].z) - mean.z, 0.03);
  }
  EXPECT_EQ(found[kPhotos].x, 1.0f) << "no samples, no change";
  EXPECT_EQ(EvenExposures({}, 0, 2)[1].y, 1.0f);
}

TEST(Selection, NoPhotographEntersOrLeavesWithASeam) {
  const Board board(0.25, 0, 9);
  PhotoSet photos(board.survey, 1 << 20, {});
  photos.Prepare(std::vector<bool>(9, true));
  SurfaceDepths depths(board.survey, board.level, {}, std::size_t{64} << 20);
  const auto cpu = MakeCpuRenderer();
  depths.Prepare(std::make_shared<const Level>(board.level), std::vector<bool>(9, true), cpu.get(),
                 {});
  const std::vector<std::uint32_t> candidates{0, 1, 2, 3, 4, 5, 6, 7, 8};
  const PhotosView view = photos.ViewOf(depths.sights(), candidates);
  std::vector<double> before;
  double largest = 0;
  int changes = 0;
  std::vector<bool> chosen_before;
  for (double x = -0.5; x < 1.2; x += 1e-3) {
    ViewedPoint point;
    point.hit = point.position = {x, 0.1, 4};
    point.normal = {0, 0, -1};
    point.to_viewer = Normalized(Vec3d{0.3 + x, 0.2, 0} - point.hit);
    point.side_x = {0.004, 0, 0};
    point.side_y = {0, 0.004, 0};
    point.tolerance = 0.1;
    std::vector<PhotoLookup> lookups(kMostPhotos);
    const auto listed_everywhere = [](std::uint32_t) { return 1.0f; };
    lookups.resize(
        static_cast<std::size_t>(ChoosePhotos(view, point, listed_everywhere, lookups.data())));
    std::vector<double> weight(9, 0);
    std::vector<bool> chosen(9, false);
    double sum = 0;
    for (const PhotoLookup& lookup : lookups) sum += lookup.weight;
    for (const PhotoLookup& lookup : lookups) {
      weight[lookup.photo] = lookup.weight / sum;
      chosen[lookup.photo] = true;
    }
    if (!before.empty()) {
      changes += chosen != chosen_before;
      for (int i = 0; i < 9; ++i) largest = std::max(largest, std::abs(weight[i] - before[i]));
    }
    before = weight;
    chosen_before = chosen;
  }
  EXPECT_GE(changes, 2) << "photographs do come and go on this way";
  EXPECT_LT(largest, 0.02);
}

TEST(Colors, MetaballsTakeThePhotographsColorsWithoutTheHighlight) {
  const auto smooth = [](const Vec3d& p) {
    return Vec3d{0.3 + 0.1 * std::sin(3 * p.x), 0.4, 0.2 + 0.1 * p.y}.cast<float>();
  };
  Board board(1, 0, 3, [&](int photo, const Vec3d& p) {
    return photo == 1 && std::hypot(p.x, p.y) < 0.3 ? Vec3f{1, 1, 1} : smooth(p);
  });
  PhotoColorOptions options;
  const PhotoColorStats stats = ColorFromPhotographs(board.survey, options, &board.level);
  EXPECT_EQ(stats.metaballs, board.level.cloud.size());
  EXPECT_EQ(stats.colored, stats.metaballs);
  EXPECT_EQ(stats.photos_used, 3u);
  for (std::size_t i = 0; i < board.level.cloud.size(); ++i) {
    const Vec3f c = LinearFromRgb8(board.level.cloud.color[i]);
    const Vec3f truth = smooth(board.level.cloud.frame.WorldFromLocal(board.level.cloud.center[i]));
    EXPECT_NEAR(c.x, truth.x, 0.03);
    EXPECT_NEAR(c.y, truth.y, 0.04);
    EXPECT_NEAR(c.z, truth.z, 0.03);
  }
  board.level.photo_begin.clear();
  EXPECT_THROW(ColorFromPhotographs(board.survey, options, &board.level), InputError);
}

TEST(DensePixelOffset, IsMeasuredByThePointsColors) {
  for (const double shift : {0.0, 0.5}) {
    Board board(1, shift);
    for (std::size_t i = 0; i < board.survey.points.size(); ++i) {
      board.survey.points.color[i] = Rgb8FromLinear(BoardColor(board.survey.points.position[i]));
    }
    const DenseOffset measured = MeasureDenseOffset(board.survey, 0.5);
    EXPECT_TRUE(measured.measured);
    EXPECT_EQ(measured.pixels, shift);
    EXPECT_EQ(MeasureDenseOffset(board.survey, 0).pixels, 0);
    // Nothing to compare with: the documented convention.
    board.survey.photographs.clear();
    board.survey.points.photo_begin.clear();
    EXPECT_EQ(MeasureDenseOffset(board.survey, 0.5).pixels, 0.5);
  }
}

TEST_P(Shading, PhotographsThatCannotBeReadAreCountedAndTheOthersUsed) {
  Board board;
  board.survey.photographs[0].path = board.folder + "/none.ppm";
  test::WriteFile(board.survey.photographs[2].path, "P6\n800 600\n255\ncut off");
  const Camera camera = Board::View();
  Frame frame = board.Render(camera);
  PhotographShader shader = ShaderOf(board.survey);
  const PhotoShadingStats stats = shader.Shade(board.level, {}, camera, &frame);
  EXPECT_EQ(stats.photos_unreadable, 2u);
  EXPECT_EQ(stats.photos_used, 1u);
  EXPECT_THAT(stats.warnings, Contains(HasSubstr("2 photographs could not be used")));
  EXPECT_LT(Board::Difference(frame, camera), 0.05);
}

TEST_P(Shading, NeedsItsPlanes) {
  const Board board;
  const Camera camera = Board::View();
  Frame bare = board.Render(camera);
  bare.id.clear();
  PhotographShader shader = ShaderOf(board.survey);
  EXPECT_THROW(shader.Shade(board.level, {}, camera, &bare), Error);
}

TEST_P(Shading, NeedsNoLists) {
  Board board;
  board.level.photo_begin.clear();
  board.level.photo_idx.clear();
  const Camera camera = Board::View();
  Frame frame = board.Render(camera);
  const PhotoShadingStats stats = ShaderOf(board.survey).Shade(board.level, {}, camera, &frame);
  EXPECT_EQ(stats.from_photos, stats.pixels);
  EXPECT_LT(Board::Difference(frame, camera), 0.03);
}

TEST_P(Shading, ASmallBudgetGivesThePictureToo) {
  const Board board;
  const Camera camera = Board::View();
  Frame frame = board.Render(camera);
  PhotoShadingOptions small;
  small.memory_mb = 3;
  PhotographShader shader = ShaderOf(board.survey, small);  // one photograph of three at a time
  const PhotoShadingStats stats = shader.Shade(board.level, {}, camera, &frame);
  EXPECT_EQ(stats.photos_used, 3u);
  EXPECT_LT(Board::Difference(frame, camera), 0.03);
}

TEST_P(Shading, CanBeCancelled) {
  const Board board;
  const Camera camera = Board::View();
  Frame frame = board.Render(camera);
  std::stop_source source;
  source.request_stop();
  Control control;
  control.stop = source.get_token();
  EXPECT_THROW(ShaderOf(board.survey).Shade(board.level, {}, camera, &frame, control), Cancelled);
}

}  // namespace
}  // namespace sherd
