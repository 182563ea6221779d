#include "datasets_synthetic/peer_scenes.h"

#include <cmath>
#include <numbers>
#include <utility>

namespace sherd {
namespace {

using std::numbers::pi;

// SplitMix64: the same numbers on every machine and standard library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  // Uniform in [-1, 1).
  double Signed() {
    state_ += 0x9e3779b97f4a7c15ull;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    z ^= z >> 31;
    return static_cast<double>(z >> 11) * 0x1p-52 - 1.0;
  }

 private:
  std::uint64_t state_;
};

float Wave(double phase) { return static_cast<float>(0.5 + 0.5 * std::sin(phase)); }

PeerScene Finish(CloudInput input, double spacing, const Vec3d& eye, const Vec3d& look_at,
                 double fov_deg, int width, int height) {
  input.uniform_radius = 2.5 * spacing;
  PeerScene peer;
  peer.scene.cloud = std::make_shared<Cloud>(BuildCloud(input));
  peer.scene.lighting.ambient = 0.2;
  peer.scene.lighting.diffuse = 0.8;
  peer.scene.lighting.headlight = false;
  peer.scene.lighting.to_light = {-0.5, 1, -0.6};
  peer.camera = Camera::LookAt(eye, look_at, {0, 1, 0}, fov_deg * pi / 180, width, height);
  // The scenes are defined for a left-handed camera, whose x axis is up x view.
  peer.camera.right = -peer.camera.right;
  return peer;
}

}  // namespace

PeerScene MakeHeightField(std::uint64_t count, int width, int height, std::uint32_t seed) {
  Random random(seed);
  const auto n = static_cast<std::uint64_t>(std::lround(std::sqrt(static_cast<double>(count))));
  const double s = 1.0 / static_cast<double>(n);
  CloudInput input;
  input.center.reserve(n * n);
  input.color.reserve(n * n);
  for (std::uint64_t j = 0; j < n; ++j) {
    for (std::uint64_t i = 0; i < n; ++i) {
      const double x = (static_cast<double>(i) + 0.5) * s + 0.25 * s * random.Signed();
      const double z = (static_cast<double>(j) + 0.5) * s + 0.25 * s * random.Signed();
      const double y = 0.06 * std::sin(3 * pi * x) * std::cos(3 * pi * z) +
                       0.02 * std::sin(10 * pi * x + 1) * std::sin(8 * pi * z) +
                       0.25 * s * random.Signed();
      input.center.push_back({x, y, z});
      input.color.push_back(
          Rgb8FromLinear({Wave(14 * pi * x), Wave(14 * pi * z + 2), Wave(22 * pi * (x + z) + 4)}));
    }
  }
  return Finish(std::move(input), s, {0.5, 0.80, -0.42}, {0.5, -0.02, 0.47}, 55, width, height);
}

PeerScene MakeShell(std::uint64_t count, int width, int height, std::uint32_t seed) {
  Random random(seed);
  const double s = std::sqrt(pi / static_cast<double>(count));
  const double golden = pi * (3 - std::sqrt(5.0));
  CloudInput input;
  input.center.reserve(count);
  input.color.reserve(count);
  for (std::uint64_t i = 0; i < count; ++i) {
    const double y = 1 - 2 * (static_cast<double>(i) + 0.5) / static_cast<double>(count);
    const double ring = std::sqrt(1 - y * y);
    const double angle = golden * static_cast<double>(i);
    const Vec3d d{ring * std::cos(angle), y, ring * std::sin(angle)};
    input.center.push_back(d * (0.5 + 0.25 * s * random.Signed()));
    input.color.push_back(
        Rgb8FromLinear({Wave(2 * pi * (3 * d.x + 0.1)), Wave(2 * pi * (3 * d.y + 0.3)),
                        Wave(2 * pi * (4 * d.z + 0.6))}));
  }
  return Finish(std::move(input), s, {0.35, 0.45, -1.15}, {0, 0, 0}, 52, width, height);
}

void SpreadThresholds(double threshold, double spread, Cloud* cloud) {
  Random random(cloud->size());
  cloud->threshold.clear();
  cloud->threshold.reserve(cloud->size());
  for (std::size_t i = 0; i < cloud->size(); ++i) {
    cloud->threshold.push_back(static_cast<float>(threshold * (1 + spread * random.Signed())));
  }
}

}  // namespace sherd
