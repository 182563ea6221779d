#include "datasets_synthetic/shots.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "datasets_synthetic/random.h"

namespace sherd::synthetic {
namespace {

constexpr double kPi = std::numbers::pi;

// The quaternion of the rotation whose rows are the camera's axes (Shepperd 1978).
std::array<double, 4> QuaternionOf(const Vec3d& r0, const Vec3d& r1, const Vec3d& r2) {
  const double m[3][3] = {{r0.x, r0.y, r0.z}, {r1.x, r1.y, r1.z}, {r2.x, r2.y, r2.z}};
  const double trace = m[0][0] + m[1][1] + m[2][2];
  double w, x, y, z;
  if (trace >= std::max({m[0][0], m[1][1], m[2][2]})) {
    w = 1 + trace;
    x = m[2][1] - m[1][2];
    y = m[0][2] - m[2][0];
    z = m[1][0] - m[0][1];
  } else if (m[0][0] >= m[1][1] && m[0][0] >= m[2][2]) {
    w = m[2][1] - m[1][2];
    x = 1 + m[0][0] - m[1][1] - m[2][2];
    y = m[1][0] + m[0][1];
    z = m[2][0] + m[0][2];
  } else if (m[1][1] >= m[2][2]) {
    w = m[0][2] - m[2][0];
    x = m[1][0] + m[0][1];
    y = 1 + m[1][1] - m[0][0] - m[2][2];
    z = m[2][1] + m[1][2];
  } else {
    w = m[1][0] - m[0][1];
    x = m[2][0] + m[0][2];
    y = m[2][1] + m[1][2];
    z = 1 + m[2][2] - m[0][0] - m[1][1];
  }
  const double scale = (w < 0 ? -1 : 1) / std::sqrt(w * w + x * x + y * y + z * z);
  return {w * scale, x * scale, y * scale, z * scale};
}

// Sets the pose; `up` is the picture's upward direction, `roll` turns the camera about its axis.
void Aim(Shot* shot, const Vec3d& eye, const Vec3d& target, const Vec3d& up, double roll) {
  const Camera camera = Camera::LookAt(eye, target, up, 1.0, 1, 1);
  shot->eye = eye;
  shot->forward = camera.forward;
  const double c = std::cos(roll), s = std::sin(roll);
  shot->right = camera.right * c + camera.down * s;
  shot->down = camera.down * c - camera.right * s;
  const auto q = QuaternionOf(shot->right, shot->down, shot->forward);
  std::copy(q.begin(), q.end(), shot->q);
  shot->t = {-Dot(shot->right, eye), -Dot(shot->down, eye), -Dot(shot->forward, eye)};
}

Lens MakeLens(const ExcavationOptions& o, std::uint32_t camera_id, double focal_35mm,
              double strength) {
  Lens lens;
  lens.camera_id = camera_id;
  lens.width = o.photo_width;
  lens.height = o.photo_height;
  const double side = std::max(o.photo_width, o.photo_height);
  lens.fx = focal_35mm / 36.0 * side;
  lens.fy = lens.fx * 1.0004;
  // The principal point is a few thousandths of the picture off its middle.
  lens.cx = 0.5 * o.photo_width + 0.0031 * side;
  lens.cy = 0.5 * o.photo_height - 0.0023 * side;
  if (o.lens_distortion) {
    lens.k1 = -0.105 * strength;
    lens.k2 = 0.048 * strength;
    lens.p1 = 0.00060 * strength;
    lens.p2 = -0.00045 * strength;
  }
  lens.SetMaxRadius();
  return lens;
}

}  // namespace

ShotPlan PlanShots(const ExcavationOptions& options) {
  ShotPlan plan;
  const double ring_focal = 26, overhead_focal = 24;
  plan.lenses = {MakeLens(options, 2, ring_focal, 1.0), MakeLens(options, 5, overhead_focal, 0.8)};
  Rng rng(HashOf(options.seed, 90));
  const int overhead = std::max(1, static_cast<int>(std::lround(options.photographs * 0.3)));
  const int ring = options.photographs - overhead;
  const auto name = [](const char* stem, int i) {
    char text[32];
    std::snprintf(text, sizeof(text), "%s_%02d.jpg", stem, i + 1);
    return std::string(text);
  };
  for (int i = 0; i < overhead; ++i) {
    Shot shot;
    shot.name = name("overhead", i);
    shot.lens_idx = 1;
    shot.focal_35mm = overhead_focal;
    const double reach = std::min(1.75, 0.30 * (overhead - 1));
    const double x = overhead == 1 ? 0 : reach * (2.0 * i / (overhead - 1) - 1);
    const double y = (i % 2 == 0 ? 0.22 : -0.22) + 0.05 * rng.Gaussian();
    const double height = 2.35 + 0.06 * rng.Gaussian();
    const Vec3d target{x + 0.10 * rng.Gaussian(), y + 0.10 * rng.Gaussian(), -0.9};
    Aim(&shot, {x, y, height}, target, {0, 1, 0}, 0.03 * rng.Gaussian());
    plan.shots.push_back(shot);
  }
  const double step = std::min(2 * kPi / std::max(1, ring), kPi / 8);
  for (int i = 0; i < ring; ++i) {
    Shot shot;
    shot.name = name("ring", i);
    shot.lens_idx = 0;
    shot.focal_35mm = ring_focal;
    const double angle = -0.5 * kPi + (i - 0.5 * (ring - 1)) * step + 0.03 * rng.Gaussian();
    const double height = (i % 2 == 0 ? 1.55 : 2.25) + 0.06 * rng.Gaussian();
    const Vec3d eye{3.35 * std::cos(angle), 2.85 * std::sin(angle), height};
    const Vec3d target{0.30 * std::cos(angle) + 0.10 * rng.Gaussian(),
                       0.20 * std::sin(angle) + 0.10 * rng.Gaussian(), -0.75};
    Aim(&shot, eye, target, {0, 0, 1}, 0.015 * rng.Gaussian());
    plan.shots.push_back(shot);
  }
  // Ids as a project has them that has lost photographs and gained others: with gaps, in an order
  // of their own.
  std::vector<std::uint32_t> ids;
  std::uint32_t id = 2;
  for (std::size_t i = 0; i < plan.shots.size(); ++i) {
    ids.push_back(id);
    id += 1 + static_cast<std::uint32_t>(rng.Index(4));
  }
  for (std::size_t i = ids.size(); i > 1; --i) {
    std::swap(ids[i - 1], ids[static_cast<std::size_t>(rng.Index(static_cast<int>(i)))]);
  }
  for (std::size_t i = 0; i < plan.shots.size(); ++i) {
    plan.shots[i].image_id = ids[i];
    plan.shots[i].exposure = static_cast<float>(std::exp2(options.exposure_stops * rng.Gaussian()));
  }
  return plan;
}

}  // namespace sherd::synthetic
