// What a dropped folder or file holds, found before anything is loaded. Looks at any level: a
// project folder, sparse/, sparse/0, dense/, a photo folder, a single .ply, .bin or .txt, a mesh.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "metaball/control.h"
#include "reconstruction/survey.h"

namespace sherd {

// kDense is a cloud file, or the depth maps where there is none.
enum class PointSource { kAuto, kSparse, kDense, kDepthMaps };

struct SparseModelFiles {
  std::string folder;
  bool binary = true;            // .bin; else .txt
  bool dense_workspace = false;  // the undistorted model of a dense workspace
  std::uint64_t cameras = 0, images = 0,
                points = 0;  // counts from the headers (text: counted lines)
  std::string problem;       // empty, or why it cannot be read (one line)
};

struct DenseCloudFile {
  std::string path;  // fused.ply, another point cloud, or a mesh
  // Of a mesh that is no .ply: how many are taken of its surface unless others are asked for.
  std::uint64_t points = 0;
  bool mesh = false;  // it has triangles
  bool normals = false, colors = false, radii = false;
  std::string visibility_path;           // fused.ply.vis, or empty
  std::optional<std::size_t> model_idx;  // the model of the same workspace, into Workspace::models
  std::string problem;
};

struct MeshFile {
  std::string path;
  std::optional<std::uint64_t> vertices, faces;  // where a header says
};

// stereo/depth_maps and stereo/normal_maps of a dense workspace.
struct DepthMapSet {
  std::string dense_root;
  std::uint64_t depth_maps = 0, normal_maps = 0;  // photographs that have one
  std::optional<std::size_t> model_idx;           // into Workspace::models
};

struct PhotoFolder {
  std::string path;
  std::uint64_t files = 0;
  std::uint64_t bytes = 0;
};

struct Workspace {
  std::string path;  // what was asked about
  // The model that was asked about first; then the largest (most images) readable one; models of
  // dense workspaces after those of sparse/.
  std::vector<SparseModelFiles> models;
  std::vector<DenseCloudFile> clouds;
  std::vector<MeshFile> meshes;
  std::vector<PhotoFolder> photo_folders;
  std::vector<DepthMapSet> map_sets;              // the one with most depth maps first
  std::uint64_t depth_maps = 0, normal_maps = 0;  // of all sets
  std::vector<std::string> missing;  // one line each: what a full workspace would have and what
                                     // its absence means
  // What `path` itself names: kSparse for a model's folder or file, kDense for a dense workspace or
  // a cloud (kDepthMaps where the workspace has no cloud but maps); kAuto for a whole project.
  PointSource preferred = PointSource::kAuto;
  bool empty() const { return models.empty() && clouds.empty(); }
};

// Looks at `path` (file or folder) and at its parents as far as they belong to the same COLMAP
// project. Reads headers only. Throws InputError when the path does not exist, cannot be read, or
// holds nothing Sherd knows (saying what was looked for).
Workspace InspectWorkspace(const std::string& path);

// Whether the maps are enough to stand for the model: those of at least half its photographs.
bool CoverModel(const Workspace& workspace, const DepthMapSet& maps);

struct LoadOptions {
  // kAuto: what Workspace::preferred says, else a fused cloud, else depth maps that cover the
  // model, else the sparse model.
  PointSource source = PointSource::kAuto;
  std::optional<std::size_t> model;  // index into Workspace::models; default 0
  std::string photo_folder;          // where to look for the photographs first; may be empty
  std::string mask_folder;           // of the photographs' masks (photo_mask.h); may be empty
  // Refuse (ResourceError) a load that would need more than this; 0: 80 % of the memory that is
  // free.
  std::uint64_t memory_limit_bytes = 0;
  // Points spread over the triangles of a mesh (mesh_points.h), 0: its vertices. Default: the
  // vertices of a .ply, kMeshSamples of others. Given for anything without triangles: InputError.
  std::optional<std::uint64_t> mesh_samples;
  // Thin the cloud while it is read: at most about this many points are ever held (0: no limit).
  std::uint64_t decimate_to = 0;
};

// Loads the survey. Non-finite points are dropped and reported in Survey::warnings, as are
// photographs that were not found (one line with the count). Throws InputError, ResourceError,
// Cancelled.
Survey LoadSurvey(const Workspace& workspace, const LoadOptions& options,
                  const Control& control = {});

// Sets Photograph::path for every photograph found under one of `folders`, by relative name, then
// by ever shorter ends of it, then without regard to case. Returns how many were found.
std::size_t FindPhotographs(const std::vector<std::string>& folders,
                            std::vector<Photograph>* photographs);

// For photographs that were moved since the import: looks in `folders` for every photograph that
// has no file (or whose file is gone), and takes what fits its camera as Photograph::path, what
// fits the original's camera as original_path. Returns how many photographs have a file afterwards.
std::size_t RelocatePhotographs(const std::vector<std::string>& folders, Survey* survey);

}  // namespace sherd
