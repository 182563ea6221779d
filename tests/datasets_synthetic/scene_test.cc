// The truth itself: rays, distances, text and scales.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "datasets_synthetic/bvh.h"
#include "datasets_synthetic/excavation.h"
#include "datasets_synthetic/lens.h"
#include "datasets_synthetic/random.h"
#include "datasets_synthetic/scene.h"

namespace sherd {
namespace {

using synthetic::Bvh;
using synthetic::Lens;
using synthetic::Rng;
using synthetic::TriangleMesh;

Vec3d RandomPoint(Rng* rng, double side) {
  return {rng->Uniform(-side, side), rng->Uniform(-side, side), rng->Uniform(-side, side)};
}
Vec3d RandomDirection(Rng* rng) {
  return Normalized(Vec3d{rng->Gaussian(), rng->Gaussian(), rng->Gaussian()});
}

// Distance to a triangle by its plane and its three edges: not the method of the hierarchy.
double PlainDistance(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const auto segment = [&](const Vec3d& from, const Vec3d& to) {
    const Vec3d d = to - from;
    const double t = std::clamp(Dot(p - from, d) / Dot(d, d), 0.0, 1.0);
    return Length(p - (from + d * t));
  };
  const Vec3d n = Normalized(Cross(b - a, c - a));
  const Vec3d foot = p - n * Dot(p - a, n);
  const bool inside = Dot(Cross(b - a, foot - a), n) >= 0 && Dot(Cross(c - b, foot - b), n) >= 0 &&
                      Dot(Cross(a - c, foot - c), n) >= 0;
  if (inside) return std::abs(Dot(p - a, n));
  return std::min({segment(a, b), segment(b, c), segment(c, a)});
}

double PlainDistance(const TriangleMesh& mesh, const Vec3d& p) {
  double best = INFINITY;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    best =
        std::min(best, PlainDistance(p, mesh.Corner(i, 0), mesh.Corner(i, 1), mesh.Corner(i, 2)));
  }
  return best;
}

// Distance along the ray by the plane's equation and three half-spaces.
double PlainHit(const RayD& ray, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d n = Cross(b - a, c - a);
  const double slope = Dot(n, ray.direction);
  if (slope == 0) return INFINITY;
  const double t = Dot(n, a - ray.origin) / slope;
  if (!(t > 0)) return INFINITY;
  const Vec3d p = ray.origin + ray.direction * t;
  const bool inside = Dot(Cross(b - a, p - a), n) >= 0 && Dot(Cross(c - b, p - b), n) >= 0 &&
                      Dot(Cross(a - c, p - c), n) >= 0;
  return inside ? t : INFINITY;
}

TriangleMesh RandomMesh(int triangles, std::uint64_t seed) {
  Rng rng(seed);
  TriangleMesh mesh;
  for (int i = 0; i < triangles; ++i) {
    const Vec3d middle = RandomPoint(&rng, 3);
    std::uint32_t corner[3];
    for (std::uint32_t& c : corner) c = mesh.AddVertex(middle + RandomPoint(&rng, 0.3));
    mesh.AddTriangle(corner[0], corner[1], corner[2], 0);
  }
  RoundToSingle(&mesh);
  return mesh;
}

TEST(Bvh, HitsWhatBruteForceHits) {
  const TriangleMesh mesh = RandomMesh(3000, 5);
  const Bvh bvh(mesh);
  Rng rng(6);
  int hits = 0;
  for (int i = 0; i < 3000; ++i) {
    RayD ray{RandomPoint(&rng, 5), RandomDirection(&rng)};
    if (i % 4 == 0) ray.direction = {0, 0, i % 8 == 0 ? 1.0 : -1.0};  // along an axis
    if (i % 5 == 0) ray.origin += ray.direction * -5000.0;            // from far away
    double expected = INFINITY;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      expected = std::min(expected,
                          PlainHit(ray, mesh.Corner(t, 0), mesh.Corner(t, 1), mesh.Corner(t, 2)));
    }
    synthetic::MeshHit hit;
    ASSERT_EQ(bvh.Intersect(ray, INFINITY, &hit), expected < INFINITY) << "ray " << i;
    EXPECT_EQ(bvh.Occluded(ray, INFINITY), expected < INFINITY);
    if (expected == INFINITY) continue;
    ++hits;
    EXPECT_NEAR(hit.distance, expected, 1e-7);
    EXPECT_TRUE(bvh.Occluded(ray, expected + 1e-6));
    EXPECT_FALSE(bvh.Occluded(ray, expected - 1e-6));
  }
  EXPECT_GT(hits, 500);
}

