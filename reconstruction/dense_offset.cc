#include "reconstruction/dense_offset.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "metaball/photo/filter.h"
#include "reconstruction/photo_set.h"

namespace sherd {
namespace {

constexpr std::size_t kPhotographs = 12;
constexpr std::size_t kPointsOfPhoto = 4000;
constexpr std::size_t kFewest = 500;  // comparisons
constexpr double kStandardErrors = 5;

// The photographs that most points list, at most kPhotographs of them, ascending.
std::vector<std::uint32_t> MostListed(const Survey& survey) {
  std::vector<std::uint64_t> count(survey.photographs.size(), 0);
  for (const std::uint32_t photo : survey.points.photo_idx) ++count[photo];
  std::vector<std::uint32_t> order(count.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return count[a] > count[b]; });
  std::erase_if(order, [&](std::uint32_t i) {
    return count[i] == 0 ||
           (survey.photographs[i].path.empty() && survey.photographs[i].original_path.empty());
  });
  order.resize(std::min(order.size(), kPhotographs));
  std::sort(order.begin(), order.end());
  return order;
}

}  // namespace

DenseOffset MeasureDenseOffset(const Survey& survey, double documented, const Control& control) {
  DenseOffset out;
  out.pixels = documented;
  const SurveyPoints& points = survey.points;
  if (documented == 0 || points.photo_begin.empty() || points.color.size() != points.size()) {
    return out;
  }
  // The undistorted copies, where they are there: the fused colours come from them.
  Survey plain;
  plain.cameras = survey.cameras;
  plain.photographs = survey.photographs;
  for (Photograph& photo : plain.photographs) {
    if (!photo.path.empty()) photo.original_path.clear();
  }
  const std::vector<std::uint32_t> chosen = MostListed(survey);
  std::vector<std::vector<std::uint32_t>> seen(survey.photographs.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::uint64_t k = points.photo_begin[i]; k < points.photo_begin[i + 1]; ++k) {
      seen[points.photo_idx[k]].push_back(static_cast<std::uint32_t>(i));
    }
  }
  PhotoSet photos(plain, std::size_t{256} << 20, {});
  std::vector<bool> needed(plain.photographs.size(), false);
  for (const std::uint32_t photo : chosen) needed[photo] = true;
  photos.Prepare(needed);

  // Pairs of lookups: without the offset and with it. The lookups are those of one pixel of the
  // dense stage.
  std::vector<PhotoLookup> lookups;
  std::vector<std::uint32_t> point_of;
  for (const std::uint32_t photo : chosen) {
    const PhotoView* const view = photos.View(photo);
    if (!view) continue;
    double fx, fy, cx, cy;
    survey.cameras[survey.photographs[photo].camera_idx].Pinhole(&fx, &fy, &cx, &cy);
    const Rigid3d& pose = survey.photographs[photo].cam_from_world;
    const std::size_t step = std::max<std::size_t>(1, seen[photo].size() / kPointsOfPhoto);
    for (std::size_t k = 0; k < seen[photo].size(); k += step) {
      const Vec3d p = points.position[seen[photo][k]];
      const double depth = pose.Apply(p).z;
      if (!(depth > 0)) continue;
      const Vec3d right = pose.InverseRotate({depth / fx, 0, 0});
      const Vec3d down = pose.InverseRotate({0, depth / fy, 0});
      PhotoLookup pair[2];
      bool inside = true;
      for (int with = 0; with < 2 && inside; ++with) {
        const Vec3d q = p + (right + down) * (with * documented);
        double x, y, ax, ay, bx, by;
        inside = view->Project(q, &x, &y) && view->Project(q + right, &ax, &ay) &&
                 view->Project(q + down, &bx, &by);
        if (!inside) break;
        pair[with].photo = photo;
        pair[with].x = static_cast<float>(x);
        pair[with].y = static_cast<float>(y);
        SetFootprint(ax - x, ay - y, bx - x, by - y, &pair[with]);
      }
      if (!inside) continue;
      point_of.push_back(seen[photo][k]);
      lookups.insert(lookups.end(), pair, pair + 2);
    }
  }
  std::vector<Vec3f> color(lookups.size(), Vec3f{-1, 0, 0});
  photos.Visit(
      lookups, "comparing points and photographs",
      [&](std::size_t i, const PhotoPyramid& pyramid) {
        color[i] = SampleFootprint(pyramid, lookups[i]);
      },
      control);

  // Encoded values: differences as the eye, and the 8 bits, see them.
  const auto squared = [](const Vec3f& c, Rgb8 point) {
    const double r = SrgbFromLinear(c.x) - point.r / 255.0,
                 g = SrgbFromLinear(c.y) - point.g / 255.0,
                 b = SrgbFromLinear(c.z) - point.b / 255.0;
    return r * r + g * g + b * b;
  };
  double n = 0, sum = 0, squares = 0;
  for (std::size_t i = 0; i < point_of.size(); ++i) {
    if (color[2 * i].x < 0 || color[2 * i + 1].x < 0) continue;
    const double without = squared(color[2 * i], points.color[point_of[i]]);
    const double with = squared(color[2 * i + 1], points.color[point_of[i]]);
    out.error_without += without;
    out.error_with += with;
    const double difference = with - without;
    n += 1;
    sum += difference;
    squares += difference * difference;
  }
  if (n < kFewest) return out;
  out.error_without /= n;
  out.error_with /= n;
  const double mean = sum / n;
  const double error = std::sqrt(std::max(0.0, squares / n - mean * mean) / n);
  if (std::abs(mean) <= kStandardErrors * error) return out;
  out.measured = true;
  out.pixels = mean < 0 ? documented : 0;
  return out;
}

}  // namespace sherd
