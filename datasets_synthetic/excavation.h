// A synthetic excavation whose truth is known: a trench of about 4 m x 3 m, in metres, z up, x
// east, y north. Everything follows from the seed. The surface is one triangle mesh: rays and
// distances are exact on it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "metaball/camera.h"
#include "metaball/color.h"
#include "metaball/control.h"
#include "metaball/vec.h"

namespace sherd {

// Where a ray meets the true surface.
struct TruthHit {
  double distance = 0;  // along the unit direction, metres
  Vec3d normal{};       // unit, towards the open side
  Vec3f color{};        // linear albedo
  // 0 ground and trench, 1 stones, 2 pottery, 3 range pole, 4 scale bar, 5 board, 6 the ground
  // outside the survey area (which the photographs show and the dense cloud does not cover).
  int object_id = 0;
};

// One row of printed text on the white board.
struct BoardRow {
  std::string text;
  double letter_height_m = 0;
  Vec3d left, right;  // ends of the row's baseline, world
};

class Excavation {
 public:
  explicit Excavation(std::uint32_t seed = 1);
  ~Excavation();
  Excavation(Excavation&&) noexcept;

  // The nearest hit, to 1e-7 m; false where the ray leaves the scene. Thread-safe.
  bool Intersect(const RayD& ray, TruthHit* hit) const;
  // Distance of a point to the nearest true surface, metres, exact to 1e-6 m. The surface includes
  // what earth or other things hide (the undersides of stones, to 2 cm into the ground).
  // Thread-safe.
  double SurfaceDistance(const Vec3d& point) const;
  const std::vector<BoardRow>& board_rows() const;

  // The box the dense cloud covers; the ground goes on beyond it.
  struct Box {
    Vec3d min{}, max{};
  };
  static Box survey_area();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

struct ExcavationOptions {
  std::uint32_t seed = 1;
  int photographs = 24;
  int photo_width = 1600, photo_height = 1200;  // up to at least 6000 x 4000
  bool lens_distortion = true;                  // OPENCV camera; else PINHOLE
  std::uint64_t dense_points = 600000;          // about as many in fused.ply
  double noise_m = 0.001;                       // standard deviation of the dense points
  double outlier_share = 0.005;                 // of the dense points, strewn through the volume
  bool write_dense = true;
  // Of the sparse model; fewer where the photographs show fewer places three times.
  std::uint64_t sparse_points = 9000;
  double keypoint_noise_px = 0.4;  // standard deviation of the observations, each axis
  double exposure_stops = 0.06;    // standard deviation of the photographs' exposure
  double sensor_noise = 1.0;       // standard deviation, 8-bit levels
  int depth_map_max_side = 800;    // depth and normal maps are not larger than this
  // Dense points as COLMAP's own fusion places them: its stereo takes a depth map's pixel index for
  // an image coordinate, so that they lie half a depth-map pixel up and to the left of the truth
  // (colmap issues 534, 1515). Off: on the true surface.
  bool colmap_half_pixel = false;
  int threads = 0;  // 0: all; the files do not depend on it
};

// Writes a complete COLMAP workspace into `folder`: images/, sparse/0 (.bin), sparse_txt/0 (.txt),
// dense/ (undistorted images, their model, depth and normal maps, fused.ply, fused.ply.vis) and
// truth/ (poses.json, board.json, scene.json). Everything is made under a temporary name beside it
// and renamed at the end; a synthetic excavation that is there already is replaced, anything else
// is refused. The bytes depend on the options alone, not on the number of threads. Throws
// InputError for options out of range, OutputError, Cancelled (nothing is then left behind).
void WriteExcavation(const std::string& folder, const ExcavationOptions& options,
                     const Control& control = {});

}  // namespace sherd
