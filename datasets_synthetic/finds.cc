// Pottery: sherds strewn over the floor and a broken jar on its side.
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

Vec3f ClayColor(Rng* rng) {
  static constexpr std::array<Vec3f, 5> kClays{{{0.42f, 0.17f, 0.075f},
                                                {0.48f, 0.25f, 0.12f},
                                                {0.36f, 0.13f, 0.06f},
                                                {0.45f, 0.33f, 0.20f},
                                                {0.20f, 0.17f, 0.14f}}};
  const Vec3f clay = kClays[static_cast<std::size_t>(rng->Index(5))];
  return clay * static_cast<float>(rng->Uniform(0.85, 1.15));
}

// The outline of a sherd: a convex polygon with uneven edges, as a radius for each angle.
class SherdOutline {
 public:
  SherdOutline(Rng* rng, double size) : noise_seed_(static_cast<std::uint32_t>(rng->Next())) {
    count_ = static_cast<std::size_t>(4 + rng->Index(3));
    const double start = rng->Uniform(0, 2 * kPi);
    for (std::size_t i = 0; i < count_; ++i) {
      angle_[i] = start + 2 * kPi * (static_cast<double>(i) + rng->Uniform(-0.25, 0.25)) /
                              static_cast<double>(count_);
      distance_[i] = size * rng->Uniform(0.65, 1.0);
    }
  }
  double Radius(double angle) const {
    double r = 1e9;
    for (std::size_t i = 0; i < count_; ++i) {
      const double c = std::cos(angle - angle_[i]);
      if (c > 0.2) r = std::min(r, distance_[i] / c);
    }
    const Vec3d p{std::cos(angle) * 2, std::sin(angle) * 2, 0};
    return r * (1 + 0.05 * static_cast<double>(Fbm(p, 1, 3, 0.6f, 0, noise_seed_).value));
  }

 private:
  std::uint32_t noise_seed_;
  std::size_t count_;
  std::array<double, 8> angle_{}, distance_{};
};

}  // namespace

void SceneBuilder::AddSherds() {
  Rng rng(HashOf(seed_, 50));
  const std::size_t first_triangle = mesh_->triangles.size();
  for (int i = 0; i < 58; ++i) {
    // Most of them around the jar; the others anywhere.
    double x, y;
    if (i < 30) {
      const double angle = rng.Uniform(0, 2 * kPi), r = 0.16 + 0.42 * std::sqrt(rng.Uniform());
      x = -0.08 + r * std::cos(angle);
      y = -1.08 + r * std::sin(angle) * 0.7;
    } else {
      x = rng.Uniform(-1.8, 1.8);
      y = rng.Uniform(-1.3, 1.3);
      if (x > 0.05 && x < 1.0 && y > -0.85) continue;  // the wall stands here
    }
    y = std::max(y, -1.38);
    if (x > -0.95 && x < -0.2 && y > -1.02 && y < -0.5) continue;  // the board stands here
    const double size = rng.Uniform(0.022, 0.060), thickness = rng.Uniform(0.005, 0.009);
    const double curve_a = rng.Uniform(0.07, 0.14), curve_b = rng.Uniform(0.10, 0.30);
    const SherdOutline outline(&rng, size);
    const bool face_down = rng.Uniform() < 0.35;
    const double tilt = (face_down ? kPi : 0) + 0.18 * rng.Gaussian();
    const Frame3 frame = MakeFrame({x, y, terrain_.FloorHeight(x, y)},
                                   {rng.Uniform(0, 2 * kPi), tilt, rng.Uniform(0, 2 * kPi)});
    const Vec3f color = ClayColor(&rng);
    const auto part_seed = static_cast<std::uint32_t>(rng.Next());
    const std::size_t part = AddPart({Material::kPottery,
                                      kSherd,
                                      frame,
                                      {size, rng.Uniform() < 0.45 ? 1.0 : 0.0, thickness},
                                      color,
                                      part_seed});
    constexpr std::uint32_t kAround = 40, kRings = 6;
    const std::size_t first_vertex = mesh_->vertices.size();
    const auto surface = [&](double a, double b, double depth) {
      const double z = -0.5 * (a * a / curve_a + b * b / curve_b) - depth;
      return mesh_->AddVertex(frame.ToWorld({a, b, z}));
    };
    for (const bool outer : {true, false}) {
      const double depth = outer ? 0.0 : thickness;
      const std::uint32_t middle = surface(0, 0, depth);
      const std::uint32_t first = middle + 1;
      for (std::uint32_t r = 1; r <= kRings; ++r) {
        for (std::uint32_t k = 0; k < kAround; ++k) {
          const double angle = 2 * kPi * k / kAround;
          const double radius = outline.Radius(angle) * r / kRings;
          surface(radius * std::cos(angle), radius * std::sin(angle), depth);
        }
      }
      for (std::uint32_t k = 0; k < kAround; ++k) {
        const std::uint32_t next = (k + 1) % kAround;
        const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
          if (outer) {
            mesh_->AddTriangle(a, b, c, part);
          } else {
            mesh_->AddTriangle(a, c, b, part);
          }
        };
        triangle(middle, first + k, first + next);
        for (std::uint32_t r = 0; r + 1 < kRings; ++r) {
          const std::uint32_t a = first + r * kAround + k, b = first + r * kAround + next;
          triangle(a, a + kAround, b + kAround);
          triangle(a, b + kAround, b);
        }
      }
    }
    // The broken edge has vertices of its own, so that it is shaded sharply.
    const auto edge = static_cast<std::uint32_t>(mesh_->vertices.size());
    for (const double depth : {thickness, 0.0}) {
      for (std::uint32_t k = 0; k < kAround; ++k) {
        const double angle = 2 * kPi * k / kAround, radius = outline.Radius(angle);
        surface(radius * std::cos(angle), radius * std::sin(angle), depth);
      }
    }
    mesh_->AddGrid(edge, 2, kAround, true, part);
    const double moved = Settle(first_vertex, rng.Uniform(0.2, 0.9) * thickness);
    (*parts_)[part].frame.origin.z += moved;
  }
  DropBuried(first_triangle);
}

