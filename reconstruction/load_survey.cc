// A workspace becomes a survey.
#include <algorithm>
#include <filesystem>
#include <optional>
#include <unordered_map>

#include "metaball/error.h"
#include "reconstruction/colmap_model.h"
#include "reconstruction/dense_offset.h"
#include "reconstruction/geometric_visibility.h"
#include "reconstruction/load_dense.h"
#include "reconstruction/load_mesh.h"
#include "reconstruction/load_photographs.h"
#include "reconstruction/memory.h"
#include "reconstruction/mesh_import.h"
#include "reconstruction/photo_mask.h"
#include "reconstruction/point_arrays.h"
#include "reconstruction/take_photographs.h"
#include "reconstruction/workspace.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;

Survey LoadSparse(const SparseModelFiles& files, const LoadOptions& options,
                  const Control& control) {
  if (!files.problem.empty()) throw InputError("", "", files.problem);
  const std::string points_path = files.folder + (files.binary ? "/points3D.bin" : "/points3D.txt");
  const std::uint64_t kept =
      options.decimate_to > 0 ? std::min(options.decimate_to, files.points) : files.points;
  // Position, colour, error, list; an observation takes 8 bytes in the .bin, about 10 in the .txt,
  // and 4 here (twice that while the list grows).
  const double share = files.points > 0 ? static_cast<double>(kept) / files.points : 1.0;
  CheckMemory(
      points_path,
      kept * 39 + static_cast<std::uint64_t>(static_cast<double>(FileBytes(points_path)) * share),
      options.memory_limit_bytes);
  ColmapReadOptions read;
  read.decimate_to = options.decimate_to;
  ColmapModel model = ReadColmapModel(files.folder, files.binary, read, control);
  Survey survey;
  const std::vector<std::uint32_t> photo_of_image = TakePhotographs(&model, &survey);
  WarnNotFinite(points_path, model.points_not_finite, &survey);

  // Tracks name images by id: first to the image's position, then to the photograph.
  std::unordered_map<std::uint32_t, std::uint32_t> image_of_id;
  for (std::size_t i = 0; i < model.images.size(); ++i) {
    image_of_id[model.images[i].image_id] = static_cast<std::uint32_t>(i);
  }
  const auto unknown = static_cast<std::uint32_t>(model.images.size());
  std::uint64_t unknown_count = 0;
  for (std::uint32_t& id : model.points.photo_idx) {
    const auto found = image_of_id.find(id);
    unknown_count += found == image_of_id.end();
    id = found == image_of_id.end() ? unknown : found->second;
  }
  std::vector<std::uint32_t> photo_of = photo_of_image;
  photo_of.push_back(kNoPhoto);
  RemapPhotos(photo_of, &model.points);
  if (unknown_count > 0) {
    survey.warnings.push_back(points_path + ": " +
                              Counted(unknown_count, "observation names", "observations name") +
                              " a photograph that is not in the model and left out");
  }
  survey.points = std::move(model.points);
  if (survey.points.photo_idx.empty()) {
    survey.points.photo_begin.clear();  // nothing is known: as stereo_fusion writes its models
  }
  return survey;
}

bool IsFusedCloud(const DenseCloudFile& cloud) {
  return cloud.problem.empty() && (!cloud.visibility_path.empty() || cloud.normals ||
                                   fs::path(cloud.path).filename() == "fused.ply");
}

// The cloud, or the maps, of the model that was chosen; else the first.
template <class Item>
const Item* Chosen(const std::vector<Item>& items, const std::optional<std::size_t>& model) {
  const Item* chosen = nullptr;
  for (const Item& item : items) {
    if (!chosen || (model && item.model_idx == model && chosen->model_idx != model)) {
      chosen = &item;
    }
  }
  return chosen;
}

PointSource SourceOf(const Workspace& workspace, const LoadOptions& options) {
  PointSource source = options.source;
  if (source == PointSource::kAuto) source = workspace.preferred;
  if (source == PointSource::kAuto) {
    // A sub-model chosen by number is meant itself, unless it is a dense workspace's.
    const bool model_chosen = options.model && !workspace.models[*options.model].dense_workspace;
    const bool fused = std::any_of(workspace.clouds.begin(), workspace.clouds.end(), IsFusedCloud);
    const bool maps =
        std::any_of(workspace.map_sets.begin(), workspace.map_sets.end(),
                    [&](const DepthMapSet& set) { return CoverModel(workspace, set); });
    if (!model_chosen && fused) return PointSource::kDense;
    if (!model_chosen && maps) return PointSource::kDepthMaps;
    return workspace.models.empty() ? PointSource::kDense : PointSource::kSparse;
  }
  if (source == PointSource::kDense && workspace.clouds.empty() && !workspace.map_sets.empty()) {
    return PointSource::kDepthMaps;
  }
  return source;
}

// Fewer points than this say nothing of what hides what.
constexpr std::size_t kFewestForVisibility = 1000;
constexpr double kSeenShare = 0.5;

