#include "datasets_synthetic/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "datasets_synthetic/builder.h"
#include "datasets_synthetic/random.h"
#include "metaball/parallel.h"

namespace sherd::synthetic {
namespace {

// Late morning, thin cloud: a soft sun from the south-west and a bright sky.
const Vec3d kSunDirection = Normalized(Vec3d{-0.48, -0.62, 0.92});
constexpr double kSunRadius = 0.06;  // of its disc, radians: widened by the haze
constexpr Vec3f kSunColor{1.46f, 1.36f, 1.18f};
constexpr Vec3f kSkyColor{0.74f, 0.80f, 0.90f};
constexpr Vec3f kBounceColor{0.115f, 0.095f, 0.070f};  // from earth to earth, where the sky is hid
constexpr float kExposure = 0.86f;
constexpr int kSunRays = 16;       // the first four often suffice
constexpr int kSmoothing = 2;      // passes over the mesh, against the noise of few rays
constexpr double kSkyReach = 4.0;  // what stands farther off hides no sky, metres

}  // namespace

TriangleMesh TrenchScene::Build(std::uint32_t seed, const Terrain& terrain,
                                std::vector<Part>* parts, Frame3* board_frame) {
  TriangleMesh mesh;
  parts->push_back({Material::kEarth, kGround, {}, {}, {}, seed});
  terrain.AddTo(&mesh, 0);
  SceneBuilder builder(seed, terrain, &mesh, parts);
  builder.AddStoneWall();
  builder.AddLooseStones();
  builder.AddSherds();
  builder.AddJar();
  builder.AddRangePole();
  builder.AddScaleBar();
  *board_frame = builder.AddBoard(kBoardWidth, kBoardHeight);
  RoundToSingle(&mesh);
  // Triangles without an area have no normal and no distance of their own.
  RemoveTriangles(&mesh, 0, [&](std::size_t i) {
    const Vec3d a = mesh.Corner(i, 0);
    return !(Length(Cross(mesh.Corner(i, 1) - a, mesh.Corner(i, 2) - a)) > 1e-12);
  });
  DropUnusedVertices(&mesh);
  return mesh;
}

TrenchScene::TrenchScene(std::uint32_t seed)
    : seed_(seed),
      terrain_(seed),
      board_(seed),
      mesh_(Build(seed, terrain_, &parts_, &board_frame_)),
      vertex_normals_(VertexNormals(mesh_)),
      bvh_(mesh_),
      materials_(seed, terrain_, board_, board_frame_),
      light_(mesh_.vertices.size(), Light{1, 1}) {}

bool TrenchScene::Intersect(const RayD& ray, SceneHit* hit) const {
  if (!bvh_.Intersect(ray, std::numeric_limits<double>::infinity(), &hit->mesh)) return false;
  const auto& t = mesh_.triangles[hit->mesh.triangle];
  const Vec3d a = mesh_.vertices[t[0]], b = mesh_.vertices[t[1]], c = mesh_.vertices[t[2]];
  hit->point = ray.origin + ray.direction * hit->mesh.distance;
  hit->normal = Normalized(Cross(b - a, c - a));
  const double u = hit->mesh.u, v = hit->mesh.v;
  const auto normal_at = [&](std::size_t k) { return vertex_normals_[t[k]].cast<double>(); };
  hit->smooth_normal =
      Normalized(normal_at(0) * (1 - u - v) + normal_at(1) * u + normal_at(2) * v, hit->normal);
  if (Dot(hit->normal, ray.direction) > 0) {
    hit->normal = -hit->normal;
    hit->smooth_normal = -hit->smooth_normal;
  }
  return true;
}

int TrenchScene::ObjectOf(const SceneHit& hit) const {
  const int id = PartOf(hit).object_id;
  return id == kGround && !InSurveyArea(hit.point) ? kSurroundings : id;
}

Surface TrenchScene::SurfaceAt(const SceneHit& hit, double footprint_m) const {
  return materials_.At(PartOf(hit), hit.point, hit.smooth_normal, footprint_m);
}

void TrenchScene::BakeLight(int rays, int threads, const Control& control) {
  constexpr std::int64_t kBlock = 512;
  const auto count = static_cast<std::int64_t>(mesh_.vertices.size());
  const auto basis = [](const Vec3d& n, Vec3d* tangent, Vec3d* bitangent) {
    *tangent = Normalized(Cross(std::abs(n.z) < 0.9 ? Vec3d{0, 0, 1} : Vec3d{1, 0, 0}, n));
    *bitangent = Cross(n, *tangent);
  };
  Vec3d sun_u, sun_v;
  basis(kSunDirection, &sun_u, &sun_v);
  ParallelFor((count + kBlock - 1) / kBlock, threads, [&](std::int64_t block, int) {
    control.ThrowIfStopped();
    for (std::int64_t i = block * kBlock; i < std::min(count, (block + 1) * kBlock); ++i) {
      const auto at = static_cast<std::size_t>(i);
      // On the open ground nothing hides sun or sky.
      const Vec3d& p = mesh_.vertices[at];
      if (Terrain::OutlineDistance(p.x, p.y) > 0.35 && p.z > -0.15 && p.z < 0.15) {
        light_[at] = {1, 1};
        continue;
      }
      const Vec3d n = vertex_normals_[at].cast<double>();
      const Vec3d origin = p + n * 5e-4;
      Vec3d tangent, bitangent;
      basis(n, &tangent, &bitangent);
      // R2 sequences (Roberts 2018), shifted for each vertex.
      const std::uint64_t shift = HashOf(80, at);
      const double shift_u = UnitOf(shift), shift_v = UnitOf(Mix64(shift));
      const auto r2 = [&](int k, double* u, double* v) {
        *u = std::fmod(shift_u + 0.7548776662466927 * k, 1.0);
        *v = std::fmod(shift_v + 0.5698402909980532 * k, 1.0);
      };
      // Share of the sky's light, the lower the sky the darker: cosine-weighted rays.
      double sky = 0;
      for (int k = 0; k < rays; ++k) {
        double u, v;
        r2(k, &u, &v);
        const double r = std::sqrt(u), angle = 2 * std::numbers::pi * v;
        const Vec3d d = Normalized(tangent * (r * std::cos(angle)) +
                                   bitangent * (r * std::sin(angle)) + n * std::sqrt(1 - u));
        if (d.z > 0 && !bvh_.Occluded({origin, d}, kSkyReach)) sky += 0.55 + 0.45 * d.z;
      }
      light_[at].sky = static_cast<float>(std::min(1.0, sky / (0.85 * rays)));
      double sun = 0;
      int sun_rays = 0;
      while (sun_rays < kSunRays) {
        double u, v;
        r2(sun_rays++, &u, &v);
        const double r = kSunRadius * std::sqrt(u), angle = 2 * std::numbers::pi * v;
        const Vec3d d = Normalized(kSunDirection + sun_u * (r * std::cos(angle)) +
                                   sun_v * (r * std::sin(angle)));
        if (!bvh_.Occluded({origin, d}, 30.0)) sun += 1;
        if (sun_rays == 4 && (sun == 0 || sun == 4)) break;
      }
      light_[at].sun = static_cast<float>(sun / sun_rays);
    }
  });
  SmoothLight();
}

void TrenchScene::SmoothLight() {
  std::vector<Light> sum(light_.size());
  std::vector<float> weight(light_.size());
  for (int pass = 0; pass < kSmoothing; ++pass) {
    for (std::size_t i = 0; i < light_.size(); ++i) {
      sum[i] = {2 * light_[i].sky, 2 * light_[i].sun};
      weight[i] = 2;
    }
    for (const auto& t : mesh_.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t from = t[k], to = t[(k + 1) % 3];
        sum[to].sky += light_[from].sky;
        sum[to].sun += light_[from].sun;
        weight[to] += 1;
      }
    }
    for (std::size_t i = 0; i < light_.size(); ++i) {
      light_[i] = {sum[i].sky / weight[i], sum[i].sun / weight[i]};
    }
  }
}

