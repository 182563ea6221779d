#include "reconstruction/load_mesh.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "reconstruction/colmap_model.h"
#include "reconstruction/mesh_import.h"
#include "reconstruction/mesh_points.h"
#include "reconstruction/point_arrays.h"
#include "reconstruction/take_photographs.h"

namespace sherd {
namespace {

MeshPoints PointsOf(const ImportedMesh& mesh, const LoadOptions& options, const Control& control) {
  std::uint64_t samples = options.mesh_samples.value_or(kMeshSamples);
  if (samples == 0) return PointsAtVertices(mesh, control, options.memory_limit_bytes);
  if (options.decimate_to > 0) samples = std::min(samples, options.decimate_to);
  return PointsOnTriangles(mesh, samples, control, options.memory_limit_bytes);
}

}  // namespace

Survey LoadMesh(const Workspace& workspace, const DenseCloudFile& cloud, const LoadOptions& options,
                const Control& control) {
  Survey survey;
  survey.dense = true;
  const std::optional<std::size_t> model_idx = options.model ? options.model : cloud.model_idx;
  if (model_idx) {
    const SparseModelFiles& files = workspace.models.at(*model_idx);
    ColmapReadOptions read;
    read.points = false;
    ColmapModel model = ReadColmapModel(files.folder, files.binary, read, control);
    TakePhotographs(&model, &survey);
  }
  control.Report("reading the mesh", 0);
  const ImportedMesh mesh = ReadMesh(cloud.path, control, options.memory_limit_bytes);
  control.Report("taking points of the mesh", 0.5);
  MeshPoints points = PointsOf(mesh, options, control);
  survey.warnings.insert(survey.warnings.end(), points.warnings.begin(), points.warnings.end());
  survey.points.position = std::move(points.position);
  survey.points.normal = std::move(points.normal);
  survey.points.color = std::move(points.color);

  // Vertices may be nowhere, and more than are wanted.
  const std::size_t n = survey.points.size();
  Thinning thinning(n, options.decimate_to);
  std::vector<std::uint32_t> kept;
  std::uint64_t not_finite = 0;
  double largest = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3d& p = survey.points.position[i];
    const bool finite = IsFinite(p);
    not_finite += !finite;
    if (!thinning.Keep(i) || !finite) continue;
    kept.push_back(static_cast<std::uint32_t>(i));
    largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  }
  if (kept.size() < n) Keep(kept, &survey.points);
  WarnNotFinite(cloud.path, not_finite, &survey);
  WarnOfFloats(cloud.path, largest, "export the mesh with a local origin", &survey);
  if (IsMeshWithYUp(cloud.path)) survey.up = Vec3d{0, 1, 0};
  return survey;
}

}  // namespace sherd
