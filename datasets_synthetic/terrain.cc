#include "datasets_synthetic/terrain.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "datasets_synthetic/noise.h"
#include "datasets_synthetic/part.h"

namespace sherd::synthetic {
namespace {

constexpr double kCornerRadius = 0.16;
constexpr double kMainFloor = -0.92;
constexpr double kFloorCell = 0.012;
constexpr double kOutlineStep = 0.0175;
// Places on the outline are counted along a line this far outside it: enough of them fall to the
// corners, from where the ground fans out.
constexpr double kSpread = 0.6;
constexpr std::uint32_t kSectionRows = 64;

// Signed distance to a box with rounded corners around the origin.
double RoundedBox(double x, double y, double half_x, double half_y, double corner) {
  const double qx = std::abs(x) - half_x + corner, qy = std::abs(y) - half_y + corner;
  return std::hypot(std::max(qx, 0.0), std::max(qy, 0.0)) + std::min(std::max(qx, qy), 0.0) -
         corner;
}

// The outline at the place s, clockwise seen from above, and the direction away from the trench.
Vec3d OutlineAt(double s, Vec3d* outward) {
  const double sx = 2 * (kTrenchHalfX - kCornerRadius), sy = 2 * (kTrenchHalfY - kCornerRadius);
  const double arc = 0.5 * std::numbers::pi * (kCornerRadius + kSpread);
  // North side (west to east), its eastern corner, east side, and so on.
  const double lengths[8] = {sx, arc, sy, arc, sx, arc, sy, arc};
  int piece = 0;
  while (piece < 7 && s > lengths[piece]) s -= lengths[piece++];
  const double hx = kTrenchHalfX - kCornerRadius, hy = kTrenchHalfY - kCornerRadius;
  const Vec3d corners[4] = {{hx, hy, 0}, {hx, -hy, 0}, {-hx, -hy, 0}, {-hx, hy, 0}};
  const Vec3d normals[4] = {{0, 1, 0}, {1, 0, 0}, {0, -1, 0}, {-1, 0, 0}};
  const int side = piece / 2;
  if (piece % 2 == 0) {
    *outward = normals[side];
    const Vec3d along{normals[side].y, -normals[side].x, 0};  // clockwise
    return corners[(side + 3) % 4] + normals[side] * kCornerRadius + along * s;
  }
  const double angle = s / (kCornerRadius + kSpread);
  *outward = normals[side] * std::cos(angle) + normals[(side + 1) % 4] * std::sin(angle);
  return corners[side] + *outward * kCornerRadius;
}

}  // namespace

double GraveCutDistance(double x, double y) {
  const double c = std::cos(GraveCut::yaw), s = std::sin(GraveCut::yaw);
  const double dx = x - GraveCut::x, dy = y - GraveCut::y;
  return RoundedBox(c * dx + s * dy, -s * dx + c * dy, GraveCut::half_x, GraveCut::half_y, 0.12);
}

double Terrain::OutlineLength() {
  return 4 * (kTrenchHalfX - kCornerRadius) + 4 * (kTrenchHalfY - kCornerRadius) +
         2 * std::numbers::pi * (kCornerRadius + kSpread);
}

double Terrain::OutlineDistance(double x, double y) {
  return RoundedBox(x, y, kTrenchHalfX, kTrenchHalfY, kCornerRadius);
}

double Terrain::GroundHeight(double x, double y) const {
  const Vec3d p{x, y, 0.37};
  return 0.035 * static_cast<double>(Fbm(p, 2.7, 2, 0.5f, 0, seed_ + 11).value) +
         0.022 * static_cast<double>(Fbm(p, 0.42, 4, 0.5f, 0, seed_ + 12).value) + 0.008 * x;
}

double Terrain::FloorHeight(double x, double y) const {
  const Vec3d p{x, y, 0.71};
  double h = kMainFloor + 0.03 * static_cast<double>(Fbm(p, 1.3, 2, 0.5f, 0, seed_ + 21).value) +
             0.014 * static_cast<double>(Fbm(p, 0.24, 4, 0.55f, 0, seed_ + 22).value);
  const double wobble = 0.03 * static_cast<double>(Fbm(p, 0.35, 3, 0.5f, 0, seed_ + 23).value);
  // An unexcavated bench along the west section and a deeper sounding in the south-east.
  h += 0.42 * SmoothStep(-0.022, 0.022, -1.02 - x + 0.05 * std::sin(2.1 * y) + 0.6 * wobble);
  const double sounding = RoundedBox(x - 1.38, y + 0.93, 0.47, 0.43, 0.05) + 0.3 * wobble;
  h -= 0.40 * SmoothStep(-0.020, 0.020, -sounding);
  for (const PostHole& hole : kPostHoles) {
    const double d = std::hypot(x - hole.x, y - hole.y) - hole.radius + 0.5 * wobble;
    h -= hole.depth * SmoothStep(-0.022, 0.022, -d);
  }
  h -= 0.13 * SmoothStep(-0.03, 0.03, -GraveCutDistance(x, y) - 0.4 * wobble);
  const double hearth = std::hypot(x - Hearth::x, y - Hearth::y);
  h -= 0.035 * SmoothStep(-0.12, 0.06, Hearth::radius - 0.05 - hearth + wobble);
  return h;
}

double Terrain::SectionOffset(const Vec3d& p) const {
  const Vec3d q{p.x, p.y, p.z * 1.4};
  return 0.055 * (p.z - kMainFloor) +
         0.020 * static_cast<double>(Fbm(q, 0.5, 3, 0.5f, 0, seed_ + 31).value) +
         0.009 * static_cast<double>(Fbm(q, 0.09, 3, 0.5f, 0, seed_ + 32).value);
}

Vec3d Terrain::SectionPoint(double s, double z, Vec3d* inward) const {
  Vec3d outward;
  Vec3d p = OutlineAt(s, &outward);
  p.z = z;
  *inward = -outward;
  return p + outward * SectionOffset(p);
}

bool Terrain::Buried(const Vec3d& p, double depth) const {
  const double outside = OutlineDistance(p.x, p.y);
  if (outside > 0.12) return p.z < GroundHeight(p.x, p.y) - depth;
  if (p.z < FloorHeight(p.x, p.y) - depth) return true;
  return outside - SectionOffset(p) > depth && p.z < GroundHeight(p.x, p.y) - depth - 0.05;
}

void Terrain::AddTo(TriangleMesh* mesh, std::size_t part_idx) const {
  AddSectionsAndTurf(mesh, part_idx);
  AddFloor(mesh, part_idx);
}

void Terrain::AddFloor(TriangleMesh* mesh, std::size_t part_idx) const {
  const double reach = 0.13;  // beyond the outline, behind the sections
  const double half_x = kTrenchHalfX + reach, half_y = kTrenchHalfY + reach;
  const auto columns = static_cast<std::uint32_t>(2 * half_x / kFloorCell) + 1;
  const auto rows = static_cast<std::uint32_t>(2 * half_y / kFloorCell) + 1;
  const auto first = static_cast<std::uint32_t>(mesh->vertices.size());
  for (std::uint32_t r = 0; r < rows; ++r) {
    for (std::uint32_t c = 0; c < columns; ++c) {
      const double x = -half_x + 2 * half_x * c / (columns - 1);
      const double y = -half_y + 2 * half_y * r / (rows - 1);
      mesh->AddVertex({x, y, FloorHeight(x, y)});
    }
  }
  const std::size_t first_triangle = mesh->triangles.size();
  mesh->AddGrid(first, rows, columns, false, part_idx);
  RemoveTriangles(mesh, first_triangle, [&](std::size_t i) {
    for (int k = 0; k < 3; ++k) {
      const Vec3d p = mesh->Corner(i, k);
      if (OutlineDistance(p.x, p.y) <= SectionOffset(p) + 0.02) return false;
    }
    return true;  // wholly behind the sections
  });
}

void Terrain::AddSectionsAndTurf(TriangleMesh* mesh, std::size_t part_idx) const {
  // Rings around the trench, from the foot of the sections up, over the rim and outwards; three
  // belts, each with a quarter of the columns of the one before it.
  constexpr int kLipRows = 5;
  constexpr std::uint32_t kCoarser = 4;
  const auto columns = static_cast<std::uint32_t>(OutlineLength() / kOutlineStep / 16) * 16;
  struct Belt {
    std::uint32_t columns;
    std::vector<double> distances;  // from the rim
  };
  Belt belts[3] = {{columns, {}}, {columns / kCoarser, {}}, {columns / kCoarser / kCoarser, {}}};
  for (double d = 0.012, step = 0.012; d < 26.0; d += step) {
    belts[d < 0.45 ? 0 : d < 1.4 ? 1 : 2].distances.push_back(d);
    step = d < 0.45 ? std::min(step * 1.06, 0.020) : d < 1.4 ? 0.06 : std::max(0.25, step * 1.25);
  }

  // The rim at a column of the finest belt.
  struct Rim {
    Vec3d base, outward;
    double height, lip, offset;
  };
  std::vector<Rim> rims(columns);
  for (std::uint32_t c = 0; c < columns; ++c) {
    Rim& rim = rims[c];
    rim.base = OutlineAt(OutlineLength() * c / columns, &rim.outward);
    rim.height = GroundHeight(rim.base.x, rim.base.y);
    const double crumble = static_cast<double>(Fbm(rim.base, 0.3, 4, 0.6f, 0, seed_ + 33).value);
    rim.lip = std::clamp(0.028 + 0.03 * crumble, 0.008, 0.06);
    rim.offset = SectionOffset({rim.base.x, rim.base.y, rim.height - rim.lip});
  }

  const auto first = static_cast<std::uint32_t>(mesh->vertices.size());
  for (std::uint32_t r = 0; r < kSectionRows; ++r) {
    for (const Rim& rim : rims) {
      // The floor just inside decides how far the section goes down.
      const double low = std::min(FloorHeight(rim.base.x, rim.base.y),
                                  FloorHeight(rim.base.x - 0.06 * rim.outward.x,
                                              rim.base.y - 0.06 * rim.outward.y)) -
                         0.05;
      const double high = rim.height - rim.lip;
      const Vec3d at{rim.base.x, rim.base.y, low + (high - low) * r / (kSectionRows - 1)};
      mesh->AddVertex(at + rim.outward * SectionOffset(at));
    }
  }
  for (int i = 1; i <= kLipRows; ++i) {
    const double angle = 0.5 * std::numbers::pi * i / kLipRows;
    for (const Rim& rim : rims) {
      Vec3d p = rim.base + rim.outward * (rim.offset + rim.lip * (1 - std::cos(angle)));
      p.z = rim.height - rim.lip * (1 - std::sin(angle));
      mesh->AddVertex(p);
    }
  }
  std::uint32_t rows = kSectionRows + kLipRows, ring = first;
  for (const Belt& belt : belts) {
    const std::uint32_t skip = columns / belt.columns;
    const auto belt_first = static_cast<std::uint32_t>(mesh->vertices.size());
    for (const double distance : belt.distances) {
      for (std::uint32_t c = 0; c < columns; c += skip) {
        const Rim& rim = rims[c];
        Vec3d p = rim.base + rim.outward * (rim.offset + rim.lip + distance);
        // From the height at the rim to that of the place itself within a hand's breadth.
        const double own = SmoothStep(0.0, 0.12, distance);
        p.z = rim.height + (GroundHeight(p.x, p.y) - rim.height) * own;
        mesh->AddVertex(p);
      }
    }
    if (skip == 1) {
      rows += static_cast<std::uint32_t>(belt.distances.size());
      mesh->AddGrid(first, rows, columns, true, part_idx);
    } else {
      mesh->AddStitch(ring, belt.columns * kCoarser, belt_first, kCoarser, part_idx);
      mesh->AddGrid(belt_first, static_cast<std::uint32_t>(belt.distances.size()), belt.columns,
                    true, part_idx);
    }
    ring = static_cast<std::uint32_t>(mesh->vertices.size()) - belt.columns;
  }
}

}  // namespace sherd::synthetic
