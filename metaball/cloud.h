// A cloud of metaballs: structure of arrays, only the channels that exist.
//
// Positions are kept as floats in a local frame, point_in_world = origin + unit * point_in_local,
// so that a survey in UTM coordinates renders exactly as the same survey at the origin.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "metaball/channel.h"
#include "metaball/color.h"
#include "metaball/hostdevice.h"
#include "metaball/vec.h"

namespace sherd {

// The similarity between a cloud's float coordinates and the world's double coordinates.
struct LocalFrame {
  Vec3d origin{};     // the world point that is local (0, 0, 0)
  double unit = 1.0;  // world length of one local unit; a power of two, > 0

  SHERD_HD Vec3d WorldFromLocal(const Vec3f& p) const { return origin + unit * p.cast<double>(); }
  SHERD_HD Vec3d LocalFromWorld(const Vec3d& p) const { return (p - origin) / unit; }

  // The frame whose box [-1, 1]^3 holds the box [min, max]: centred, unit the next power of two.
  // A degenerate box (one point) gets unit 1.
  static LocalFrame ForBox(const Vec3d& min, const Vec3d& max);
};

struct Box3f {
  Vec3f min{}, max{};
};

// Counts the changes of each part of a cloud that moves (moving.h); all 0 in one that does not.
struct CloudRevisions {
  std::uint64_t frame = 0;  // LocalFrame; positions and radii count up with it
  std::uint64_t positions = 0;
  std::uint64_t radii = 0;
  std::uint64_t thresholds = 0;
  std::uint64_t colors = 0;
  std::uint64_t channels = 0;  // any of them
  friend bool operator==(const CloudRevisions&, const CloudRevisions&) = default;
};

struct Cloud {
  LocalFrame frame;
  std::vector<Vec3f> center;    // n, local units, all finite
  std::vector<float> radius;    // n, local units, all finite and > 0; or empty: uniform_radius
  float uniform_radius = 0.0f;  // local units; > 0 where `radius` is empty and n > 0
  std::vector<Rgb8> color;      // n, sRGB; or empty: uniform_color
  Rgb8 uniform_color{200, 200, 200};
  std::vector<float> threshold;   // n, all finite and > 0; or empty: the surface's own (thesis 2.9)
  std::vector<Channel> channels;  // further channels of V, n values each, names all different
  CloudRevisions revisions;       // what a copy of this very object elsewhere must bring over

  std::size_t size() const { return center.size(); }
  bool empty() const { return center.empty(); }
  float RadiusOf(std::size_t i) const { return radius.empty() ? uniform_radius : radius[i]; }
  Rgb8 ColorOf(std::size_t i) const { return color.empty() ? uniform_color : color[i]; }
  // The channel of that name, or null.
  const Channel* FindChannel(std::string_view name) const;

  // Bytes held by the channels (the capacity of the vectors).
  std::size_t MemoryBytes() const;
  // The box of the centres; a box of zeros for an empty cloud. O(n).
  Box3f CenterBox() const;
  // Throws InputError naming `source` and the first metaball that breaks the rules above.
  void Validate(const std::string& source) const;
};

// What BuildCloud takes: world coordinates, any of the optional channels empty.
struct CloudInput {
  std::vector<Vec3d> center;
  std::vector<double> radius;  // n, or empty with uniform_radius > 0
  double uniform_radius = 0.0;
  std::vector<Rgb8> color;        // n or empty
  std::vector<double> threshold;  // n or empty
  std::vector<Channel> channels;  // n values each
};

// What BuildCloud dropped.
struct CloudReport {
  std::size_t dropped_not_finite = 0;  // NaN or infinite centre or radius
  std::size_t dropped_radius = 0;      // radius zero or negative
  std::size_t dropped_threshold = 0;   // threshold not finite and positive
};

// Makes a cloud in a frame of its own, the metaballs in Morton order (neighbours in space are
// neighbours in memory). Metaballs that cannot be drawn (see CloudReport) are dropped and counted.
// order, if given, receives for every kept metaball the index it had in `input`.
Cloud BuildCloud(const CloudInput& input, CloudReport* report = nullptr,
                 std::vector<std::uint32_t>* order = nullptr);

}  // namespace sherd
