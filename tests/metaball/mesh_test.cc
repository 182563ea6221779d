#include "metaball/mesh/mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <set>
#include <unordered_map>

#include "datasets_synthetic/peer_scenes.h"
#include "metaball/error.h"
#include "metaball/mesh/cell_table.h"
#include "metaball/reference/reference_density.h"
#include "test_scenes.h"

namespace sherd {
namespace {

using std::numbers::pi;
using ::testing::HasSubstr;

// Every edge runs once in each direction, no triangle names a corner twice, every vertex is used.
void ExpectClosed(const SurfaceMesh& mesh) {
  std::unordered_map<std::uint64_t, int> edges;
  std::vector<bool> used(mesh.position.size());
  for (const auto& t : mesh.triangle) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      ASSERT_LT(a, mesh.position.size());
      ASSERT_NE(a, b);
      used[a] = true;
      ++edges[std::uint64_t{a} << 32 | b];
    }
  }
  std::size_t wrong = 0;
  for (const auto& [edge, count] : edges) {
    const auto back = edges.find(edge << 32 | edge >> 32);
    wrong += count != 1 || back == edges.end();
  }
  EXPECT_EQ(wrong, 0u) << "of " << edges.size() << " directed edges";
  EXPECT_TRUE(std::all_of(used.begin(), used.end(), [](bool u) { return u; }));
  EXPECT_EQ(mesh.normal.size(), mesh.position.size());
  EXPECT_EQ(mesh.color.size(), mesh.position.size());
}

int Components(const SurfaceMesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.position.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const auto& t : mesh.triangle) {
    parent[root(t[1])] = root(t[0]);
    parent[root(t[2])] = root(t[0]);
  }
  int count = 0;
  for (std::uint32_t i = 0; i < parent.size(); ++i) count += root(i) == i;
  return count;
}

// V - E + F of a closed mesh, whose edges are 3/2 of its triangles.
std::int64_t Euler(const SurfaceMesh& mesh) {
  const auto faces = static_cast<std::int64_t>(mesh.triangle.size());
  return static_cast<std::int64_t>(mesh.position.size()) - faces * 3 / 2 + faces;
}

double Volume(const SurfaceMesh& mesh, const Vec3d& middle) {
  double sum = 0;
  for (const auto& t : mesh.triangle) {
    sum += Dot(mesh.position[t[0]] - middle,
               Cross(mesh.position[t[1]] - middle, mesh.position[t[2]] - middle));
  }
  return sum / 6;
}

double Area(const SurfaceMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangle) {
    sum += Length(Cross(mesh.position[t[1]] - mesh.position[t[0]],
                        mesh.position[t[2]] - mesh.position[t[0]]));
  }
  return sum / 2;
}

TEST(CellTableTest, EveryCaseIsClosedAndKeepsInnerEdgesOffTheFaces) {
  const auto faces = [](int edge) {
    const auto [corner, axis] = kCellEdges[edge];
    std::set<int> in;
    for (int a = 0; a < 3; ++a) {
      if (a != axis) in.insert(2 * a + (corner >> a & 1));
    }
    return in;
  };
  for (int inside = 0; inside < 256; ++inside) {
    const CellTriangles& cell = TrianglesOfCell(static_cast<std::uint8_t>(inside));
    // Exactly the edges between an inside and an outside corner are used.
    std::set<int> crossed, used;
    for (int e = 0; e < 12; ++e) {
      const auto [corner, axis] = kCellEdges[e];
      if ((inside >> corner & 1) != (inside >> (corner | 1 << axis) & 1)) crossed.insert(e);
    }
    std::set<std::pair<int, int>> sides;
    for (int t = 0; t < cell.count; ++t) {
      for (int k = 0; k < 3; ++k) {
        used.insert(cell.edges[t][k]);
        EXPECT_TRUE(sides.insert({cell.edges[t][k], cell.edges[t][(k + 1) % 3]}).second);
      }
    }
    EXPECT_EQ(used, crossed) << inside;
    for (const auto& [a, b] : sides) {
      std::set<int> common;
      const auto fa = faces(a), fb = faces(b);
      std::set_intersection(fa.begin(), fa.end(), fb.begin(), fb.end(),
                            std::inserter(common, common.end()));
      // A side without its opposite is the surface's rim in a face; one with it is inner.
      EXPECT_EQ(common.empty(), sides.contains({b, a})) << inside;
    }
  }
}

