// Stones: the dry-stone wall, what has fallen from it, and those in the sections and on the floor.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "datasets_synthetic/builder.h"
#include "datasets_synthetic/noise.h"
#include "datasets_synthetic/random.h"

namespace sherd::synthetic {
namespace {

constexpr double kPi = std::numbers::pi;

// Limestone and sandstone: grey, buff, and now and then reddish.
Vec3f StoneColor(Rng* rng) {
  const double kind = rng->Uniform();
  const double tone = rng->Uniform(0.8, 1.2);
  Vec3d c = kind < 0.5    ? Vec3d{0.33, 0.30, 0.25}
            : kind < 0.85 ? Vec3d{0.38, 0.31, 0.21}
                          : Vec3d{0.30, 0.21, 0.15};
  c = c * tone;
  return c.cast<float>();
}

// A convex body as a gauge: the p-norm of the distances to its faces, which rounds its edges.
class StoneShape {
 public:
  StoneShape(Rng* rng, bool rounded) : power_(rounded ? 5.0 : 13.0) {
    // The six sides, a little askew, and some chipped corners.
    for (int axis = 0; axis < 3; ++axis) {
      for (const double sign : {-1.0, 1.0}) {
        Vec3d n{0.10 * rng->Gaussian(), 0.10 * rng->Gaussian(), 0.10 * rng->Gaussian()};
        (axis == 0 ? n.x : axis == 1 ? n.y : n.z) += sign;
        Add(Normalized(n), rng->Uniform(0.92, 1.02));
      }
    }
    const int chips = 5 + rng->Index(5);
    for (int i = 0; i < chips; ++i) {
      const Vec3d n = Normalized(Vec3d{rng->Gaussian(), rng->Gaussian(), rng->Gaussian()});
      Add(n, rng->Uniform(1.02, 1.30));
    }
  }

  // Radius in the direction d (unit), of a body that about fills the cube [-1, 1]^3.
  double Radius(const Vec3d& d) const {
    double sum = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      const double v = Dot(d, faces_[i].normal) / faces_[i].distance;
      if (v > 0) sum += std::pow(v, power_);
    }
    return std::pow(sum, -1.0 / power_);
  }

 private:
  struct Face {
    Vec3d normal;
    double distance;
  };
  void Add(const Vec3d& normal, double distance) { faces_[count_++] = {normal, distance}; }

  double power_;
  std::array<Face, 16> faces_{};
  std::size_t count_ = 0;
};

}  // namespace

void SceneBuilder::AddStone(const Stone& stone) {
  Rng rng(stone.seed);
  const Frame3& frame = stone.frame;
  const Vec3d half = stone.half;
  const int n = stone.detail;
  const bool rounded = n < 8;
  const StoneShape shape(&rng, rounded);
  const auto noise_seed = static_cast<std::uint32_t>(rng.Next());
  const std::size_t part =
      AddPart({Material::kStone, kStone, frame, half, stone.color, noise_seed});
  // A cube's sides blown up to a sphere; edges are shared through a table of the cube's lattice.
  const auto side = static_cast<std::size_t>(n + 1);
  std::vector<std::int64_t> vertex_at(side * side * side, -1);
  const auto vertex = [&](int i, int j, int k) {
    std::int64_t& slot =
        vertex_at[(static_cast<std::size_t>(k) * side + static_cast<std::size_t>(j)) * side +
                  static_cast<std::size_t>(i)];
    if (slot < 0) {
      const auto warp = [n](int v) { return std::tan((2.0 * v / n - 1.0) * 0.25 * kPi); };
      const Vec3d d = Normalized(Vec3d{warp(i), warp(j), warp(k)});
      double r = shape.Radius(d);
      r *= 1.0 + 0.055 * static_cast<double>(Fbm(d, 0.9, 3, 0.55f, 0, noise_seed).value);
      const Vec3d local{half.x * r * d.x, half.y * r * d.y, half.z * r * d.z};
      slot = mesh_->AddVertex(frame.ToWorld(local));
    }
    return static_cast<std::uint32_t>(slot);
  };
  const auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    mesh_->AddTriangle(a, b, c, part);
    mesh_->AddTriangle(a, c, d, part);
  };
  for (int u = 0; u < n; ++u) {
    for (int v = 0; v < n; ++v) {
      quad(vertex(u, v, n), vertex(u + 1, v, n), vertex(u + 1, v + 1, n), vertex(u, v + 1, n));
      quad(vertex(u, v, 0), vertex(u, v + 1, 0), vertex(u + 1, v + 1, 0), vertex(u + 1, v, 0));
      quad(vertex(n, u, v), vertex(n, u + 1, v), vertex(n, u + 1, v + 1), vertex(n, u, v + 1));
      quad(vertex(0, u, v), vertex(0, u, v + 1), vertex(0, u + 1, v + 1), vertex(0, u + 1, v));
      quad(vertex(u, n, v), vertex(u, n, v + 1), vertex(u + 1, n, v + 1), vertex(u + 1, n, v));
      quad(vertex(u, 0, v), vertex(u + 1, 0, v), vertex(u + 1, 0, v + 1), vertex(u, 0, v + 1));
    }
  }
}

