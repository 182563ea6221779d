#include "reconstruction/load_dense.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <unordered_map>

#include "metaball/error.h"
#include "reconstruction/colmap_model.h"
#include "reconstruction/depth_fusion.h"
#include "reconstruction/depth_map.h"
#include "reconstruction/load_photographs.h"
#include "reconstruction/memory.h"
#include "reconstruction/ply_stream.h"
#include "reconstruction/point_arrays.h"
#include "reconstruction/take_photographs.h"
#include "reconstruction/visibility.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;

// Pixels of the photograph per pixel of its depth map, from any one of the maps; 1 where there is
// none.
double DepthMapScale(const std::string& dense_root, const Survey& survey) {
  for (const Photograph& photo : survey.photographs) {
    const std::string path = FindMap(dense_root + "/stereo/depth_maps", photo.name);
    if (path.empty()) continue;
    try {
      const MapHeader map = ReadMapHeader(path);
      const double scale = static_cast<double>(survey.cameras[photo.camera_idx].width) / map.width;
      if (scale >= 1 && scale < 100) return scale;
    } catch (const InputError&) {
      // Another map will tell.
    }
  }
  return 1.0;
}

// Which index order of the .vis file is the right one: the candidates of colmap_formats 3.4, judged
// by where the points project to.
void ResolveVisibility(const ColmapModel& model, const std::vector<std::uint32_t>& photo_of_image,
                       const std::string& vis_path, Survey* survey) {
  std::vector<std::vector<std::uint32_t>> orders;
  if (!model.frame_image_ids.empty()) {
    std::unordered_map<std::uint32_t, std::uint32_t> image_of_id;
    for (std::size_t i = 0; i < model.images.size(); ++i) {
      image_of_id[model.images[i].image_id] = static_cast<std::uint32_t>(i);
    }
    std::vector<std::uint32_t> by_frames;
    for (const std::uint32_t id : model.frame_image_ids) {
      const auto found = image_of_id.find(id);
      if (found != image_of_id.end()) by_frames.push_back(photo_of_image[found->second]);
    }
    orders.push_back(std::move(by_frames));
  }
  orders.push_back(photo_of_image);
  // Between 3.11 and 3.12 COLMAP kept its registered images sorted by id.
  std::vector<std::uint32_t> by_id(model.images.size());
  for (std::size_t i = 0; i < by_id.size(); ++i) by_id[i] = static_cast<std::uint32_t>(i);
  std::sort(by_id.begin(), by_id.end(), [&](std::uint32_t a, std::uint32_t b) {
    return model.images[a].image_id < model.images[b].image_id;
  });
  for (std::uint32_t& i : by_id) i = photo_of_image[i];
  orders.push_back(std::move(by_id));

  constexpr double kEnough = 0.9;
  double best_share = -1;
  std::size_t best = 0;
  for (std::size_t i = 0; i < orders.size(); ++i) {
    const double share = ShareInside(*survey, orders[i]);
    if (share > best_share) {
      best_share = share;
      best = i;
    }
    // The first order is the one COLMAP documents: taken unless it is refuted.
    if (share >= kEnough) break;
  }
  if (best_share < kEnough) {
    survey->warnings.push_back(
        vis_path + ": only " + std::to_string(static_cast<int>(best_share * 100)) +
        " % of the listed points lie in the photographs that are said to see them; the file does "
        "not belong to this model and is left out");
    survey->points.photo_begin.clear();
    survey->points.photo_idx.clear();
    return;
  }
  std::vector<std::uint32_t> photo_of = orders[best];
  std::uint32_t largest = 0;
  for (const std::uint32_t i : survey->points.photo_idx) largest = std::max(largest, i);
  if (photo_of.size() <= largest) photo_of.resize(std::size_t{largest} + 1, kNoPhoto);
  RemapPhotos(photo_of, &survey->points);
}

}  // namespace

