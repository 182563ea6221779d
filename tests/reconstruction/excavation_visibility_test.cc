// Photographs found by what hides what, counted against the truth of the synthetic excavation.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "datasets_synthetic/scene.h"
#include "datasets_synthetic/shots.h"
#include "datasets_synthetic/survey_points.h"
#include "reconstruction/geometric_visibility.h"

namespace sherd {
namespace {

using synthetic::FusedPoint;
using synthetic::Lens;
using synthetic::Shot;
using synthetic::TrenchScene;

struct Figures {
  std::uint64_t points = 0;
  double recall = 0;     // of the pairs of a point and a photograph that truly sees it
  double precision = 0;  // of the pairs found: nothing of the true surface is in between
  double in_three = 0;   // of the points: found in at least three that truly see them
};

class Trench {
 public:
  Trench() : scene_(options_.seed), plan_(synthetic::PlanShots(options_)) {
    for (const Lens& lens : plan_.lenses) pinholes_.push_back(UndistortedLens(lens));
  }

  // noise_m: of the points, standard deviation; with it a two-hundredth of them are strays.
  Figures Count(std::uint64_t points, double noise_m, int most_photographs) {
    options_.dense_points = points;
    options_.noise_m = noise_m;
    options_.outlier_share = noise_m > 0 ? 0.005 : 0;
    std::vector<std::size_t> order(plan_.shots.size());
    std::iota(order.begin(), order.end(), 0);
    const std::vector<FusedPoint> cloud =
        MakeDenseCloud(scene_, plan_, pinholes_, order, options_, {});
    Survey survey = SurveyOf(cloud);
    VisibilityOptions visibility;
    visibility.most_photographs = most_photographs;
    FindVisibility(visibility, &survey);

    Figures out;
    std::uint64_t true_pairs = 0, found_again = 0, found = 0, right = 0, three = 0;
    const std::vector<std::uint64_t>& begin = survey.points.photo_begin;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const Vec3d p = survey.points.position[i];
      if (scene_.bvh().Distance(p) > 5 * noise_m + 1e-4) continue;  // a stray
      ++out.points;
      const std::vector<std::uint32_t>& truth = cloud[i].image_idx;
      true_pairs += truth.size();
      int again = 0;
      for (std::uint64_t k = begin[i]; k < begin[i + 1]; ++k) {
        const std::uint32_t photo = survey.points.photo_idx[k];
        const bool listed = std::binary_search(truth.begin(), truth.end(), photo);
        ++found;
        again += listed;
        // The truth lists none that sees the place at more than 80 degrees, but that is no mistake.
        right += listed || !Hidden(plan_.shots[photo].eye, p, cloud[i].normal, noise_m);
      }
      found_again += static_cast<std::uint64_t>(again);
      three += again >= 3;
    }
    const auto share = [](std::uint64_t part, std::uint64_t all) {
      return static_cast<double>(part) / static_cast<double>(all);
    };
    out.recall = share(found_again, true_pairs);
    out.precision = share(right, found);
    out.in_three = share(three, out.points);
    std::printf(
        "%6llu points, noise %.0f mm, %3d photographs at most: recall %.4f, precision %.4f, "
        "three %.4f\n",
        static_cast<unsigned long long>(points), 1000 * noise_m, most_photographs, out.recall,
        out.precision, out.in_three);
    return out;
  }

 private:
  Survey SurveyOf(const std::vector<FusedPoint>& cloud) const {
    Survey survey;
    for (const Lens& lens : pinholes_) {
      survey.cameras.push_back({lens.camera_id, CameraModelId::kPinhole,
                                static_cast<std::uint64_t>(lens.width),
                                static_cast<std::uint64_t>(lens.height), lens.Params()});
    }
    for (const Shot& shot : plan_.shots) {
      Photograph photo;
      photo.name = shot.name;
      photo.camera_idx = static_cast<std::uint32_t>(shot.lens_idx);
      photo.cam_from_world = {shot.q[0], shot.q[1], shot.q[2], shot.q[3], shot.t};
      survey.photographs.push_back(photo);
    }
    for (const FusedPoint& p : cloud) {
      survey.points.position.push_back(p.position.cast<double>());
      survey.points.normal.push_back(p.normal);
    }
    return survey;
  }

  // Whether the true surface stands between them, farther before the point than its own noise.
  bool Hidden(const Vec3d& eye, const Vec3d& p, const Vec3f& normal, double noise_m) const {
    const Vec3d way = p - eye;
    const double distance = Length(way);
    const double cosine = -Dot(way, normal.cast<double>()) / distance;
    const double clear = 5e-4 + 3 * noise_m / std::max(cosine, 0.1);
    return scene_.bvh().Occluded({eye, way / distance}, distance - clear);
  }

  ExcavationOptions options_;
  TrenchScene scene_;
  synthetic::ShotPlan plan_;
  std::vector<Lens> pinholes_;
};

TEST(ExcavationVisibility, PhotographsFoundAreThoseThatSeeThePoints) {
  Trench trench;
  // What is found coarsens with the points: cells as wide as they are apart.
  const Figures few = trench.Count(20000, 0, 100);
  EXPECT_EQ(few.points, 20000u);
  EXPECT_GT(few.recall, 0.98);
  EXPECT_GT(few.precision, 0.975);
  EXPECT_GT(few.in_three, 0.998);
  const Figures noisy = trench.Count(100000, 0.001, 100);
  EXPECT_GT(noisy.points, 99000u);
  EXPECT_GT(noisy.recall, 0.975);
  EXPECT_GT(noisy.precision, 0.985);
  EXPECT_GT(noisy.in_three, 0.997);
  // As at import: the best twelve of each point, of up to 24 that see it.
  const Figures best = trench.Count(20000, 0.001, 12);
  EXPECT_GT(best.recall, 0.75);
  EXPECT_GT(best.precision, 0.98);
  EXPECT_GT(best.in_three, 0.996);
}

}  // namespace
}  // namespace sherd
