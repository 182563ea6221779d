#include <algorithm>
#include <cmath>
#include <mutex>
#include <nlohmann/json.hpp>

#include "datasets_synthetic/excavation.h"
#include "datasets_synthetic/output_file.h"
#include "datasets_synthetic/photograph.h"
#include "datasets_synthetic/random.h"
#include "datasets_synthetic/scene.h"
#include "datasets_synthetic/shots.h"
#include "datasets_synthetic/staging_folder.h"
#include "datasets_synthetic/survey_points.h"
#include "metaball/error.h"

namespace sherd {
namespace {

using synthetic::Lens;
using synthetic::Shot;
using synthetic::ShotPlan;
using synthetic::StagingFolder;
using synthetic::TrenchScene;
using Json = nlohmann::ordered_json;

constexpr int kJpegQuality = 95;
constexpr char kMarker[] = "truth/scene.json";

void Check(const ExcavationOptions& o) {
  const auto require = [](bool holds, const char* message) {
    if (!holds) throw InputError("", "", message);
  };
  require(o.photographs >= 3 && o.photographs <= 999,
          "the number of photographs must be between 3 and 999 (a point needs three to see it)");
  require(o.photo_width >= 64 && o.photo_height >= 64 && o.photo_width <= 20000 &&
              o.photo_height <= 20000,
          "the photographs' sides must be between 64 and 20000 pixels");
  require(std::isfinite(o.noise_m) && o.noise_m >= 0 && o.noise_m <= 1,
          "the noise of the dense points must be between 0 and 1 metre");
  require(o.outlier_share >= 0 && o.outlier_share <= 0.9,
          "the share of outliers must be between 0 and 0.9");
  require(o.dense_points <= 200'000'000, "no more than 200 million dense points can be made");
  require(o.sparse_points <= 10'000'000, "no more than 10 million sparse points can be made");
  require(o.depth_map_max_side >= 16, "a depth map needs sides of at least 16 pixels");
  require(
      std::isfinite(o.keypoint_noise_px) && o.keypoint_noise_px >= 0 && o.keypoint_noise_px <= 10,
      "the noise of the keypoints must be between 0 and 10 pixels");
  require(std::isfinite(o.exposure_stops) && o.exposure_stops >= 0 && o.exposure_stops <= 2,
          "the exposures' standard deviation must be between 0 and 2 stops");
  require(std::isfinite(o.sensor_noise) && o.sensor_noise >= 0 && o.sensor_noise <= 64,
          "the sensor's noise must be between 0 and 64 levels");
}

Json ToJson(const Vec3d& v) { return Json::array({v.x, v.y, v.z}); }

void WriteJson(const std::string& path, const Json& json) {
  synthetic::OutputFile file(path);
  file.Text(json.dump(2));
  file.Text("\n");
  file.Close();
}

Json CameraJson(const Lens& lens) {
  return {{"camera_id", lens.camera_id},
          {"model", lens.distorted() ? "OPENCV" : "PINHOLE"},
          {"width", lens.width},
          {"height", lens.height},
          {"params", lens.Params()}};
}

void WriteTruth(const std::string& folder, const TrenchScene& trench, const ShotPlan& plan,
                const std::vector<Lens>& pinholes, const ExcavationOptions& o) {
  Json poses;
  poses["convention"] =
      "x_camera = R(q) x_world + t; q = [w, x, y, z]; camera axes right, down, forward; metres";
  for (const Lens& lens : plan.lenses) poses["cameras"].push_back(CameraJson(lens));
  for (const Lens& lens : pinholes) poses["undistorted_cameras"].push_back(CameraJson(lens));
  for (const Shot& s : plan.shots) {
    poses["photographs"].push_back({{"name", s.name},
                                    {"image_id", s.image_id},
                                    {"camera_id", plan.lenses[s.lens_idx].camera_id},
                                    {"q", Json::array({s.q[0], s.q[1], s.q[2], s.q[3]})},
                                    {"t", ToJson(s.t)},
                                    {"center", ToJson(s.eye)},
                                    {"exposure", s.exposure}});
  }
  WriteJson(folder + "/poses.json", poses);

  Json board;
  board["width_m"] = synthetic::kBoardWidth;
  board["height_m"] = synthetic::kBoardHeight;
  for (const synthetic::BoardText::Row& row : trench.board().rows()) {
    board["rows"].push_back({{"text", row.text},
                             {"letter_height_m", row.letter_height_m},
                             {"left", ToJson(trench.OnBoard(row.left_m, row.baseline_m))},
                             {"right", ToJson(trench.OnBoard(row.right_m, row.baseline_m))}});
  }
  WriteJson(folder + "/board.json", board);

  const Excavation::Box area = Excavation::survey_area();
  const Json scene = {
      {"generator", "sherd-synthetic"},
      {"version", 1},
      {"seed", o.seed},
      {"units", "metres"},
      {"axes", "z up, x east, y north; the trench's middle at the origin, its rim about z = 0"},
      {"description",
       "A trench of 4 m x 3 m: stratified sections, a floor at several depths, a dry-stone wall, "
       "sherds and a broken jar, a range pole and a scale bar with 10 cm bands, a white board"},
      {"survey_area", {{"min", ToJson(area.min)}, {"max", ToJson(area.max)}}},
      {"scale",
       {{"range_pole_band_m", 0.1}, {"scale_bar_band_m", 0.1}, {"scale_bar_length_m", 0.5}}},
      {"object_ids",
       {{"ground", 0},
        {"stones", 1},
        {"pottery", 2},
        {"range_pole", 3},
        {"scale_bar", 4},
        {"board", 5},
        {"surroundings", 6}}},
      {"options",
       {{"photographs", o.photographs},
        {"photo_width", o.photo_width},
        {"photo_height", o.photo_height},
        {"lens_distortion", o.lens_distortion},
        {"sparse_points", o.sparse_points},
        {"keypoint_noise_px", o.keypoint_noise_px},
        {"exposure_stops", o.exposure_stops},
        {"sensor_noise", o.sensor_noise},
        {"dense", o.write_dense},
        {"dense_points", o.dense_points},
        {"noise_m", o.noise_m},
        {"outlier_share", o.outlier_share},
        {"depth_map_max_side", o.depth_map_max_side},
        {"colmap_half_pixel", o.colmap_half_pixel}}}};
  WriteJson(folder + "/scene.json", scene);
}

// As COLMAP's mapper writes it beside its model.
void WriteProjectIni(const std::string& path, std::uint32_t seed) {
  synthetic::OutputFile file(path);
  file.Format(
      "log_to_stderr=false\nrandom_seed=%u\nlog_level=2\ndatabase_path=database.db\n"
      "image_path=images\n[Mapper]\nignore_watermarks=false\nmultiple_models=true\n"
      "extract_colors=true\nba_refine_focal_length=true\nba_refine_principal_point=false\n"
      "ba_refine_extra_params=true\nmin_num_matches=15\nmin_model_size=10\n",
      seed);
  file.Close();
}

// Progress over the whole of the work, one caller at a time.
class Progress {
 public:
  explicit Progress(const Control& control) : control_(control) {}