void SceneBuilder::AddStoneWall() {
  // From the north section southwards, a little askew; ruined towards its southern end.
  const Vec3d north{0.64, 1.62, 0}, south{0.36, -0.74, 0};
  const Vec3d axis = Normalized(south - north);
  const Vec3d across{-axis.y, axis.x, 0};
  const double length = Length(south - north), width = 0.48;
  const double yaw = std::atan2(axis.y, axis.x);
  Rng rng(HashOf(seed_, 40));
  const std::size_t first_triangle = mesh_->triangles.size();
  double rise = -0.03;  // the lowest course stands in its footing
  for (int course = 0; course < 4; ++course) {
    const double height = rng.Uniform(0.115, 0.155);
    const double end = length - (course == 0 ? 0.0 : course == 1 ? 0.22 : course == 2 ? 0.85 : 1.5);
    // Both faces of the wall advance on their own; a through-stone ties them.
    double at[2] = {course % 2 * 0.08, course % 2 * 0.08};
    while (std::min(at[0], at[1]) < end) {
      const bool level = std::abs(at[0] - at[1]) < 0.06;
      const bool through = level && rng.Uniform() < 0.22;
      const int face = through ? 0 : at[0] <= at[1] ? 0 : 1;
      const double stone_length = through ? rng.Uniform(0.16, 0.24) : rng.Uniform(0.17, 0.36);
      const double stone_width = through ? width : width * rng.Uniform(0.44, 0.50);
      const double start = through ? std::max(at[0], at[1]) : at[face];
      const double middle = start + 0.5 * stone_length;
      if (start < end && !(course > 0 && start > end - 0.3 && rng.Uniform() < 0.3)) {
        const double side =
            through ? 0.0 : (face == 0 ? 1 : -1) * (0.5 * width - 0.5 * stone_width);
        Vec3d p = north + axis * middle + across * (side + rng.Uniform(-0.012, 0.012));
        const double stone_height = height * rng.Uniform(0.90, 1.0);
        p.z = terrain_.FloorHeight(p.x, p.y) + rise + 0.5 * stone_height;
        const Frame3 frame = MakeFrame(
            p, {yaw + 0.05 * rng.Gaussian(), 0.03 * rng.Gaussian(), rng.Uniform(0, 2 * kPi)});
        const double joint = rng.Uniform(0.008, 0.020);
        AddStone({frame,
                  {0.5 * stone_length - 0.5 * joint, 0.5 * stone_width, 0.52 * stone_height},
                  StoneColor(&rng),
                  12,
                  rng.Next()});
      }
      if (through) {
        at[0] = at[1] = start + stone_length;
      } else {
        at[face] += stone_length;
      }
    }
    rise += height;
  }
  DropBuried(first_triangle);
}

