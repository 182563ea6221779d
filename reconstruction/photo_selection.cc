#include "reconstruction/photo_selection.h"

#include <algorithm>
#include <cmath>

namespace sherd {
namespace {

// Penalties, in radians of viewing direction (docs/fidelity.md has what each is worth).
constexpr double kPerOctaveTooCoarse = 0.05;  // the picture's pixels finer than the photograph's
constexpr double kAtAnOutline = 0.15;
constexpr double kHalfHidden = 0.3;  // or in the middle of the border, or halfway to a mask
constexpr double kNotListed = 0.05;  // the reconstruction did not use it here
constexpr double kMost = 4.0;
constexpr double kLeast = 0.02;  // below this, penalties count alike
constexpr double kLeastCosine = 0.05;

// 1 inside, falling to 0 over the outer twentieth of the picture.
double BorderWeight(double x, double y, double width, double height) {
  const double margin = 0.05 * std::min(width, height);
  const double distance = std::min({x, y, width - x, height - y});
  const double t = std::clamp(distance / margin, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

struct Direction {
  double cosine = 0;  // of the angle to the viewer's
  std::uint32_t photo = 0;
  double Angle() const { return std::acos(std::clamp(cosine, -1.0, 1.0)); }
  // More alike in direction.
  friend bool operator<(const Direction& a, const Direction& b) {
    return a.cosine != b.cosine ? a.cosine > b.cosine : a.photo < b.photo;
  }
};

struct Choice {
  double penalty = 0;
  PhotoLookup lookup;
};

}  // namespace

void PhotoSelector::Select(const ViewedPoint& point, std::uint32_t target,
                           std::vector<PhotoLookup>* out) const {
  const std::size_t before = out->size();
  Choose(point, target, out);
  if (out->size() > before) return;
  // No photograph faces the sheet, whose normal may be wrong (noise): a patch that faces the
  // viewer, where the ray met the surface.
  ViewedPoint facing = point;
  facing.surface.position = point.hit;
  facing.surface.normal = point.to_viewer.cast<float>();
  const auto across = [&](const Vec3d& side) {
    return side - point.to_viewer * Dot(side, point.to_viewer);
  };
  facing.side_x = across(point.side_x);
  facing.side_y = across(point.side_y);
  Choose(facing, target, out);
}

void PhotoSelector::Choose(const ViewedPoint& point, std::uint32_t target,
                           std::vector<PhotoLookup>* out) const {
  thread_local std::vector<Direction> directions;
  directions.clear();
  const Vec3d& p = point.surface.position;
  const Vec3d normal = point.surface.normal.cast<double>();
  for (const std::uint32_t photo : candidates_) {
    const PhotoView* const view = photos_.View(photo);
    if (!view) continue;
    const Vec3d way = view->center() - p;
    const double distance = Length(way);
    if (!(Dot(way, normal) > kLeastCosine * distance)) continue;
    directions.push_back({Dot(way, point.to_viewer) / distance, photo});
  }
  // Taken in the order of the angle, of which no penalty is less: most are never looked at.
  std::make_heap(directions.begin(), directions.end(),
                 [](const Direction& a, const Direction& b) { return b < a; });
  Choice best[kMostPhotos + 1];
  std::size_t count = 0;
  auto end = directions.end();
  while (end != directions.begin()) {
    std::pop_heap(directions.begin(), end,
                  [](const Direction& a, const Direction& b) { return b < a; });
    const Direction next = *--end;
    const double angle = next.Angle();
    if (count > kMostPhotos && angle >= best[kMostPhotos].penalty) break;
    const PhotoView& view = *photos_.View(next.photo);
    double x = 0, y = 0, ax = 0, ay = 0, bx = 0, by = 0;
    if (!view.Project(p, &x, &y)) continue;
    float listed = 0;
    for (const SurfacePoint::PhotoShare& share : point.surface.photos) {
      if (share.photo == next.photo) listed = share.weight;
    }
    const PhotoSight sight =
        depths_.At(next.photo, point.hit, point.surface.normal, point.tolerance);
    // Where the depth map contradicts the reconstruction's own list, the list has half a say.
    double clear = std::max<double>(sight.visible, 0.5 * listed) *
                   BorderWeight(x, y, view.width(), view.height());
    if (!(clear > 0.01)) continue;
    if (!view.Project(p + point.side_x, &ax, &ay) || !view.Project(p + point.side_y, &bx, &by)) {
      continue;
    }
    Choice choice;
    choice.lookup.target = target;
    choice.lookup.photo = next.photo;
    choice.lookup.x = static_cast<float>(x);
    choice.lookup.y = static_cast<float>(y);
    SetFootprint(ax - x, ay - y, bx - x, by - y, &choice.lookup);
    clear *= photos_.Unmasked(choice.lookup, p);
    if (!(clear > 0)) continue;
    const double coarse = std::max(0.0, -std::log2(std::max(1e-3, double(choice.lookup.width_px))));
    choice.penalty = angle + kPerOctaveTooCoarse * coarse + kAtAnOutline * (1 - sight.inside) +
                     kHalfHidden * (1 / clear - 1) + kNotListed * (1 - listed);
    if (!(choice.penalty < kMost)) continue;
    std::size_t at = std::min(count, kMostPhotos);
    if (count > kMostPhotos && choice.penalty >= best[kMostPhotos].penalty) continue;
    for (; at > 0 && best[at - 1].penalty > choice.penalty; --at) best[at] = best[at - 1];
    best[at] = choice;
    count = std::min(count + 1, kMostPhotos + 1);
  }
  const double limit = count > kMostPhotos ? best[kMostPhotos].penalty : kMost;
  for (std::size_t i = 0; i < std::min(count, kMostPhotos); ++i) {
    const double penalty = std::max(best[i].penalty, kLeast);
    const double root = (1 - best[i].penalty / limit) / penalty;
    best[i].lookup.weight = static_cast<float>(std::max(root * root, 1e-9));
    out->push_back(best[i].lookup);
  }
}

void PhotoSelector::Nearest(const Vec3d& point, const Vec3f& normal, const Vec3d& to_viewer,
                            std::size_t most, std::vector<std::uint32_t>* out) const {
  std::vector<Direction> directions;
  for (const std::uint32_t photo : candidates_) {
    const PhotoView* const view = photos_.View(photo);
    double x = 0, y = 0;
    if (!view || !view->Project(point, &x, &y)) continue;
    PhotoLookup pixel;
    pixel.photo = photo;
    if (!(photos_.Unmasked(pixel, point) > 0)) continue;
    const Vec3d way = view->center() - point;
    const double distance = Length(way);
    if (!(Dot(way, normal.cast<double>()) > kLeastCosine * distance)) continue;
    directions.push_back({Dot(way, to_viewer) / distance, photo});
  }
  const std::size_t kept = std::min(most, directions.size());
  std::partial_sort(directions.begin(), directions.begin() + static_cast<std::ptrdiff_t>(kept),
                    directions.end());
  for (std::size_t i = 0; i < kept; ++i) out->push_back(directions[i].photo);
}

}  // namespace sherd