TEST(Bvh, DistanceIsThatOfBruteForce) {
  const TriangleMesh mesh = RandomMesh(3000, 7);
  const Bvh bvh(mesh);
  Rng rng(8);
  for (int i = 0; i < 500; ++i) {
    const Vec3d p = RandomPoint(&rng, i % 10 == 0 ? 1000 : 4);
    EXPECT_NEAR(bvh.Distance(p), PlainDistance(mesh, p), 1e-9);
  }
}

TEST(Bvh, EmptyMesh) {
  const TriangleMesh mesh;
  const Bvh bvh(mesh);
  synthetic::MeshHit hit;
  EXPECT_FALSE(bvh.Intersect({{0, 0, 0}, {0, 0, 1}}, INFINITY, &hit));
  EXPECT_EQ(bvh.Distance({0, 0, 0}), INFINITY);
}

TEST(Lens, UnprojectIsTheInverseOfProject) {
  Lens lens{1, 1600, 1200, 1155, 1156, 805, 596, -0.105, 0.048, 0.0006, -0.00045};
  lens.SetMaxRadius();
  Rng rng(9);
  for (int i = 0; i < 1000; ++i) {
    const double x = rng.Uniform(0, 1600), y = rng.Uniform(0, 1200);
    double u, v, px, py;
    lens.Unproject(x, y, &u, &v);
    ASSERT_TRUE(lens.Project(u, v, &px, &py));
    EXPECT_NEAR(px, x, 1e-9);
    EXPECT_NEAR(py, y, 1e-9);
  }
  // Far outside, where the polynomial comes back into the picture.
  double px, py;
  EXPECT_FALSE(lens.Project(1.6, 0, &px, &py));
}

TEST(Lens, EveryUndistortedPixelHasASource) {
  Lens lens{1, 800, 600, 577, 577.2, 402, 298, -0.105, 0.048, 0.0006, -0.00045};
  lens.SetMaxRadius();
  const Lens out = UndistortedLens(lens);
  EXPECT_FALSE(out.distorted());
  EXPECT_EQ(out.fx, lens.fx);
  EXPECT_NE(out.width, lens.width);
  for (int y = 0; y < out.height; y += 7) {
    for (int x = 0; x < out.width; x += 7) {
      double px, py;
      ASSERT_TRUE(lens.Project((x + 0.5 - out.cx) / out.fx, (y + 0.5 - out.cy) / out.fy, &px, &py));
      EXPECT_GE(px, -0.5);
      EXPECT_LE(px, 800.5);
      EXPECT_GE(py, -0.5);
      EXPECT_LE(py, 600.5);
    }
  }
}

// All that needs the whole excavation, built once.
TEST(Excavation, TruthHolds) {
  const synthetic::TrenchScene scene(3);
  Rng rng(10);

  // Distances against a walk over all triangles.
  for (int i = 0; i < 25; ++i) {
    const Vec3d p{rng.Uniform(-2.5, 2.5), rng.Uniform(-2, 2), rng.Uniform(-1.6, 1)};
    EXPECT_NEAR(scene.bvh().Distance(p), PlainDistance(scene.mesh(), p), 1e-6);
  }

  // Normals of all triangles outwards: a ray from the sky never meets a back side.

  for (int i = 0; i < 20000; ++i) {
    const Vec3d from{rng.Uniform(-2.9, 2.9), rng.Uniform(-2.4, 2.4), 4};
    const Vec3d to{rng.Uniform(-2.9, 2.9), rng.Uniform(-2.4, 2.4), -0.6};
    const RayD ray{from, Normalized(to - from)};
    synthetic::SceneHit hit;
    ASSERT_TRUE(scene.Intersect(ray, &hit)) << "a hole in the ground, ray " << i;
    const TriangleMesh& mesh = scene.mesh();
    const std::size_t t = hit.mesh.triangle;
    const Vec3d n =
        Cross(mesh.Corner(t, 1) - mesh.Corner(t, 0), mesh.Corner(t, 2) - mesh.Corner(t, 0));
    if (Dot(n, ray.direction) > 0) {
      ADD_FAILURE() << "a back side of object " << scene.ObjectOf(hit) << " at " << hit.point.x
                    << " " << hit.point.y << " " << hit.point.z;
    }
    EXPECT_LT(scene.bvh().Distance(hit.point), 1e-9);
  }
}