void SceneBuilder::AddJar() {
  Rng rng(HashOf(seed_, 51));
  const std::size_t first_triangle = mesh_->triangles.size();
  // Half profile (radius, height), outside from the foot to the rim and inside back to the bottom.
  static constexpr std::array<std::array<double, 2>, 12> kProfile{{{0.000, 0.000},
                                                                   {0.052, 0.000},
                                                                   {0.058, 0.012},
                                                                   {0.090, 0.060},
                                                                   {0.121, 0.125},
                                                                   {0.126, 0.170},
                                                                   {0.108, 0.215},
                                                                   {0.070, 0.250},
                                                                   {0.058, 0.275},
                                                                   {0.062, 0.300},
                                                                   {0.080, 0.318},
                                                                   {0.086, 0.322}}};
  constexpr double kThickness = 0.008;
  const double x = -0.10, y = -1.12;
  const Frame3 frame = MakeFrame({x, y, terrain_.FloorHeight(x, y) + 0.02}, {0.4, 1.35, 2.4});
  const std::size_t part = AddPart({Material::kPottery,
                                    kSherd,
                                    frame,
                                    {0.13, 2.0, kThickness},
                                    Vec3f{0.44f, 0.19f, 0.085f},
                                    static_cast<std::uint32_t>(rng.Next())});
  // Catmull-Rom through the profile.
  std::vector<std::array<double, 2>> outer;
  constexpr int kSteps = 5;
  for (std::size_t i = 1; i + 1 < kProfile.size(); ++i) {
    const auto& p0 = kProfile[i - 1];
    const auto& p1 = kProfile[i];
    const auto& p2 = kProfile[i + 1];
    const auto& p3 = kProfile[std::min(i + 2, kProfile.size() - 1)];
    for (int k = 0; k < kSteps; ++k) {
      const double t = static_cast<double>(k) / kSteps;
      std::array<double, 2> p;
      for (std::size_t c = 0; c < 2; ++c) {
        p[c] = 0.5 * (2 * p1[c] + (p2[c] - p0[c]) * t +
                      (2 * p0[c] - 5 * p1[c] + 4 * p2[c] - p3[c]) * t * t +
                      (3 * p1[c] - p0[c] - 3 * p2[c] + p3[c]) * t * t * t);
      }
      outer.push_back(p);
    }
  }
  outer.push_back(kProfile.back());
  std::vector<std::array<double, 2>> line{{1e-4, 0.0}};
  line.insert(line.end(), outer.begin(), outer.end());
  for (auto p = outer.rbegin(); p != outer.rend(); ++p) {
    line.push_back({std::max((*p)[0] - kThickness, 1e-4), std::max((*p)[1], kThickness)});
  }
  line.push_back({1e-4, kThickness});
  constexpr std::uint32_t kAround = 96;
  const auto first = static_cast<std::uint32_t>(mesh_->vertices.size());
  const std::size_t first_vertex = first;
  for (const auto& p : line) {
    for (std::uint32_t k = 0; k < kAround; ++k) {
      const double angle = 2 * kPi * k / kAround;
      mesh_->AddVertex(frame.ToWorld({p[0] * std::cos(angle), p[0] * std::sin(angle), p[1]}));
    }
  }
  // A piece of the upper side is missing: the sherds around it. Decided cell by cell on the
  // outside; the inside has the same hole.
  const auto rows = static_cast<std::uint32_t>(line.size());
  const auto outer_rows = static_cast<std::uint32_t>(outer.size());
  const Vec3d up = frame.ToLocal(frame.origin + Vec3d{0, 0, 1});
  const auto vertex = [&](std::uint32_t r, std::uint32_t k) {
    return first + r * kAround + k % kAround;
  };
  const auto missing = [&](std::uint32_t r, std::uint32_t k) {
    if (r > outer_rows) r = 2 * outer_rows - r;
    if (r < 1 || r >= outer_rows) return false;
    const Vec3d p = frame.ToLocal(
        (mesh_->vertices[vertex(r, k)] + mesh_->vertices[vertex(r + 1, k + 1)]) * 0.5);
    const double turn =
        std::remainder(std::atan2(p.y, p.x) - std::atan2(up.y, up.x) - 0.35, 2 * kPi);
    const double jag = 0.02 * std::sin(9 * turn) + 0.012 * std::sin(23 * turn + 1);
    return p.z > 0.10 + jag && p.z < 0.245 - 0.6 * jag &&
           std::abs(turn) < 0.62 + 3 * (p.z - 0.17) * (p.z - 0.05);
  };
  const auto quad = [&](std::uint32_t p, std::uint32_t q, std::uint32_t r, std::uint32_t s) {
    mesh_->AddTriangle(p, q, r, part);
    mesh_->AddTriangle(p, r, s, part);
  };
  // The fracture between the outside and the inside, on vertices of its own.
  const auto fracture = [&](std::uint32_t r0, std::uint32_t k0, std::uint32_t r1,
                            std::uint32_t k1) {
    const auto copy = [&](std::uint32_t r, std::uint32_t k) {
      return mesh_->AddVertex(mesh_->vertices[vertex(r, k)]);
    };
    const std::uint32_t p = copy(r0, k0), q = copy(r1, k1);
    const std::uint32_t q_in = copy(2 * outer_rows + 1 - r1, k1);
    quad(p, q, q_in, copy(2 * outer_rows + 1 - r0, k0));
  };
  for (std::uint32_t r = 0; r + 1 < rows; ++r) {
    for (std::uint32_t k = 0; k < kAround; ++k) {
      if (!missing(r, k)) {
        quad(vertex(r, k), vertex(r, k + 1), vertex(r + 1, k + 1), vertex(r + 1, k));
      } else if (r < outer_rows) {
        if (!missing(r - 1, k)) fracture(r, k, r, k + 1);
        if (!missing(r + 1, k)) fracture(r + 1, k + 1, r + 1, k);
        if (!missing(r, k + kAround - 1)) fracture(r + 1, k, r, k);
        if (!missing(r, k + 1)) fracture(r, k + 1, r + 1, k + 1);
      }
    }
  }
  const double moved = Settle(first_vertex, 0.085);
  (*parts_)[part].frame.origin.z += moved;
  DropBuried(first_triangle);
}

}  // namespace sherd::synthetic
