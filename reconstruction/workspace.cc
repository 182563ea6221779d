#include "reconstruction/workspace.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "metaball/error.h"
#include "reconstruction/binary_reader.h"
#include "reconstruction/folder_scan.h"
#include "reconstruction/mesh_import.h"
#include "reconstruction/mesh_points.h"
#include "reconstruction/ply.h"
#include "reconstruction/text_reader.h"
#include "reconstruction/workspace_missing.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;

bool IsNumber(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(),
                                      [](unsigned char c) { return std::isdigit(c) != 0; });
}

bool IsBelow(const std::string& path, const std::string& folder) {  // or the same
  return path == folder ||
         (path.size() > folder.size() && path.compare(0, folder.size(), folder) == 0 &&
          (folder.back() == '/' || path[folder.size()] == '/'));
}

bool Exists(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

// Climbs from a part of a project to the project: from sparse/0, dense/stereo or images, as long
// as the folder above shows that it belongs together.
fs::path ProjectRoot(fs::path folder) {
  for (int i = 0; i < 5 && folder.has_parent_path() && folder.parent_path() != folder; ++i) {
    const std::string name = LowerCase(folder.filename().string());
    const fs::path parent = folder.parent_path();
    const std::string above = LowerCase(parent.filename().string());
    const bool part =
        // sparse/0, dense/0
        (IsNumber(name) && (above.starts_with("sparse") || above.starts_with("dense"))) ||
        name == "sparse" || name == "stereo" ||
        ((name == "depth_maps" || name == "normal_maps" || name == "consistency_graphs") &&
         above == "stereo") ||
        // A folder of another purpose could have one of these names as well.
        ((name.starts_with("sparse") || name.starts_with("dense") || name == "images" ||
          name == "photos" || name == "photographs") &&
         (Exists(parent / "sparse") || Exists(parent / "dense") || Exists(parent / "stereo") ||
          Exists(parent / "database.db")));
    if (!part) break;
    folder = parent;
  }
  return folder;
}

// --- models ---

constexpr const char* kModelParts[] = {"cameras", "images", "points3D"};

// The number at the beginning of a .bin file, and whether as many records can follow it.
std::uint64_t BinaryCount(const std::string& path, std::uint64_t min_record_bytes,
                          const char* what) {
  BinaryReader reader(path);
  const auto count = reader.Read<std::uint64_t>("the number of records");
  reader.CheckCount(count, min_record_bytes, what);
  return count;
}

// Lines that are neither blank nor comments; with `pairs`, each swallows the line after it.
std::uint64_t TextCount(const std::string& path, bool pairs) {
  TextReader reader(path);
  std::uint64_t count = 0;
  std::string_view line;
  while (reader.ReadLine(&line)) {
    line = Trimmed(line);
    if (line.empty() || line.front() == '#') continue;
    ++count;
    if (pairs) reader.ReadLine(&line);
  }
  return count;
}

void CountRecords(SparseModelFiles* model) {
  const std::string base = model->folder + "/";
  try {
    if (model->binary) {
      model->cameras = BinaryCount(base + "cameras.bin", 40, "cameras");
      model->images = BinaryCount(base + "images.bin", 69, "images");
      model->points = BinaryCount(base + "points3D.bin", 51, "points");
    } else {
      model->cameras = TextCount(base + "cameras.txt", false);
      model->images = TextCount(base + "images.txt", true);
      model->points = TextCount(base + "points3D.txt", false);
    }
    if (model->images == 0) model->problem = model->folder + ": the model has no photographs";
  } catch (const Error& error) {
    model->problem = error.what();
  }
}

void FindModel(const ScannedFolder& folder, bool asked, std::vector<SparseModelFiles>* models) {
  int binary = 0, text = 0;
  std::string missing_binary, missing_text;
  for (const char* part : kModelParts) {
    const auto look = [&](const char* extension, int* count, std::string* missing) {
      if (folder.Find(std::string(part) + extension)) {
        ++*count;
      } else {
        *missing += (missing->empty() ? "" : ", ") + std::string(part) + extension;
      }
    };
    look(".bin", &binary, &missing_binary);
    look(".txt", &text, &missing_text);
  }
  if (binary == 0 && text == 0) return;
  SparseModelFiles model;
  model.folder = folder.path;
  if (binary == 3 || text == 3) {
    model.binary = binary == 3;
    CountRecords(&model);
  } else {
    // images.txt alone is more often somebody's list than a model.
    if (!asked && binary == 0 && text < 2) return;
    model.binary = binary >= text;
    model.problem = folder.path + ": the sparse model is incomplete, without " +
                    (model.binary ? missing_binary : missing_text);
  }
  models->push_back(std::move(model));
}

// --- dense workspaces ---

struct DenseRoot {
  std::string path;
};

std::vector<DenseRoot> FindDenseRoots(const std::vector<ScannedFolder>& folders) {
  std::vector<DenseRoot> roots;
  for (const ScannedFolder& folder : folders) {
    const bool undistorted = folder.HasFolder("stereo") || folder.Find("run-colmap-geometric.sh");
    // Without stereo/: a cloud beside a model that is directly in sparse/, as the undistorter
    // writes it.
    const bool fused = folder.Find("fused.ply") && folder.HasFolder("sparse") &&
                       (Exists(folder.path + "/sparse/cameras.bin") ||
                        Exists(folder.path + "/sparse/cameras.txt"));
    if (undistorted || fused) roots.push_back({folder.path});
  }
  return roots;
}

const DenseRoot* DenseRootOf(const std::string& path, const std::vector<DenseRoot>& roots) {
  const DenseRoot* best = nullptr;
  for (const DenseRoot& root : roots) {
    if (IsBelow(path, root.path) && (!best || root.path.size() > best->path.size())) best = &root;
  }
  return best;
}

std::uint64_t CountMaps(const ScannedFolder& folder) {
  // One map a photograph, though there may be a photometric and a geometric one of each.
  std::vector<std::string> names;
  for (const ScannedFile& file : folder.files) {
    for (const std::string_view extension : {".geometric.bin", ".photometric.bin"}) {
      if (HasExtension(file.name, extension)) {
        names.push_back(file.name.substr(0, file.name.size() - extension.size()));
      }
    }
  }
  std::sort(names.begin(), names.end());
  return static_cast<std::uint64_t>(std::unique(names.begin(), names.end()) - names.begin());
}

// Adds the maps in `folder` to those of its workspace: they lie in sub-folders as the photographs
// do.
void AddMaps(const ScannedFolder& folder, Workspace* workspace) {
  for (const bool depth : {true, false}) {
    const std::string part = depth ? "/stereo/depth_maps" : "/stereo/normal_maps";
    const std::size_t at = folder.path.rfind(part);
    if (at == std::string::npos || !IsBelow(folder.path, folder.path.substr(0, at) + part))
      continue;
    const std::uint64_t maps = CountMaps(folder);
    if (maps == 0) continue;
    const std::string root = folder.path.substr(0, at);
    std::vector<DepthMapSet>& sets = workspace->map_sets;
    auto set = std::find_if(sets.begin(), sets.end(),
                            [&](const DepthMapSet& s) { return s.dense_root == root; });
    if (set == sets.end()) set = sets.insert(set, DepthMapSet{root, 0, 0, std::nullopt});
    (depth ? set->depth_maps : set->normal_maps) += maps;
    (depth ? workspace->depth_maps : workspace->normal_maps) += maps;
  }
}

// --- clouds and meshes ---

void FindPly(const std::string& path, bool asked, Workspace* workspace) {
  DenseCloudFile cloud;
  cloud.path = path;
  std::uint64_t faces = 0;
  try {
    const PlyHeader header = ReadPlyHeader(path);
    faces = header.faces;
    cloud.points = header.vertices;
    cloud.normals = header.has_normals;
    cloud.colors = header.has_colors;
    cloud.radii = header.has_radius;
    cloud.mesh = faces > 0;
    if (header.vertices == 0) cloud.problem = path + ": the cloud has no points";
  } catch (const Error& error) {
    cloud.problem = error.what();
  }
  if (faces > 0) {
    workspace->meshes.push_back({path, cloud.points, faces});
    if (!asked) return;  // asked for by name: its vertices serve as points
  }
  if (Exists(path + ".vis")) cloud.visibility_path = path + ".vis";
  workspace->clouds.push_back(std::move(cloud));
}

// What a mesh of another format has no header tells.
void FindMesh(const std::string& path, bool asked, Workspace* workspace) {
  workspace->meshes.push_back({path, std::nullopt, std::nullopt});
  if (!asked) return;
  DenseCloudFile cloud;
  cloud.path = path;
  cloud.points = kMeshSamples;
  cloud.mesh = cloud.normals = true;
  workspace->clouds.push_back(std::move(cloud));
}

void FindCloudOrMesh(const std::string& path, bool asked, Workspace* workspace) {
  if (HasExtension(path, ".ply")) FindPly(path, asked, workspace);
  if (IsMeshFileName(path)) FindMesh(path, asked, workspace);
}

std::optional<std::size_t> ModelOfCloud(const std::string& cloud,
                                        const std::vector<SparseModelFiles>& models) {
  const std::string folder = fs::path(cloud).parent_path().string();
  // The undistorted model beside the cloud first, then one of sparse/ beside it.
  for (const std::string& candidate : {folder + "/sparse", folder, folder + "/sparse/0"}) {
    for (std::size_t i = 0; i < models.size(); ++i) {
      if (models[i].folder == candidate) return i;
    }
  }
  for (std::size_t i = 0; i < models.size(); ++i) {
    if (IsBelow(models[i].folder, folder + "/sparse")) return i;
  }
  return std::nullopt;
}

// --- photographs ---

void FindPhotoFolders(const std::vector<ScannedFolder>& folders, Workspace* workspace) {
  for (const ScannedFolder& folder : folders) {
    std::uint64_t files = 0, bytes = 0;
    for (const ScannedFile& file : folder.files) {
      if (!IsImageFileName(file.name)) continue;
      ++files;
      bytes += file.bytes;
    }
    if (files == 0) continue;
    const std::string name = LowerCase(fs::path(folder.path).filename().string());
    if (name == "textured" || IsBelow(folder.path, workspace->path + "/truth")) continue;
    // Photographs are named relative to the folder called images, whatever lies below it.
    fs::path top = folder.path;
    for (fs::path p = folder.path; IsBelow(p.string(), folders.front().path); p = p.parent_path()) {
      const std::string part = LowerCase(p.filename().string());
      if (part == "images" || part == "photos" || part == "photographs") top = p;
      if (p == p.parent_path()) break;
    }
    auto known = std::find_if(workspace->photo_folders.begin(), workspace->photo_folders.end(),
                              [&](const PhotoFolder& f) { return IsBelow(top.string(), f.path); });
    if (known == workspace->photo_folders.end()) {
      workspace->photo_folders.push_back({top.string(), 0, 0});
      known = std::prev(workspace->photo_folders.end());
    }
    known->files += files;
    known->bytes += bytes;
  }
}

// image_path of a project.ini beside a model: a hint, often of another machine. Never written.
std::string ImagePathHint(const std::string& model_folder) {
  const fs::path ini = fs::path(model_folder) / "project.ini";
  if (!Exists(ini)) return {};
  try {
    TextReader reader(ini.string());
    std::string_view line;
    while (reader.ReadLine(&line)) {
      line = Trimmed(line);
      if (line.starts_with("[")) break;  // image_path stands before the first section
      if (!line.starts_with("image_path")) continue;
      const std::size_t equals = line.find('=');
      if (equals != std::string_view::npos) return std::string(Trimmed(line.substr(equals + 1)));
    }
  } catch (const Error&) {
    // A hint only.
  }
  return {};
}

void AddPhotoFolder(const fs::path& path, Workspace* workspace) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return;
  const std::string name = path.lexically_normal().string();
  for (const PhotoFolder& folder : workspace->photo_folders) {
    if (IsBelow(name, folder.path)) return;
  }
  Workspace found;
  found.path = workspace->path;
  FindPhotoFolders(ScanFolders(name, 4), &found);
  for (PhotoFolder& folder : found.photo_folders) {
    const bool known =
        std::any_of(workspace->photo_folders.begin(), workspace->photo_folders.end(),
                    [&](const PhotoFolder& f) { return IsBelow(folder.path, f.path); });
    if (!known) workspace->photo_folders.push_back(std::move(folder));
  }
}

}  // namespace