Vec3f TrenchScene::Radiance(const SceneHit& hit, double footprint_m) const {
  const Surface s = SurfaceAt(hit, footprint_m);
  const auto& t = mesh_.triangles[hit.mesh.triangle];
  const float u = static_cast<float>(hit.mesh.u), v = static_cast<float>(hit.mesh.v);
  const float w = 1 - u - v;
  const float sky = w * light_[t[0]].sky + u * light_[t[1]].sky + v * light_[t[2]].sky;
  const float sun = w * light_[t[0]].sun + u * light_[t[1]].sun + v * light_[t[2]].sun;
  // The relief tips the normal; grains and crumbs so get a light and a shaded side.
  const Vec3f n = hit.smooth_normal.cast<float>();
  const Vec3f tangential = s.relief - n * Dot(s.relief, n);
  const float steepness = Length(tangential);
  const float limit = steepness > 1.2f ? 1.2f / steepness : 1.0f;
  const Vec3f tipped = Normalized(n - tangential * limit, n);
  const Vec3f sun_direction = kSunDirection.cast<float>();
  const float facing = std::max(0.0f, Dot(tipped, sun_direction));
  // The sky's part changes with the tipped normal too, a little.
  const float lean = std::clamp(1.0f + 0.45f * (tipped.z - n.z), 0.5f, 1.5f);
  const Vec3f light =
      kSunColor * (sun * facing) + kSkyColor * (sky * lean) + kBounceColor * (1.0f - 0.6f * sky);
  return Times(s.albedo, light) * kExposure;
}

Vec3f TrenchScene::Sky(const Vec3d& direction) const {
  const float up = static_cast<float>(std::clamp(direction.z * 2.0, 0.0, 1.0));
  return Mix(Vec3f{0.80f, 0.84f, 0.88f}, Vec3f{0.52f, 0.66f, 0.86f}, up);
}

}  // namespace sherd::synthetic
