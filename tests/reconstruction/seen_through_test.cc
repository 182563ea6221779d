// Noise that hovers close above a surface.
#include "reconstruction/seen_through.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/reconstruction/test_files.h"

namespace sherd {
namespace {

// Two walls that meet in an edge towards twelve cameras, with noise that every so manieth of them
// lists.
struct Corner {
  Survey survey;
  SurveyPoints points;
  std::vector<float> spacing;
  std::vector<char> is_noise;

  explicit Corner(std::uint32_t listed_by_every) {
    survey.cameras.push_back({7, CameraModelId::kPinhole, 2000, 2000, {1000, 1000, 1000, 1000}});
    for (int i = 0; i < 12; ++i) {
      Photograph photo;
      const double angle = (i - 5.5) * 0.12;
      photo.cam_from_world = test::PoseAt({8 * std::sin(angle), 0.3, -8 * std::cos(angle)});
      survey.photographs.push_back(photo);
    }
    points.photo_begin.push_back(0);
    std::uint32_t state = 7;
    const auto uniform = [&] {
      state = state * 1664525u + 1013904223u;
      return static_cast<double>(state >> 8) / (1 << 24);
    };
    const double slope = std::numbers::sqrt2 / 2;
    for (int side : {-1, 1}) {
      const Vec3d normal{side * slope, 0, -slope};
      for (int i = 0; i < 60; ++i) {
        for (int j = 0; j < 60; ++j) {
          const double along = (i + uniform()) * 0.01, up = (j + uniform()) * 0.01;
          const Vec3d p{side * slope * along, up, slope * along};
          Add(p + normal * (0.002 * (uniform() - 0.5)), normal, 1, false);
          if (i > 5 && i < 55 && j > 5 && j < 55 && uniform() < 0.03) {
            Add(p + normal * (0.015 + 0.01 * uniform()), normal, listed_by_every, true);
          }
        }
      }
    }
    spacing.assign(points.size(), 0.01f);
  }

  void Add(const Vec3d& p, const Vec3d& normal, std::uint32_t every, bool noise) {
    points.position.push_back(p);
    points.normal.push_back(normal.cast<float>());
    is_noise.push_back(noise);
    for (std::uint32_t k = 0; k < survey.photographs.size(); ++k) {
      const Vec3d way = survey.photographs[k].cam_from_world.Center() - p;
      if (!(Dot(way, normal) > 0.2 * Length(way))) continue;
      if (k % every == 1 % every) points.photo_idx.push_back(k);
    }
    points.photo_begin.push_back(points.photo_idx.size());
  }
};

TEST(SeenThrough, NoiseThatMostPhotographsLookPastGoesAndTheSurfaceStays) {
  struct Case {
    std::uint32_t listed_by_every;
    double least, most;  // share of the noise that goes
  };
  for (const Case& expected : {Case{12, 0.97, 1.0}, Case{4, 0.9, 1.0}, Case{1, 0.0, 0.0}}) {
    const Corner c(expected.listed_by_every);
    std::vector<char> stray(c.points.size(), 0);
    FindSeenThrough(c.survey, c.points, stray, c.points, c.spacing, &stray);
    std::size_t noise = 0, found = 0, wrong = 0;
    for (std::size_t i = 0; i < stray.size(); ++i) {
      noise += c.is_noise[i];
      found += c.is_noise[i] && stray[i];
      wrong += !c.is_noise[i] && stray[i];
    }
    EXPECT_GT(noise, 100u);
    const double share = static_cast<double>(found) / static_cast<double>(noise);
    EXPECT_GE(share, expected.least) << expected.listed_by_every;
    EXPECT_LE(share, expected.most) << expected.listed_by_every;
    EXPECT_EQ(wrong, 0u) << "of 7200 points of the surface";
  }
}

TEST(SeenThrough, WithoutListsNothingIsMarked) {
  Corner c(4);
  std::vector<char> stray(c.points.size(), 0);
  c.points.photo_begin.clear();
  c.points.photo_idx.clear();
  FindSeenThrough(c.survey, c.points, stray, c.points, c.spacing, &stray);
  EXPECT_EQ(std::count(stray.begin(), stray.end(), 1), 0);
}

}  // namespace
}  // namespace sherd