void SceneBuilder::AddLooseStones() {
  Rng rng(HashOf(seed_, 41));
  const std::size_t first_triangle = mesh_->triangles.size();
  const auto lay = [&](double x, double y, const Vec3d& half, double sunk, int detail) {
    const double z = terrain_.FloorHeight(x, y) + half.z * (1 - 2 * sunk);
    const Frame3 frame = MakeFrame(
        {x, y, z}, {rng.Uniform(0, 2 * kPi), 0.25 * rng.Gaussian(), rng.Uniform(0, 2 * kPi)});
    AddStone({frame, half, StoneColor(&rng), detail, rng.Next()});
  };
  // Tumble on both sides of the wall, thinning out with the distance.
  for (int i = 0; i < 22; ++i) {
    const double along = rng.Uniform(-0.6, 1.3);
    const double away = 0.33 + 0.40 * rng.UniformSquared();
    const double side = rng.Uniform() < 0.6 ? 1 : -1;
    const double x = 0.5 + 0.12 * along + side * away, y = along;
    const double size = rng.Uniform(0.04, 0.11);
    if (x > 0.84 && y < -0.42) continue;  // not on the edge of the sounding
    // The scale bar lies in front of the wall.
    if (side < 0 && y > -0.55 && y < 0.3) continue;
    const Vec3d half{size, size * rng.Uniform(0.6, 0.95), size * rng.Uniform(0.45, 0.7)};
    lay(x, y, half, rng.Uniform(0.1, 0.3), 11);
  }
  // The hearth's ring.
  const int ring = 9;
  for (int i = 0; i < ring; ++i) {
    if (i == 2) continue;  // its mouth
    const double angle = 2 * kPi * i / ring + 0.1 * rng.Gaussian();
    const double r = Hearth::radius * rng.Uniform(0.96, 1.08);
    const double size = rng.Uniform(0.055, 0.085);
    lay(Hearth::x + r * std::cos(angle), Hearth::y + r * std::sin(angle),
        {size, size * 0.8, size * 0.6}, 0.3, 10);
  }
  // Pebbles on the floor.
  for (int i = 0; i < 110; ++i) {
    const double x = rng.Uniform(-1.85, 1.85), y = rng.Uniform(-1.35, 1.35);
    const double size = 0.010 + 0.026 * rng.UniformSquared();
    const Vec3d half{size, size * rng.Uniform(0.6, 0.9), size * rng.Uniform(0.4, 0.7)};
    lay(x, y, half, rng.Uniform(0.2, 0.45), 5);
  }
  // Stones that show in the sections, most of them in the rubble layer.
  for (int i = 0; i < 64; ++i) {
    const double s = rng.Uniform(0, Terrain::OutlineLength());
    const bool rubble = rng.Uniform() < 0.65;
    const double z = rubble ? rng.Uniform(-0.68, -0.50) : rng.Uniform(-1.15, -0.12);
    const double size = 0.016 + (rubble ? 0.055 : 0.030) * rng.UniformSquared();
    Vec3d inward;
    Vec3d p = terrain_.SectionPoint(s, z, &inward);
    p += inward * (size * rng.Uniform(-0.35, 0.15));
    if (p.z < terrain_.FloorHeight(p.x, p.y)) continue;
    const Frame3 frame = MakeFrame(p, {std::atan2(inward.y, inward.x) + 0.2 * rng.Gaussian(),
                                       0.2 * rng.Gaussian(), rng.Uniform(0, 2 * kPi)});
    AddStone({frame,
              {size * 0.8, size * rng.Uniform(0.9, 1.3), size * rng.Uniform(0.6, 0.8)},
              StoneColor(&rng),
              size > 0.035 ? 9 : 6,
              rng.Next()});
  }
  DropBuried(first_triangle);
}

}  // namespace sherd::synthetic
