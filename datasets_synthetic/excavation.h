// A synthetic excavation whose truth is known: a trench of about 4 m x 3 m, in metres, z up. The
// same seed and size give the same files on every machine.
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
  int object_id = 0;    // 0 ground and trench, then wall, sherds, pole, scale bar, board
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

  // The nearest hit; false where the ray leaves the scene. Thread-safe.
  bool Intersect(const RayD& ray, TruthHit* hit) const;
  // Distance of a point to the nearest true surface, metres, exact to 1e-6 m. Thread-safe.
  double SurfaceDistance(const Vec3d& point) const;
  const std::vector<BoardRow>& board_rows() const;

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
};

// Writes a complete COLMAP workspace into `folder` (made if missing; an existing workspace there is
// replaced): images/, sparse/0 (.bin), sparse_txt/0 (.txt), dense/ (undistorted images, depth and
// normal maps, fused.ply, fused.ply.vis) and truth/ (poses, board text, description).
void WriteExcavation(const std::string& folder, const ExcavationOptions& options,
                     const Control& control = {});

}  // namespace sherd