TEST(CellTableTest, NeighboursAgreeOnTheirCommonFace) {
  // The rim of a case in its face x = 1 is, mirrored, the rim of every case that has the same
  // corners on its face x = 0.
  const auto rim = [](int inside, int side) {
    const CellTriangles& cell = TrianglesOfCell(static_cast<std::uint8_t>(inside));
    std::set<std::pair<int, int>> sides;
    for (int t = 0; t < cell.count; ++t) {
      for (int k = 0; k < 3; ++k) {
        const int a = cell.edges[t][k], b = cell.edges[t][(k + 1) % 3];
        const auto in_face = [&](int e) {
          return kCellEdges[e].axis != 0 && (kCellEdges[e].corner & 1) == side;
        };
        // Named by the corner without its x bit, and the axis.
        const auto name = [&](int e) {
          return (kCellEdges[e].corner & 6) * 4 + kCellEdges[e].axis;
        };
        if (in_face(a) && in_face(b)) sides.insert({name(a), name(b)});
      }
    }
    return sides;
  };
  int compared = 0;
  for (int left = 0; left < 256; ++left) {
    for (int right = 0; right < 256; ++right) {
      if ((left >> 1 & 0x55) != (right & 0x55)) continue;
      std::set<std::pair<int, int>> turned;
      for (const auto& [a, b] : rim(right, 0)) turned.insert({b, a});
      EXPECT_EQ(rim(left, 1), turned) << left << " " << right;
      ++compared;
    }
  }
  EXPECT_EQ(compared, 256 * 16);
}

TEST(MeshTest, OneMetaballIsASphere) {
  // Threshold 1/4: the surface is the sphere of radius sqrt(1/2).
  const double r = std::sqrt(0.5);
  for (const Vec3d& center : {Vec3d{0, 0, 0}, Vec3d{0.137, -0.291, 0.55}}) {
    const Scene scene = testing::SceneOf(testing::OneMetaball(center), 0.25);
    MeshOptions options;
    options.cell_size = 0.05;
    const SurfaceMesh mesh = ExtractMesh(scene, options);
    ExpectClosed(mesh);
    EXPECT_EQ(Euler(mesh), 2);
    EXPECT_EQ(Components(mesh), 1);
    double worst = 0, worst_normal = 0;
    for (std::size_t i = 0; i < mesh.position.size(); ++i) {
      const Vec3d d = mesh.position[i] - center;
      worst = std::max(worst, std::abs(Length(d) - r));
      worst_normal = std::max(worst_normal, Length(Normalized(d) - mesh.normal[i].cast<double>()));
    }
    // The centre is kept as floats.
    EXPECT_LT(worst, 1e-7);
    EXPECT_LT(worst_normal, 1e-6);
    // Chords of cells of r / 14 lie inside the sphere by about (cell / r)^2 / 8.
    EXPECT_NEAR(Area(mesh), 4 * pi * r * r, 0.003 * 4 * pi * r * r);
    EXPECT_NEAR(Volume(mesh, center), 4 * pi / 3 * r * r * r, 0.003 * 4 * pi / 3 * r * r * r);
    EXPECT_LT(Volume(mesh, center), 4 * pi / 3 * r * r * r);
  }
}

TEST(MeshTest, HalvingTheCellQuartersTheError) {
  const Scene scene = testing::SceneOf(testing::OneMetaball(), 0.25);
  const double truth = 4 * pi / 3 * std::pow(0.5, 1.5);
  std::vector<double> error;
  for (const double cell : {0.1, 0.05, 0.025}) {
    MeshOptions options;
    options.cell_size = cell;
    error.push_back(truth - Volume(ExtractMesh(scene, options), {}));
  }
  EXPECT_NEAR(error[0] / error[1], 4, 0.4);
  EXPECT_NEAR(error[1] / error[2], 4, 0.4);
}

TEST(MeshTest, TwoFarSpheresAreTwoComponents) {
  CloudInput input;
  input.center = {{0, 0, 0}, {1000, 3, -7}};
  input.radius = {1, 0.5};
  const SurfaceMesh mesh = ExtractMesh(testing::SceneOf(input, 0.25), {0.1, 0});
  ExpectClosed(mesh);
  EXPECT_EQ(Components(mesh), 2);
  EXPECT_EQ(Euler(mesh), 4);
}

TEST(MeshTest, NoCracksAcrossBlocks) {
  // Many blocks, many ambiguous cells: a loose ball of small metaballs.
  const Scene scene = testing::SceneOf(testing::RandomBall(2000, 0.12, 4, 5), 0.3);
  for (const double cell : {0.05, 0.021, 0.0113}) {
    const SurfaceMesh mesh = ExtractMesh(scene, {cell, 0});
    EXPECT_GT(mesh.triangle.size(), 1000u);
    ExpectClosed(mesh);
    EXPECT_GT(Volume(mesh, {}), 0);
  }
  ExpectClosed(ExtractMesh(MakeShell(5000).scene));
}

