#include "metaball/frame_difference.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>
#include <vector>

#include "metaball/error.h"

namespace sherd {

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
  std::vector<double> depth_errors;
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
    if (!frame.depth.empty()) {
      const float depth = frame.depth[i];
      const double rounding = 0.5 * (std::nextafter(depth, INFINITY) - depth);
      const double off_by = std::max(0.0, std::abs(depth - r.depth * unit) - rounding);
      depth_errors.push_back(off_by / unit / r.smallest_radius);
    }
    if (!frame.normal.empty()) {
      const double cosine = Dot(frame.normal[i].cast<double>(), r.normal);
      const double sine = Length(Cross(frame.normal[i].cast<double>(), r.normal));
      d.normal_max_deg =
          std::max(d.normal_max_deg, std::atan2(sine, cosine) * 180 / std::numbers::pi);
    }
  }
  if (!depth_errors.empty()) {
    std::sort(depth_errors.begin(), depth_errors.end());
    d.depth_median = depth_errors[depth_errors.size() / 2];
    d.depth_p99 = depth_errors[depth_errors.size() * 99 / 100];
    d.depth_max = depth_errors.back();
  }
  return d;
}

}  // namespace sherd
