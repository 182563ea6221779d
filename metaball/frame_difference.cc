#include "metaball/frame_difference.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>
#include <vector>

#include "metaball/error.h"

namespace sherd {
namespace {

Vec3d LabOf(const Vec3d& c) {
  const double x = 0.4124 * c.x + 0.3576 * c.y + 0.1805 * c.z;
  const double y = 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z;
  const double z = 0.0193 * c.x + 0.1192 * c.y + 0.9505 * c.z;
  const auto f = [](double t) {
    constexpr double kKnee = 6.0 / 29;
    return t > kKnee * kKnee * kKnee ? std::cbrt(t) : t / (3 * kKnee * kKnee) + 4.0 / 29;
  };
  const double fx = f(x / (0.4124 + 0.3576 + 0.1805));
  const double fy = f(y / (0.2126 + 0.7152 + 0.0722));
  const double fz = f(z / (0.0193 + 0.1192 + 0.9505));
  return {116 * fy - 16, 500 * (fx - fy), 200 * (fy - fz)};
}

// Sorts the values; leaves the figures alone where there are none.
void Summarise(std::vector<double>* values, double* median, double* p99, double* max) {
  if (values->empty()) return;
  std::sort(values->begin(), values->end());
  *median = (*values)[values->size() / 2];
  *p99 = (*values)[values->size() * 99 / 100];
  *max = values->back();
}

}  // namespace

double DeltaE76(const Vec3d& linear_a, const Vec3d& linear_b) {
  return Length(LabOf(linear_a) - LabOf(linear_b));
}

double FrameDifference::WrongShare() const {
  if (pixels == grazing) return 0;
  return static_cast<double>(missed + invented + color_off) / static_cast<double>(pixels - grazing);
}

std::string FrameDifference::Describe() const {
  std::ostringstream text;
  text << pixels << " pixels: missed " << missed << ", invented " << invented << ", colour off "
       << color_off << " (max " << color_max << "), depth error in radii median " << depth_median
       << ", p99 " << depth_p99 << ", max " << depth_max << ", normal max " << normal_max_deg
       << " deg, grazing " << grazing;
  return text.str();
}

FrameDifference CompareToReference(const Frame& frame, const ReferenceFrame& reference,
                                   double unit) {
  if (frame.width != reference.width || frame.height != reference.height) {
    throw Error("frames of different sizes cannot be compared");
  }
  FrameDifference d;
  d.pixels = reference.pixels.size();
  std::vector<double> depths, angles, colors;
  for (std::size_t i = 0; i < reference.pixels.size(); ++i) {
    const ReferenceHit& r = reference.pixels[i];
    if (r.grazing) {
      ++d.grazing;
      continue;
    }
    const Pixel& p = frame.color[i];
    const bool hit = p.a > 0.5f;
    if (hit != r.hit) {
      ++(r.hit ? d.missed : d.invented);
      continue;
    }
    if (!hit) continue;
    const double off =
        std::max({std::abs(p.r - r.color.x), std::abs(p.g - r.color.y), std::abs(p.b - r.color.z)});
    d.color_max = std::max(d.color_max, off);
    if (off > 8.0 / 255) ++d.color_off;
    colors.push_back(DeltaE76({p.r, p.g, p.b}, r.color));
    if (!frame.depth.empty()) {
      const float depth = frame.depth[i];
      const double rounding = 0.5 * (std::nextafter(depth, INFINITY) - depth);
      const double off_by = std::max(0.0, std::abs(depth - r.depth * unit) - rounding);
      depths.push_back(off_by / unit / r.smallest_radius);
    }
    if (!frame.normal.empty()) {
      const double cosine = Dot(frame.normal[i].cast<double>(), r.normal);
      const double sine = Length(Cross(frame.normal[i].cast<double>(), r.normal));
      angles.push_back(std::atan2(sine, cosine) * 180 / std::numbers::pi);
    }
  }
  Summarise(&depths, &d.depth_median, &d.depth_p99, &d.depth_max);
  Summarise(&angles, &d.normal_median_deg, &d.normal_p99_deg, &d.normal_max_deg);
  Summarise(&colors, &d.delta_e_median, &d.delta_e_p99, &d.delta_e_max);
  return d;
}

}  // namespace sherd