bool CoverModel(const Workspace& workspace, const DepthMapSet& maps) {
  if (!maps.model_idx) return false;
  const SparseModelFiles& model = workspace.models[*maps.model_idx];
  return model.problem.empty() && maps.depth_maps > 0 && 2 * maps.depth_maps >= model.images;
}

Workspace InspectWorkspace(const std::string& path) {
  std::error_code error;
  if (path.empty() || !fs::exists(path, error)) {
    throw InputError(path.empty() ? "(no path)" : path, "", "does not exist",
                     "check the spelling, or whether its disk is connected");
  }
  fs::path asked = fs::absolute(path, error).lexically_normal();
  if (!asked.has_filename()) asked = asked.parent_path();  // a slash at the end
  const bool is_file = !fs::is_directory(asked, error);
  const std::string name = asked.filename().string();
  const std::string lower = LowerCase(name);
  fs::path folder = is_file ? asked.parent_path() : asked;

  Workspace workspace;
  workspace.path = asked.string();
  std::string asked_cloud, asked_model;
  if (is_file) {
    if (HasExtension(name, ".ply") || IsMeshFileName(name)) {
      asked_cloud = asked.string();
    } else if (HasExtension(name, ".ply.vis")) {
      asked_cloud = asked.string().substr(0, asked.string().size() - 4);
    } else if (lower.ends_with(".bin") || lower.ends_with(".txt")) {
      const std::string stem = name.substr(0, name.size() - 4);
      if (stem == "cameras" || stem == "images" || stem == "points3D" || stem == "rigs" ||
          stem == "frames") {
        asked_model = folder.string();
      }
    }
    if (asked_cloud.empty() && asked_model.empty() && lower != "project.ini" &&
        !lower.ends_with(".db") && !IsImageFileName(name)) {
      throw InputError(asked.string(), "", "is no file of a COLMAP workspace",
                       "open a workspace folder, a .ply cloud, a mesh, or one of cameras, images, "
                       "points3D (.bin or .txt)");
    }
  } else {
    fs::directory_iterator readable(asked, error);
    if (error) throw InputError(asked.string(), "", "cannot be read: " + error.message());
  }

  const fs::path root = ProjectRoot(folder);
  const std::vector<ScannedFolder> folders = ScanFolders(root.string());
  const std::vector<DenseRoot> dense_roots = FindDenseRoots(folders);
  for (const ScannedFolder& f : folders) {
    FindModel(f, f.path == asked_model || f.path == folder.string(), &workspace.models);
    AddMaps(f, &workspace);
    for (const ScannedFile& file : f.files) {
      const std::string file_path = f.path + "/" + file.name;
      FindCloudOrMesh(file_path, file_path == asked_cloud, &workspace);
    }
  }
  if (!asked_cloud.empty() &&
      std::none_of(workspace.clouds.begin(), workspace.clouds.end(),
                   [&](const DenseCloudFile& c) { return c.path == asked_cloud; })) {
    if (!Exists(asked_cloud)) {
      throw InputError(asked_cloud, "", "does not exist", "a .vis file needs its cloud beside it");
    }
    FindCloudOrMesh(asked_cloud, true, &workspace);
  }

  // Models: what was asked about, then readable before broken, sparse/ before dense/, more images
  // first.
  const std::string focus = folder.string();
  const bool asked_part = !asked_model.empty() || focus != root.string();
  for (SparseModelFiles& model : workspace.models) {
    const DenseRoot* dense = DenseRootOf(model.folder, dense_roots);
    model.dense_workspace = dense && IsBelow(model.folder, dense->path + "/sparse");
  }
  const auto in_focus = [&](const std::string& p) { return asked_part && IsBelow(p, focus); };
  std::sort(workspace.models.begin(), workspace.models.end(),
            [&](const SparseModelFiles& a, const SparseModelFiles& b) {
              const auto rank = [&](const SparseModelFiles& m) {
                return std::make_tuple(!m.problem.empty(), !in_focus(m.folder), m.dense_workspace,
                                       ~m.images, !m.binary, m.folder);
              };
              return rank(a) < rank(b);
            });
  // Meshes alone: they serve as points.
  if (workspace.clouds.empty() && workspace.models.empty()) {
    const std::vector<MeshFile> meshes = std::move(workspace.meshes);
    workspace.meshes.clear();
    for (const MeshFile& mesh : meshes) FindCloudOrMesh(mesh.path, true, &workspace);
  }
  for (DenseCloudFile& cloud : workspace.clouds) {
    cloud.model_idx = ModelOfCloud(cloud.path, workspace.models);
  }
  std::erase_if(workspace.map_sets, [](const DepthMapSet& set) { return set.depth_maps == 0; });
  for (DepthMapSet& set : workspace.map_sets) {
    set.model_idx = ModelOfCloud(set.dense_root + "/stereo", workspace.models);
  }
  std::sort(workspace.map_sets.begin(), workspace.map_sets.end(),
            [&](const DepthMapSet& a, const DepthMapSet& b) {
              const auto rank = [&](const DepthMapSet& s) {
                return std::make_tuple(!in_focus(s.dense_root), ~s.depth_maps, s.dense_root);
              };
              return rank(a) < rank(b);
            });
  std::sort(workspace.clouds.begin(), workspace.clouds.end(),
            [&](const DenseCloudFile& a, const DenseCloudFile& b) {
              const auto rank = [&](const DenseCloudFile& c) {
                return std::make_tuple(c.path != asked_cloud, !c.problem.empty(), !in_focus(c.path),
                                       c.visibility_path.empty(),
                                       fs::path(c.path).filename() != "fused.ply", ~c.points,
                                       c.path);
              };
              return rank(a) < rank(b);
            });

  // Photographs: within the project, beside and above each model, and where project.ini says.
  FindPhotoFolders(folders, &workspace);
  for (const SparseModelFiles& model : workspace.models) {
    const fs::path base = model.folder;
    AddPhotoFolder(base / "images", &workspace);
    AddPhotoFolder(base.parent_path() / "images", &workspace);
    AddPhotoFolder(base.parent_path().parent_path() / "images", &workspace);
    const std::string hint = ImagePathHint(model.folder);
    if (hint.empty()) continue;
    if (fs::path(hint).is_absolute()) {
      AddPhotoFolder(hint, &workspace);
    } else {
      for (fs::path p = base; IsBelow(p.string(), root.string()); p = p.parent_path()) {
        AddPhotoFolder(p / hint, &workspace);
        if (p == p.parent_path()) break;
      }
    }
  }

  if (!asked_cloud.empty()) {
    workspace.preferred = PointSource::kDense;
  } else if (!asked_model.empty()) {
    workspace.preferred = PointSource::kSparse;
  } else if (asked_part) {
    const auto below = [&](const auto& items, auto member) {
      return std::any_of(items.begin(), items.end(),
                         [&](const auto& item) { return IsBelow(item.*member, focus); });
    };
    if (below(workspace.clouds, &DenseCloudFile::path)) {
      workspace.preferred = PointSource::kDense;
    } else if (std::any_of(workspace.map_sets.begin(), workspace.map_sets.end(),
                           [&](const DepthMapSet& set) {
                             return IsBelow(set.dense_root, focus) && CoverModel(workspace, set);
                           })) {
      workspace.preferred = PointSource::kDepthMaps;
    } else if (below(workspace.models, &SparseModelFiles::folder)) {
      workspace.preferred = PointSource::kSparse;
    }
  }

  if (workspace.empty()) {
    const bool photos = !workspace.photo_folders.empty();
    throw InputError(
        workspace.path, "",
        std::string("holds neither a COLMAP model (cameras, images and points3D as .bin or .txt) "
                    "nor a point cloud (.ply) nor a mesh") +
            (photos ? ", only photographs" : ""),
        photos ? "reconstruct them first: sherd reconstruct " + workspace.path + " --workspace DIR"
               : std::string("open the folder COLMAP wrote to, or a part of it"));
  }
  workspace.missing = WhatIsMissing(workspace);
  return workspace;
}

}  // namespace sherd