  // The stage that covers the next `share` of the work.
  void Begin(const char* what, double share) {
    const std::scoped_lock lock(mutex_);
    begin_ = end_;
    end_ += share;
    what_ = what;
    control_.Report(what_, std::min(1.0, begin_));
  }
  void Report(double fraction) {
    const std::scoped_lock lock(mutex_);
    control_.Report(what_, std::min(1.0, begin_ + (end_ - begin_) * fraction));
  }
  // For a stage that reports by itself.
  Control StageControl() {
    return {[this](std::string_view, double fraction) { Report(fraction); }, control_.stop};
  }

 private:
  const Control& control_;
  std::mutex mutex_;
  std::string what_;
  double begin_ = 0, end_ = 0;
};

}  // namespace

void WriteExcavation(const std::string& folder, const ExcavationOptions& options,
                     const Control& control) {
  Check(options);
  StagingFolder staging(folder, kMarker);
  Progress progress(control);
  control.ThrowIfStopped();

  progress.Begin("building the scene", 0.02);
  const ShotPlan plan = synthetic::PlanShots(options);
  std::vector<Lens> pinholes;
  for (const Lens& lens : plan.lenses) pinholes.push_back(UndistortedLens(lens));
  TrenchScene scene(options.seed);

  // About how long each stage takes, from the number of rays.
  const double photo_rays = 1.6 * options.photographs * options.photo_width * options.photo_height;
  const double map_rays =
      options.write_dense
          ? 1.2e6 * options.photographs * std::pow(options.depth_map_max_side / 800.0, 2) * 0.5
          : 0;
  const double dense_rays =
      options.write_dense ? 25.0 * static_cast<double>(options.dense_points) : 0;
  // Small pictures do not show the grain of light from few rays.
  const int side = std::max(options.photo_width, options.photo_height);
  const int sky_rays = side >= 1000 ? 48 : side >= 500 ? 24 : 12;
  const double light_rays = 2.4e5 * sky_rays,
               sparse_rays = 40.0 * static_cast<double>(options.sparse_points);
  const double unit = 0.97 / (photo_rays + map_rays + dense_rays + light_rays + sparse_rays);

  progress.Begin("light", unit * light_rays);
  scene.BakeLight(sky_rays, options.threads, progress.StageControl());

  // The order of the undistorted model's images: that of registration, not of names or ids.
  std::vector<std::size_t> image_order(plan.shots.size());
  for (std::size_t i = 0; i < image_order.size(); ++i) image_order[i] = i;
  synthetic::Rng rng(synthetic::HashOf(options.seed, 120));
  for (std::size_t i = image_order.size(); i > 1; --i) {
    std::swap(image_order[i - 1],
              image_order[static_cast<std::size_t>(rng.Index(static_cast<int>(i)))]);
  }

  progress.Begin("sparse model", unit * sparse_rays);
  {
    const synthetic::SparseModel model =
        MakeSparseModel(scene, plan, options, progress.StageControl());
    WriteModelBinary(staging.Make("sparse/0"), model);
    WriteModelText(staging.Make("sparse_txt/0"), model);
    WriteProjectIni(staging.path() + "/sparse/0/project.ini", options.seed);
    WriteProjectIni(staging.path() + "/sparse_txt/0/project.ini", options.seed);
    if (options.write_dense) {
      WriteModelBinary(staging.Make("dense/sparse"),
                       UndistortModel(model, plan, pinholes, image_order));
    }
  }

  progress.Begin("photographs", unit * photo_rays);
  staging.Make("images");
  if (options.write_dense) staging.Make("dense/images");
  for (std::size_t i = 0; i < plan.shots.size(); ++i) {
    const Shot& shot = plan.shots[i];
    const Lens& lens = plan.lenses[shot.lens_idx];
    const synthetic::Picture picture = TakePhotograph(
        scene, shot, lens, {options.seed, options.sensor_noise, options.threads}, control);
    WriteJpeg(staging.path() + "/images/" + shot.name, picture, shot, kJpegQuality);
    if (options.write_dense) {
      const synthetic::Picture undistorted =
          Undistort(picture, lens, pinholes[shot.lens_idx], options.threads);
      WriteJpeg(staging.path() + "/dense/images/" + shot.name, undistorted, shot, kJpegQuality);
    }
    progress.Report(static_cast<double>(i + 1) / static_cast<double>(plan.shots.size()));
  }

  if (options.write_dense) {
    progress.Begin("depth and normal maps", unit * map_rays);
    const std::string depth_folder = staging.Make("dense/stereo/depth_maps");
    const std::string normal_folder = staging.Make("dense/stereo/normal_maps");
    staging.Make("dense/stereo/consistency_graphs");
    synthetic::OutputFile fusion(staging.path() + "/dense/stereo/fusion.cfg");
    synthetic::OutputFile patch_match(staging.path() + "/dense/stereo/patch-match.cfg");
    for (std::size_t i = 0; i < plan.shots.size(); ++i) {
      const Shot& shot = plan.shots[i];
      const Lens camera =
          synthetic::DepthMapCamera(pinholes[shot.lens_idx], options.depth_map_max_side);
      const synthetic::DepthMap map = MakeDepthMap(scene, shot, camera, options.threads, control);
      const std::string file = "/" + shot.name + ".geometric.bin";
      synthetic::WriteMap(depth_folder + file, map.width, map.height, 1, map.depth);
      synthetic::WriteMap(normal_folder + file, map.width, map.height, 3, map.normal);
      fusion.Text(shot.name + "\n");
      patch_match.Text(shot.name + "\n__auto__, 20\n");
      progress.Report(static_cast<double>(i + 1) / static_cast<double>(plan.shots.size()));
    }
    fusion.Close();
    patch_match.Close();
    progress.Begin("dense points", unit * dense_rays);
    WriteFused(
        staging.path() + "/dense/fused.ply",
        MakeDenseCloud(scene, plan, pinholes, image_order, options, progress.StageControl()));
  }

  WriteTruth(staging.Make("truth"), scene, plan, pinholes, options);
  control.ThrowIfStopped();
  staging.Commit();
  progress.Begin("done", 1.0);
  progress.Report(1.0);
}

}  // namespace sherd
