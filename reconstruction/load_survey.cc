// A workspace becomes a survey.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <tuple>

#include "metaball/error.h"
#include "reconstruction/colmap_model.h"
#include "reconstruction/load_photographs.h"
#include "reconstruction/memory.h"
#include "reconstruction/photo_lists.h"
#include "reconstruction/ply_stream.h"
#include "reconstruction/visibility.h"
#include "reconstruction/workspace.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;

std::uint64_t FileBytes(const std::string& path) {
  std::error_code error;
  const std::uint64_t bytes = fs::file_size(path, error);
  return error ? 0 : bytes;
}

std::string Counted(std::uint64_t count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

// Moves cameras and photographs of `model` into the survey, the photographs by name: COLMAP's order
// in the file is that of registration, or of a hash table. photo_of[i] is the photograph made of
// image i of the file, or kNoPhoto where its camera is missing.
std::vector<std::uint32_t> TakePhotographs(ColmapModel* model, Survey* survey) {
  std::unordered_map<std::uint32_t, std::uint32_t> camera_of;
  for (const SurveyCamera& camera : model->cameras) {
    camera_of[camera.camera_id] = static_cast<std::uint32_t>(camera_of.size());
  }
  survey->cameras = std::move(model->cameras);
  std::vector<std::uint32_t> photo_of(model->images.size(), kNoPhoto);
  std::uint64_t without_camera = 0;
  std::string example;
  std::vector<std::size_t> by_name(model->images.size());
  std::iota(by_name.begin(), by_name.end(), std::size_t{0});
  std::sort(by_name.begin(), by_name.end(), [&](std::size_t a, std::size_t b) {
    const ColmapImage &x = model->images[a], &y = model->images[b];
    return std::tie(x.name, x.image_id) < std::tie(y.name, y.image_id);
  });
  for (const std::size_t i : by_name) {
    const ColmapImage& image = model->images[i];
    const auto camera = camera_of.find(image.camera_id);
    if (camera == camera_of.end()) {
      if (without_camera++ == 0) example = image.name;
      continue;
    }
    photo_of[i] = static_cast<std::uint32_t>(survey->photographs.size());
    Photograph photo;
    photo.image_id = image.image_id;
    photo.name = image.name;
    photo.camera_idx = photo.original_camera_idx = camera->second;
    photo.cam_from_world = image.cam_from_world;
    survey->photographs.push_back(std::move(photo));
  }
  if (model->cameras_of_unknown_model > 0) {
    survey->warnings.push_back(
        model->folder + ": " +
        Counted(model->cameras_of_unknown_model, "camera is", "cameras are") +
        " of the unknown model " + model->unknown_model_name +
        " (written by a newer COLMAP?) and left out");
  }
  if (without_camera > 0) {
    survey->warnings.push_back(model->folder + ": " +
                               Counted(without_camera, "photograph was", "photographs were") +
                               " dropped because the camera is not in the model (" + example +
                               (without_camera > 1 ? " and others)" : ")"));
  }
  survey->warnings.insert(survey->warnings.end(), model->warnings.begin(), model->warnings.end());
  return photo_of;
}

void WarnNotFinite(const std::string& path, std::uint64_t count, Survey* survey) {
  if (count == 0) return;
  survey->warnings.push_back(path + ": " + Counted(count, "point was", "points were") +
                             " dropped because a coordinate is not finite");
}

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

// Pixels of the photograph per pixel of its depth map, from any one of the maps; 1 where there is
// none.
double DepthMapScale(const std::string& dense_root, const Survey& survey) {
  std::error_code error;
  for (const Photograph& photo : survey.photographs) {
    for (const char* kind : {".geometric.bin", ".photometric.bin"}) {
      const std::string path = dense_root + "/stereo/depth_maps/" + photo.name + kind;
      if (!fs::exists(path, error)) continue;
      std::ifstream file(path, std::ios::binary);
      int width = 0;
      char separator = 0;
      if (!(file >> width >> separator) || separator != '&' || width <= 0) continue;
      const double scale = static_cast<double>(survey.cameras[photo.camera_idx].width) / width;
      if (scale >= 1 && scale < 100) return scale;
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
  if (largest > 1e4 && stream.header().vertices().properties[layout.x].type == PlyType::kFloat32) {
    // The distance of two floats there, against what the cloud resolves.
    const double step = largest * 0x1p-24 * 2;
    char text[32];
    std::snprintf(text, sizeof(text), "%.2g", step);
    survey.warnings.push_back(cloud.path +
                              ": the coordinates are large 32-bit numbers, rounded to steps of "
                              "about " +
                              text +
                              " before Sherd read them; subtract an origin before the dense stage, "
                              "or geo-register after it");
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

bool IsFusedCloud(const DenseCloudFile& cloud) {
  return cloud.problem.empty() && (!cloud.visibility_path.empty() || cloud.normals ||
                                   fs::path(cloud.path).filename() == "fused.ply");
}

}  // namespace

Survey LoadSurvey(const Workspace& workspace, const LoadOptions& options, const Control& control) {
  if (options.model && *options.model >= workspace.models.size()) {
    throw InputError(workspace.path, "",
                     "has no model " + std::to_string(*options.model) + "; there are " +
                         std::to_string(workspace.models.size()));
  }
  PointSource source = options.source;
  if (source == PointSource::kAuto) source = workspace.preferred;
  if (source == PointSource::kAuto) {
    const bool fused = std::any_of(workspace.clouds.begin(), workspace.clouds.end(), IsFusedCloud);
    // A sub-model chosen by number is meant itself, unless it is a dense workspace's.
    const bool model_chosen = options.model && !workspace.models[*options.model].dense_workspace;
    source = (fused && !model_chosen) || workspace.models.empty() ? PointSource::kDense
                                                                  : PointSource::kSparse;
  }
  Survey survey;
  std::string dense_root;
  if (source == PointSource::kDense) {
    const DenseCloudFile* cloud = nullptr;
    for (const DenseCloudFile& c : workspace.clouds) {
      if (!cloud ||
          (options.model && c.model_idx == options.model && cloud->model_idx != options.model)) {
        cloud = &c;
      }
    }
    if (!cloud) {
      throw InputError(workspace.path, "", "holds no dense cloud",
                       "run COLMAP's stereo_fusion, or import the sparse model");
    }
    LoadOptions dense = options;
    // The cloud's own model, unless another one of a dense workspace was chosen.
    if (dense.model && !workspace.models[*dense.model].dense_workspace) dense.model.reset();
    survey = LoadDense(workspace, *cloud, dense, control);
    dense_root = fs::path(cloud->path).parent_path().string();
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
  LocatePhotographs(workspace, options.photo_folder, dense_root, control, &survey);
  survey.up = EstimateUp(survey.photographs);
  return survey;
}

}  // namespace sherd