// The reference's densities summed over every metaball: inside or not, as scene.h says.
bool IsInside(const Scene& scene, const ReferenceDensity& density, const Vec3d& p) {
  const Cloud& cloud = *scene.cloud;
  const Surface& surface = scene.surface;
  double f = 0, ft = 0, t = 0, best = -INFINITY;
  bool any = false;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const double r = cloud.RadiusOf(i) * surface.radius_scale;
    const double x = Length(p - cloud.center[i].cast<double>()) / r;
    if (!(x < density.support())) continue;
    const double value = density.Value(x), threshold = cloud.threshold[i];
    any = true;
    f += value;
    ft += value * threshold;
    t += threshold;
    best = std::max(best, value - threshold);
  }
  if (!any) return false;
  switch (surface.mode) {
    case ThresholdMode::kUniform:
      return f >= surface.threshold;
    case ThresholdMode::kBlended:
      return f >= ft / f;
    case ThresholdMode::kSummed:
      return f >= t;
    case ThresholdMode::kGated:
      return best >= 0;
  }
  return false;
}

// How many of every seventh vertex do not lie within a millionth of a cell of the surface, along
// some axis.
int CountOff(const Scene& scene, const SurfaceMesh& mesh, double cell) {
  const ReferenceDensity density(scene.surface.density);
  const LocalFrame& frame = scene.cloud->frame;
  const double reach = 1e-6 * cell / frame.unit;
  int off = 0;
  for (std::size_t i = 0; i < mesh.position.size(); i += 7) {
    const Vec3d p = frame.LocalFromWorld(mesh.position[i]);
    bool crossed = false;
    for (const Vec3d& axis : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}}) {
      crossed |=
          IsInside(scene, density, p - axis * reach) != IsInside(scene, density, p + axis * reach);
    }
    off += !crossed;
  }
  return off;
}

TEST(MeshTest, EveryDensityAndThresholdModeGivesAClosedSurfaceAtTheThreshold) {
  CloudInput input = testing::RandomBall(60, 0.7, 2, 9);
  for (std::size_t i = 0; i < input.center.size(); ++i) {
    input.threshold.push_back(0.3 + 0.3 * static_cast<double>(i % 3) / 3);
  }
  Scene scene = testing::SceneOf(input, 0.45);
  for (const DensityModel& density : AllDensities()) {
    scene.surface.density = density;
    for (const ThresholdMode mode : {ThresholdMode::kUniform, ThresholdMode::kBlended,
                                     ThresholdMode::kSummed, ThresholdMode::kGated}) {
      scene.surface.mode = mode;
      if (mode == ThresholdMode::kBlended && !IsNonNegative(density)) {
        EXPECT_THROW(ExtractMesh(scene), Error);  // as the renderers
        continue;
      }
      const double cell = 0.04;
      const SurfaceMesh mesh = ExtractMesh(scene, {cell, 0});
      SCOPED_TRACE(TextOf(density) + " mode " + std::to_string(static_cast<int>(mode)));
      EXPECT_GT(mesh.triangle.size(), 100u);
      ExpectClosed(mesh);
      EXPECT_EQ(CountOff(scene, mesh, cell), 0);
      EXPECT_GT(Volume(mesh, {}), 0);
      for (const Vec3f& n : mesh.normal) ASSERT_NEAR(Length(n), 1, 1e-5);
    }
  }
}

TEST(MeshTest, NormalsPointOutAndAgreeWithTheTriangles) {
  const PeerScene peer = MakeShell(3000);
  const SurfaceMesh mesh = ExtractMesh(peer.scene);
  std::size_t against = 0;
  for (const auto& t : mesh.triangle) {
    const Vec3d across =
        Cross(mesh.position[t[1]] - mesh.position[t[0]], mesh.position[t[2]] - mesh.position[t[0]]);
    against += Dot(across, mesh.normal[t[0]].cast<double>()) < -1e-3 * Length(across);
  }
  // The cell is coarse against the shell's bumps.
  EXPECT_LT(against, mesh.triangle.size() / 100);
  // A shell has two sides.
  EXPECT_EQ(Components(mesh), 2);
}