TEST(Excavation, PublicTruth) {
  const Excavation excavation(3);
  const Excavation::Box area = Excavation::survey_area();

  // Objects: everything the issue names can be seen from above.
  std::set<int> seen;
  Rng rng(11);
  for (int i = 0; i < 60000; ++i) {
    TruthHit hit;
    const RayD ray{{rng.Uniform(-4, 4), rng.Uniform(-3, 3), 5}, {0, 0, -1}};
    if (!excavation.Intersect(ray, &hit)) continue;
    seen.insert(hit.object_id);
    const Vec3d p = ray.origin + ray.direction * hit.distance;
    EXPECT_LT(excavation.SurfaceDistance(p), 1e-7);
    EXPECT_NEAR(Length(hit.normal), 1, 1e-12);
    EXPECT_LT(Dot(hit.normal, ray.direction), 1e-12);
    const bool inside =
        p.x >= area.min.x && p.x <= area.max.x && p.y >= area.min.y && p.y <= area.max.y;
    EXPECT_EQ(hit.object_id == 6, !inside);
  }
  EXPECT_EQ(seen, (std::set<int>{0, 1, 2, 3, 4, 5, 6}));

  // Board: ten rows from 60 mm to 4 mm; letters where the rows say they are.
  const std::vector<BoardRow>& rows = excavation.board_rows();
  ASSERT_EQ(rows.size(), 10u);
  EXPECT_DOUBLE_EQ(rows.front().letter_height_m, 0.060);
  EXPECT_DOUBLE_EQ(rows.back().letter_height_m, 0.004);
  const Vec3d right = Normalized(rows[0].right - rows[0].left);
  const Vec3d up = Normalized(rows[0].left - rows[9].left);
  const Vec3d out = Cross(right, up);
  for (const BoardRow& row : rows) {
    EXPECT_FALSE(row.text.empty());
    for (const char c : row.text) EXPECT_TRUE(c == ' ' || std::isupper(c) || std::isdigit(c)) << c;
    EXPECT_LT(excavation.SurfaceDistance(row.left), 1e-6);
    EXPECT_LT(excavation.SurfaceDistance(row.right), 1e-6);
    const auto dark = [&](const Vec3d& at) {
      TruthHit hit;
      EXPECT_TRUE(excavation.Intersect({at + out * 0.2, -out}, &hit));
      EXPECT_EQ(hit.object_id, 5);
      return hit.color.y < 0.35f;
    };
    // Ink across the letters' middle, none above, below or beside them.
    const double h = row.letter_height_m, length = Length(row.right - row.left);
    int ink = 0, edges = 0, outside = 0;
    bool last = false;
    for (double x = 0; x < length; x += 0.0004) {
      const bool now = dark(row.left + right * x + up * (0.5 * h));
      ink += now;
      edges += now != last;
      last = now;
      // 1.2 mm of room: colours are filtered to the millimetre.
      outside += dark(row.left + right * x + up * (1.08 * h + 0.0012));
      outside += dark(row.left + right * x - up * (0.08 * h + 0.0012));
    }
    EXPECT_EQ(outside, 0) << row.text;
    const auto letters =
        std::count_if(row.text.begin(), row.text.end(), [](char c) { return c != ' '; });
    if (h > 0.009) {
      EXPECT_GE(edges, 2 * letters - 1) << row.text;
      EXPECT_NEAR(ink * 0.0004 / length, 0.35, 0.20) << row.text;
    }
  }
  EXPECT_NE(Excavation(4).board_rows()[0].text + Excavation(4).board_rows()[5].text,
            rows[0].text + rows[5].text);
}

TEST(Excavation, PoleHasBandsOfTenCentimetres) {
  const Excavation excavation(1);
  // Rays from the south at each height, until one meets the pole.
  std::vector<double> changes;
  int last = -1;
  for (double z = -0.90; z < 0.30; z += 0.001) {
    for (double x = -0.75; x < -0.45; x += 0.008) {
      TruthHit hit;
      const RayD ray{{x, 1.0, z}, {0, 1, 0}};
      if (!excavation.Intersect(ray, &hit) || hit.object_id != 3) continue;
      // Red or white by the share of green in red; soil hides some of the foot.
      const float ratio = hit.color.y / hit.color.x;
      const int white = ratio > 0.8f ? 1 : ratio < 0.3f ? 0 : last;
      if (last >= 0 && white != last) changes.push_back(z);
      last = white;
      break;
    }
  }
  ASSERT_GE(changes.size(), 9u);
  double sum = 0;
  int bands = 0;
  for (std::size_t i = 1; i < changes.size(); ++i) {
    const double band = changes[i] - changes[i - 1];
    if (band < 0.05) continue;  // a clod that sticks to it
    EXPECT_NEAR(band, 0.1, 0.006);
    sum += band;
    ++bands;
  }
  EXPECT_NEAR(sum / bands, 0.1, 0.001);
}

}  // namespace
}  // namespace sherd