Survey LoadDense(const Workspace& workspace, const DenseCloudFile& cloud,
                 const LoadOptions& options, const Control& control) {
  if (!cloud.problem.empty()) throw InputError("", "", cloud.problem);
  Survey survey;
  survey.dense = true;
  ColmapModel model;
  std::vector<std::uint32_t> photo_of_image;
  std::string vis_path = cloud.visibility_path;
  std::optional<std::size_t> model_idx = options.model ? options.model : cloud.model_idx;
  if (model_idx) {
    const SparseModelFiles& files = workspace.models.at(*model_idx);
    ColmapReadOptions read;
    read.points = false;
    model = ReadColmapModel(files.folder, files.binary, read, control);
    photo_of_image = TakePhotographs(&model, &survey);
  } else {
    survey.warnings.push_back(cloud.path +
                              ": no model of its workspace was found; its photographs are unknown");
    vis_path.clear();
  }

  PlyStream stream(cloud.path);
  const std::uint64_t n = stream.count();
  const PlyLayout& layout = stream.layout();
  Thinning thinning(n, options.decimate_to);
  const std::uint64_t kept = thinning.all() ? n : options.decimate_to;
  const double share = n > 0 ? static_cast<double>(kept) / static_cast<double>(n) : 1.0;
  // The lists may grow to twice their size while they are read.
  const std::uint64_t lists =
      vis_path.empty()
          ? 0
          : kept * 8 +
                static_cast<std::uint64_t>(2 * share * static_cast<double>(FileBytes(vis_path)));
  CheckMemory(cloud.path,
              kept * (24 + (layout.has_colors() ? 3 : 0) + (layout.has_normals() ? 12 : 0)) + lists,
              options.memory_limit_bytes);
  std::optional<VisibilityReader> vis;
  if (!vis_path.empty()) {
    try {
      vis.emplace(vis_path, n);
    } catch (const InputError& error) {
      survey.warnings.push_back(std::string(error.what()) +
                                " (which photographs see a point is not known)");
    }
  }
  SurveyPoints& points = survey.points;
  points.position.reserve(kept);
  if (layout.has_colors()) points.color.reserve(kept);
  if (layout.has_normals()) points.normal.reserve(kept);
  if (vis) {
    points.photo_begin.reserve(kept + 1);
    points.photo_begin.push_back(0);
    points.photo_idx.reserve(
        static_cast<std::size_t>(share * static_cast<double>(vis->bytes() - 8 - 4 * n) / 4 * 1.02) +
        64);
  }
  std::uint64_t not_finite = 0;
  double largest = 0;
  PlyVertex vertex;
  for (std::uint64_t i = 0; i < n; ++i) {
    if (i % (1 << 15) == 0) {
      control.ThrowIfStopped();
      control.Report("reading points", static_cast<double>(i) / static_cast<double>(n));
    }
    stream.Next(&vertex);
    const bool finite = IsFinite(vertex.position);
    not_finite += !finite;
    const bool keep = thinning.Keep(i) && finite;
    if (vis) {
      try {
        if (keep) {
          vis->Read(&points.photo_idx);
          points.photo_begin.push_back(points.photo_idx.size());
        } else {
          vis->Skip();
        }
        if (i + 1 == n) vis->ExpectEnd();
      } catch (const InputError& error) {
        survey.warnings.push_back(std::string(error.what()) +
                                  " (which photographs see a point is not known)");
        vis.reset();
        points.photo_begin = {};
        points.photo_idx = {};
      }
    }
    if (!keep) continue;
    points.position.push_back(vertex.position);
    largest = std::max({largest, std::abs(vertex.position.x), std::abs(vertex.position.y),
                        std::abs(vertex.position.z)});
    if (layout.has_colors()) points.color.push_back(stream.ColorOf(vertex));
    if (layout.has_normals()) points.normal.push_back(vertex.normal);
  }
  stream.ExpectEnd();
  WarnNotFinite(cloud.path, not_finite, &survey);
  if (stream.header().vertices().properties[layout.x].type == PlyType::kFloat32) {
    WarnOfFloats(cloud.path, largest,
                 "subtract an origin before the dense stage, or geo-register after it", &survey);
  }
  if (vis) ResolveVisibility(model, photo_of_image, vis_path, &survey);
  const bool by_colmap =
      !cloud.visibility_path.empty() || fs::exists(fs::path(cloud.path).parent_path() / "stereo");
  if (by_colmap && !survey.photographs.empty()) {
    survey.dense_pixel_offset =
        0.5 * DepthMapScale(fs::path(cloud.path).parent_path().string(), survey);
  }
  return survey;
}

Survey LoadDepthMaps(const Workspace& workspace, const DepthMapSet& maps,
                     const LoadOptions& options, const Control& control) {
  const std::optional<std::size_t> model_idx = options.model ? options.model : maps.model_idx;
  if (!model_idx) {
    throw InputError(maps.dense_root, "", "has depth maps but no model in sparse/ beside them",
                     "run COLMAP's image_undistorter again");
  }
  const SparseModelFiles& files = workspace.models.at(*model_idx);
  if (!files.problem.empty()) throw InputError("", "", files.problem);
  Survey survey;
  survey.dense = true;
  ColmapReadOptions read;
  read.points = false;
  ColmapModel model = ReadColmapModel(files.folder, files.binary, read, control);
  TakePhotographs(&model, &survey);
  LocatePhotographs(workspace, options.photo_folder, maps.dense_root, control, &survey);
  FusionOptions fusion;
  fusion.stereo_folder = maps.dense_root + "/stereo";
  fusion.decimate_to = options.decimate_to;
  fusion.memory_limit_bytes = options.memory_limit_bytes;
  FuseDepthMaps(fusion, &survey, control);
  return survey;
}

}  // namespace sherd
