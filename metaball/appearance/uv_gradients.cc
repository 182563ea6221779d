#include "metaball/appearance/uv_gradients.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "metaball/appearance/gather.h"
#include "metaball/appearance/neighbors.h"
#include "metaball/error.h"
#include "metaball/parallel.h"

namespace sherd {
namespace {

constexpr int kNeighbors = 13;        // the metaball itself among them
constexpr std::int64_t kBlock = 512;  // metaballs one task handles

// A neighbour's offset in space and in the image.
struct Difference {
  Vec3d offset;
  double u, v;
};

// Solves the symmetric, positive definite system a x = b in place of b (Cholesky).
void Solve(const std::array<double, 6>& a, Vec3d* b) {
  const double l00 = std::sqrt(a[0]);
  const double l10 = a[1] / l00, l20 = a[2] / l00;
  const double l11 = std::sqrt(a[3] - l10 * l10);
  const double l21 = (a[4] - l20 * l10) / l11;
  const double l22 = std::sqrt(a[5] - l20 * l20 - l21 * l21);
  const double y0 = b->x / l00;
  const double y1 = (b->y - l10 * y0) / l11;
  const double y2 = (b->z - l20 * y0 - l21 * y1) / l22;
  b->z = y2 / l22;
  b->y = (y1 - l21 * b->z) / l11;
  b->x = (y0 - l10 * b->y - l20 * b->z) / l00;
}

// The gradients that fit the differences best. Across a flat neighbourhood nothing is known; the
// small term on the diagonal makes the gradient zero that way.
void FitGradients(const std::vector<Difference>& differences, Vec3d* du, Vec3d* dv) {
  std::array<double, 6> a{};
  *du = {};
  *dv = {};
  for (const Difference& d : differences) {
    const Vec3d& o = d.offset;
    a[0] += o.x * o.x;
    a[1] += o.x * o.y;
    a[2] += o.x * o.z;
    a[3] += o.y * o.y;
    a[4] += o.y * o.z;
    a[5] += o.z * o.z;
    *du += o * d.u;
    *dv += o * d.v;
  }
  const double trace = a[0] + a[3] + a[5];
  if (!(trace > 0)) {
    *du = {};
    *dv = {};
    return;
  }
  const double ridge = 1e-7 * trace;
  a[0] += ridge;
  a[3] += ridge;
  a[5] += ridge;
  Solve(a, du);
  Solve(a, dv);
}

// Leaves out what lies across a seam: differences per length far above the median's.
void DropOtherCharts(std::vector<Difference>* differences) {
  constexpr double kLimit = 8;
  std::vector<double> slopes;
  const auto slope = [](const Difference& d) { return std::hypot(d.u, d.v) / Length(d.offset); };
  for (const Difference& d : *differences) {
    if (slope(d) > 0) slopes.push_back(slope(d));
  }
  if (slopes.size() < 3) return;
  // A metaball on a seam may have half of its neighbours in the other chart, and these may be the
  // larger half: the measure is the lower third.
  const auto third = slopes.begin() + static_cast<std::ptrdiff_t>(slopes.size() / 3);
  std::nth_element(slopes.begin(), third, slopes.end());
  const double limit = kLimit * *third;
  std::erase_if(*differences, [&](const Difference& d) { return slope(d) > limit; });
}

// The channel of that name and shape, made where there is none.
Channel* ChannelToFill(Cloud* cloud, const std::string& name, int components) {
  Channel fresh(name, ChannelType::kFloat32, components, cloud->size());
  for (Channel& channel : cloud->channels) {
    if (channel.name() != name) continue;
    channel = std::move(fresh);
    return &channel;
  }
  cloud->channels.push_back(std::move(fresh));
  return &cloud->channels.back();
}

template <class Body>  // body(i, neighbours of i, the metaball itself first)
void ForEachNeighborhood(const Cloud& cloud, int k, int threads, const Control& control,
                         const Body& body) {
  const NeighborIndex index(cloud.center);
  const auto n = static_cast<std::int64_t>(cloud.size());
  ParallelFor((n + kBlock - 1) / kBlock, threads, [&](std::int64_t block, int) {
    control.ThrowIfStopped();
    std::vector<NeighborIndex::Neighbor> found;
    for (std::int64_t i = block * kBlock; i < std::min(n, (block + 1) * kBlock); ++i) {
      const auto idx = static_cast<std::size_t>(i);
      index.Nearest(cloud.center[idx], k, &found);
      body(idx, found);
    }
  });
}

}  // namespace

std::string UvGradientName(const std::string& uv_channel, int axis) {
  return uv_channel + (axis == 0 ? ".du" : ".dv");
}

void AddUvGradients(Cloud* cloud, const std::string& uv_channel, bool periodic, int threads,
                    const Control& control) {
  if (ChannelNamed(*cloud, uv_channel).components() != 2) {
    throw Error("channel '" + uv_channel +
                "' cannot hold texture coordinates: it has not 2 "
                "components");
  }
  ChannelToFill(cloud, UvGradientName(uv_channel, 0), 3);
  Channel* dv = ChannelToFill(cloud, UvGradientName(uv_channel, 1), 3);
  // Looked up again: adding a channel may have moved the first one.
  Channel* du = nullptr;
  for (Channel& channel : cloud->channels) {
    if (channel.name() == UvGradientName(uv_channel, 0)) du = &channel;
  }
  const Channel& uv = ChannelNamed(*cloud, uv_channel);
  ForEachNeighborhood(*cloud, kNeighbors, threads, control,
                      [&](std::size_t i, const std::vector<NeighborIndex::Neighbor>& neighbors) {
                        std::vector<Difference> differences;
                        const ChannelValue own = uv.Get(i);
                        for (const NeighborIndex::Neighbor& neighbor : neighbors) {
                          if (!(neighbor.distance2 > 0.0f)) continue;
                          const ChannelValue other = uv.Get(neighbor.idx);
                          Difference d;
                          d.offset =
                              (cloud->center[neighbor.idx] - cloud->center[i]).cast<double>() *
                              cloud->frame.unit;
                          d.u = static_cast<double>(other.v[0]) - own.v[0];
                          d.v = static_cast<double>(other.v[1]) - own.v[1];
                          if (periodic) {
                            d.u -= std::round(d.u);
                            d.v -= std::round(d.v);
                          }
                          differences.push_back(d);
                        }
                        DropOtherCharts(&differences);
                        Vec3d gradient_u, gradient_v;
                        FitGradients(differences, &gradient_u, &gradient_v);
                        const auto value = [](const Vec3d& g) {
                          return ChannelValue{{static_cast<float>(g.x), static_cast<float>(g.y),
                                               static_cast<float>(g.z), 0.0f}};
                        };
                        du->Set(i, value(gradient_u));
                        dv->Set(i, value(gradient_v));
                      });
}

void AddSpacingChannel(Cloud* cloud, const std::string& name, int threads, const Control& control) {
  Channel* channel = ChannelToFill(cloud, name, 1);
  ForEachNeighborhood(*cloud, 7, threads, control,
                      [&](std::size_t i, const std::vector<NeighborIndex::Neighbor>& neighbors) {
                        double sum = 0;
                        for (const NeighborIndex::Neighbor& neighbor : neighbors) {
                          sum += std::sqrt(static_cast<double>(neighbor.distance2));
                        }
                        const double count = static_cast<double>(neighbors.size()) - 1;
                        const double mean = count > 0 ? sum / count * cloud->frame.unit : 0.0;
                        channel->Set(i, {{static_cast<float>(mean)}});
                      });
}

}  // namespace sherd
