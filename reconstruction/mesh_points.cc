#include "reconstruction/mesh_points.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "metaball/error.h"
#include "reconstruction/memory.h"
#include "reconstruction/mesh_textures.h"

namespace sherd {
namespace {

constexpr std::uint64_t kBytesPerPoint = 100;

Vec3d AreaVector(const ImportedMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  const Vec3d& a = mesh.position[t[0]];
  return Cross(mesh.position[t[1]] - a, mesh.position[t[2]] - a) * 0.5;
}

// Points whose textures were not looked at yet.
struct Unpainted {
  MeshPoints points;
  std::vector<std::array<float, 2>> uv;  // these also where only parts of the mesh have some
  std::vector<std::uint32_t> texture;
  std::vector<Vec3f> color;

  void Reserve(const ImportedMesh& mesh, std::size_t n) {
    points.position.reserve(n);
    points.normal.reserve(n);
    if (!mesh.uv.empty()) uv.reserve(n);
    if (!mesh.texture.empty()) texture.reserve(n);
    if (!mesh.color.empty()) color.reserve(n);
  }
};

MeshPoints Painted(const ImportedMesh& mesh, std::uint64_t memory_limit_bytes,
                   const Control& control, Unpainted from) {
  MeshPoints points = std::move(from.points);
  points.warnings = mesh.warnings;
  if (!from.texture.empty()) {
    control.Report("looking up the textures", 0.7);
    ApplyTextures(mesh, from.texture, from.uv, memory_limit_bytes, control, &from.color,
                  &points.warnings);
  }
  points.color.reserve(from.color.size());
  for (const Vec3f& c : from.color) points.color.push_back(Rgb8FromLinear(c));
  if (mesh.uv_everywhere) points.uv = std::move(from.uv);
  return points;
}

}  // namespace

MeshPoints PointsAtVertices(const ImportedMesh& mesh, const Control& control,
                            std::uint64_t memory_limit_bytes) {
  const std::size_t n = mesh.position.size();
  CheckMemory(mesh.path, n * kBytesPerPoint, memory_limit_bytes);
  // The first vertex at each place.
  std::vector<std::uint32_t> order(n), first(n);
  std::iota(order.begin(), order.end(), 0u);
  const auto key = [&](std::uint32_t i) {
    const Vec3d& p = mesh.position[i];
    return std::tuple(p.x, p.y, p.z);
  };
  // Vertices that are nowhere would have no order; BuildCloud drops and counts them.
  const auto nowhere = std::stable_partition(
      order.begin(), order.end(), [&](std::uint32_t i) { return IsFinite(mesh.position[i]); });
  std::stable_sort(order.begin(), nowhere,
                   [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  for (auto it = order.begin(); it != order.end(); ++it) {
    const bool same = it != order.begin() && it < nowhere && key(*it) == key(*(it - 1));
    first[*it] = same ? first[*(it - 1)] : *it;
  }
  std::vector<Vec3d> summed;
  if (mesh.normal.empty()) {
    summed.resize(n);
    for (const auto& t : mesh.triangle) {
      const Vec3d area = AreaVector(mesh, t);
      for (const std::uint32_t corner : t) summed[first[corner]] += area;
    }
  }
  Unpainted out;
  for (std::size_t i = 0; i < n; ++i) {
    if (first[i] != i) continue;
    out.points.position.push_back(mesh.position[i]);
    out.points.normal.push_back(mesh.normal.empty() ? Normalized(summed[i]).cast<float>()
                                                    : mesh.normal[i]);
    if (!mesh.color.empty()) out.color.push_back(mesh.color[i]);
    if (!mesh.uv.empty()) out.uv.push_back(mesh.uv[i]);
    if (!mesh.texture.empty()) out.texture.push_back(mesh.texture[i]);
  }
  return Painted(mesh, memory_limit_bytes, control, std::move(out));
}

MeshPoints PointsOnTriangles(const ImportedMesh& mesh, std::uint64_t count, const Control& control,
                             std::uint64_t memory_limit_bytes) {
  std::vector<double> area_up_to;  // of the triangles so far
  area_up_to.reserve(mesh.triangle.size());
  double total = 0;
  for (const auto& t : mesh.triangle) {
    const double area = Length(AreaVector(mesh, t));
    if (std::isfinite(area)) total += area;
    area_up_to.push_back(total);
  }
  if (!(total > 0) || !std::isfinite(total)) {
    throw InputError(mesh.path, "", "its triangles have no area", "take its vertices instead");
  }
  CheckMemory(mesh.path, count * kBytesPerPoint, memory_limit_bytes);
  Unpainted out;
  out.Reserve(mesh, count);
  std::size_t at = 0;
  for (std::uint64_t k = 0; k < count; ++k) {
    if (k % (1 << 16) == 0) control.ThrowIfStopped();
    // Equal shares of the area; within a triangle the points of an additive sequence (Roberts
    // 2018), whose any run is spread evenly.
    const auto position = static_cast<double>(k);
    const double wanted = (position + 0.5) / static_cast<double>(count) * total;
    while (at + 1 < area_up_to.size() && area_up_to[at] < wanted) ++at;
    const double a = std::fmod(0.5 + 0.7548776662466927 * position, 1.0);
    const double b = std::fmod(0.5 + 0.5698402909980532 * position, 1.0);
    const double root = std::sqrt(a);
    const double share[3] = {1 - root, root * (1 - b), root * b};
    const auto& t = mesh.triangle[at];
    Vec3d p{}, normal{};
    Vec3f color{};
    std::array<float, 2> coordinates{};
    for (int c = 0; c < 3; ++c) {
      const std::uint32_t i = t[static_cast<std::size_t>(c)];
      const auto weight = static_cast<float>(share[c]);
      p += mesh.position[i] * share[c];
      if (!mesh.normal.empty()) normal += mesh.normal[i].cast<double>() * share[c];
      if (!mesh.color.empty()) color += mesh.color[i] * weight;
      if (!mesh.uv.empty()) {
        coordinates[0] += weight * mesh.uv[i][0];
        coordinates[1] += weight * mesh.uv[i][1];
      }
    }
    out.points.position.push_back(p);
    const Vec3d across = Normalized(AreaVector(mesh, t));
    out.points.normal.push_back(Normalized(normal, across).cast<float>());
    if (!mesh.color.empty()) out.color.push_back(color);
    if (!mesh.uv.empty()) out.uv.push_back(coordinates);
    // The corners of a triangle are of one part, and a part has one material.
    if (!mesh.texture.empty()) out.texture.push_back(mesh.texture[t[0]]);
  }
  return Painted(mesh, memory_limit_bytes, control, std::move(out));
}

CloudInput ToMetaballs(MeshPoints points) {
  CloudInput input;
  const std::size_t n = points.position.size();
  Channel normal("normal", ChannelType::kOctahedral, 3, n);
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3f& v = points.normal[i];
    normal.Set(i, {{v.x, v.y, v.z, 0}});
  }
  input.channels.push_back(std::move(normal));
  if (!points.uv.empty()) {
    Channel uv("uv", ChannelType::kFloat32, 2, n);
    for (std::size_t i = 0; i < n; ++i) uv.Set(i, {{points.uv[i][0], points.uv[i][1], 0, 0}});
    input.channels.push_back(std::move(uv));
  }
  input.center = std::move(points.position);
  input.color = std::move(points.color);
  return input;
}

}  // namespace sherd