// Points that no file gives photographs for get them by what hides what.
void CompleteVisibility(const LoadOptions& options, const Control& control, Survey* survey) {
  SurveyPoints& points = survey->points;
  if (survey->photographs.empty() || points.size() < kFewestForVisibility) return;
  const bool nothing_known = points.photo_begin.empty();
  VisibilityOptions visibility;
  visibility.memory_limit_bytes = options.memory_limit_bytes;
  FoundVisibility found;
  try {
    found = FindVisibility(visibility, survey, control);
  } catch (const ResourceError& error) {
    survey->warnings.push_back(std::string(error.what()) +
                               " (which photographs see a point is not known)");
    return;
  }
  if (!nothing_known || found.points == 0) return;
  const double share = static_cast<double>(found.seen) / static_cast<double>(found.points);
  const std::string percent = std::to_string(static_cast<int>(100 * share)) + " % of the points";
  if (share < kSeenShare) {
    points.photo_begin.clear();
    points.photo_idx.clear();
    survey->warnings.push_back("Which photographs see a point is not known: only " + percent +
                               " lie in front of any, so cloud and model are not of one frame");
    return;
  }
  survey->warnings.push_back(
      "No file says which photographs see a point: found by what hides what, for " + percent);
}

void UseMasks(const std::string& folder, const Control& control, Survey* survey) {
  const std::size_t found = FindMasks(folder, survey);
  if (found == 0) {
    throw InputError(folder, "", "holds no mask of the survey's photographs",
                     "a mask is named as its photograph with .png behind it: sub/a.jpg.png");
  }
  if (found < survey->photographs.size()) {
    survey->warnings.push_back(
        Counted(survey->photographs.size() - found, "photograph has", "photographs have") +
        " no mask in " + folder);
  }
  ApplyMasks(survey, control);
}

}  // namespace

Survey LoadSurvey(const Workspace& workspace, const LoadOptions& options, const Control& control) {
  if (options.model && *options.model >= workspace.models.size()) {
    throw InputError(workspace.path, "",
                     "has no model " + std::to_string(*options.model) + "; there are " +
                         std::to_string(workspace.models.size()));
  }
  const PointSource source = SourceOf(workspace, options);
  // A dense workspace's own model, unless another one of a dense workspace was chosen.
  LoadOptions dense = options;
  if (dense.model && !workspace.models[*dense.model].dense_workspace) dense.model.reset();
  const DenseCloudFile* const cloud =
      source == PointSource::kDense ? Chosen(workspace.clouds, options.model) : nullptr;
  if (options.mesh_samples && !(cloud && cloud->mesh)) {
    throw InputError(cloud ? cloud->path : workspace.path, "",
                     "has no triangles to take points from", "leave --samples out, or give a mesh");
  }
  Survey survey;
  std::string dense_root;
  bool located = false;
  if (source == PointSource::kDense) {
    if (!cloud) {
      throw InputError(workspace.path, "", "holds no dense cloud and no depth maps",
                       "run COLMAP's stereo_fusion, or import the sparse model");
    }
    // The vertices of a .ply are read in double precision, as any .ply is.
    const bool as_points = options.mesh_samples.value_or(0) == 0 && !IsMeshFileName(cloud->path);
    survey = as_points ? LoadDense(workspace, *cloud, dense, control)
                       : LoadMesh(workspace, *cloud, dense, control);
    dense_root = fs::path(cloud->path).parent_path().string();
  } else if (source == PointSource::kDepthMaps) {
    const DepthMapSet* maps = Chosen(workspace.map_sets, options.model);
    if (!maps) {
      throw InputError(workspace.path, "", "holds no depth maps (stereo/depth_maps)",
                       "run COLMAP's patch_match_stereo, or import the sparse model");
    }
    survey = LoadDepthMaps(workspace, *maps, dense, control);
    located = true;
  } else {
    if (workspace.models.empty()) {
      throw InputError(workspace.path, "", "holds no sparse model",
                       "cameras, images and points3D are needed, as .bin or .txt");
    }
    const SparseModelFiles& files = workspace.models[options.model.value_or(0)];
    survey = LoadSparse(files, options, control);
    if (files.dense_workspace) dense_root = fs::path(files.folder).parent_path().string();
  }
  if (survey.points.size() == 0) {
    throw InputError(workspace.path, "", "the survey holds no points");
  }
  if (!located) LocatePhotographs(workspace, options.photo_folder, dense_root, control, &survey);
  survey.dense_pixel_offset = MeasureDenseOffset(survey, survey.dense_pixel_offset, control).pixels;
  CompleteVisibility(options, control, &survey);
  if (!options.mask_folder.empty()) UseMasks(options.mask_folder, control, &survey);
  if (!survey.photographs.empty()) survey.up = EstimateUp(survey.photographs);
  return survey;
}

}  // namespace sherd