TEST(MeshTest, ColorsAndTextureCoordinatesAreBlendedByTheDensities) {
  CloudInput input;
  input.center = {{-0.3, 0, 0}, {0.3, 0, 0}};
  input.uniform_radius = 1;
  input.color = {{255, 0, 0}, {0, 0, 255}};
  Channel uv("uv", ChannelType::kFloat32, 2, 2);
  uv.Set(0, {{0.0f, 0.25f, 0, 0}});
  uv.Set(1, {{1.0f, 0.75f, 0, 0}});
  input.channels = {uv};
  const SurfaceMesh mesh = ExtractMesh(testing::SceneOf(input, 0.3), {0.05, 0});
  ASSERT_EQ(mesh.uv.size(), mesh.position.size());
  for (std::size_t i = 0; i < mesh.position.size(); ++i) {
    const Vec3d& p = mesh.position[i];
    const auto density = [&](double x) {
      const double q = 1 - ((p.x - x) * (p.x - x) + p.y * p.y + p.z * p.z);
      return q > 0 ? q * q : 0.0;
    };
    const double a = density(-0.3), b = density(0.3), share = b / (a + b);
    EXPECT_NEAR(mesh.uv[i][0], share, 1e-5);
    EXPECT_NEAR(mesh.uv[i][1], 0.25 + 0.5 * share, 1e-5);
    const Vec3f expected{static_cast<float>(1 - share), 0, static_cast<float>(share)};
    const Rgb8 color = Rgb8FromLinear(expected);
    EXPECT_NEAR(mesh.color[i].r, color.r, 1);
    EXPECT_EQ(mesh.color[i].g, 0);
    EXPECT_NEAR(mesh.color[i].b, color.b, 1);
  }
}

TEST(MeshTest, TheThreadsDoNotMatter) {
  const Scene scene = testing::SceneOf(testing::RandomBall(500, 0.2, 4, 5), 0.3);
  const SurfaceMesh one = ExtractMesh(scene, {0.02, 1});
  for (const int threads : {2, 3, 8}) {
    const SurfaceMesh other = ExtractMesh(scene, {0.02, threads});
    EXPECT_EQ(other.triangle, one.triangle);
    EXPECT_EQ(other.position, one.position);
    EXPECT_EQ(other.normal, one.normal);
    EXPECT_EQ(other.color, one.color);
  }
}

TEST(MeshTest, FarAwayIsTheSameMeshMoved) {
  const Vec3d far{500000, 4649776, 128};
  CloudInput near = testing::RandomBall(200, 0.2, 3, 5), moved = near;
  for (Vec3d& p : moved.center) p += far;
  const SurfaceMesh a = ExtractMesh(testing::SceneOf(near), {0.03, 0});
  const SurfaceMesh b = ExtractMesh(testing::SceneOf(moved), {0.03, 0});
  ExpectClosed(b);
  EXPECT_EQ(Components(a), Components(b));
  EXPECT_NEAR(Volume(b, far), Volume(a, {}), 1e-4 * Volume(a, {}));
}

TEST(MeshTest, TheDefaultCellIsHalfTheMedianRadius) {
  CloudInput input = testing::RandomBall(3, 0.2, 3, 5);
  input.radius = {0.1, 0.4, 7};
  Scene scene = testing::SceneOf(input);
  EXPECT_NEAR(DefaultCellSize(scene), 0.2, 1e-6);
  scene.surface.radius_scale = 1.5;
  EXPECT_NEAR(DefaultCellSize(scene), 0.3, 1e-6);
}

TEST(MeshTest, NothingAndNonsenseAreDefined) {
  Scene scene;
  scene.cloud = std::make_shared<Cloud>();
  EXPECT_TRUE(ExtractMesh(scene).triangle.empty());
  scene = testing::SceneOf(testing::OneMetaball());
  // Above the highest field there is no surface.
  scene.surface.threshold = 1.5;
  EXPECT_TRUE(ExtractMesh(scene).position.empty());
  scene.surface.threshold = 0.5;
  EXPECT_THROW(ExtractMesh(scene, {-1, 0}), Error);
  EXPECT_THROW(ExtractMesh(scene, {NAN, 0}), Error);
  EXPECT_THROW(ExtractMesh(scene, {INFINITY, 0}), Error);
  for (double* value : {&scene.surface.threshold, &scene.surface.radius_scale}) {
    const double good = *value;
    *value = 0;
    EXPECT_THROW(ExtractMesh(scene), Error);
    *value = good;
  }
  try {
    ExtractMesh(scene, {1e-6, 0});
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("larger cell"));
  }
  std::stop_source stop;
  stop.request_stop();
  Control control;
  control.stop = stop.get_token();
  EXPECT_THROW(ExtractMesh(scene, {}, control), Cancelled);
}

}  // namespace
}  // namespace sherd
