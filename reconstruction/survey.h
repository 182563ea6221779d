// A survey: cameras, photographs with their poses, and points with all that is known of each. World
// coordinates in double precision, exactly as the input gives them; a cloud (metaball/cloud.h) has
// the offset and the float coordinates.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "metaball/color.h"
#include "metaball/vec.h"
#include "reconstruction/camera_model.h"

namespace sherd {

// A rotation as a unit quaternion (w, x, y, z; Hamilton) and a translation: x_target = R x_source +
// t.
struct Rigid3d {
  double qw = 1, qx = 0, qy = 0, qz = 0;
  Vec3d translation{};

  Vec3d Rotate(const Vec3d& v) const;
  Vec3d InverseRotate(const Vec3d& v) const;
  Vec3d Apply(const Vec3d& p) const { return Rotate(p) + translation; }
  // The source-frame position of the target frame's origin (a camera's centre for cam_from_world).
  Vec3d Center() const { return InverseRotate(-translation); }
};

struct Photograph {
  std::uint32_t image_id = 0;
  std::string name;              // relative path as COLMAP wrote it, UTF-8, may hold '/' and spaces
  std::uint32_t camera_idx = 0;  // into Survey::cameras
  Rigid3d cam_from_world;
  // The file found for it, with the geometry of `camera_idx` (or a pure resize of it); empty where
  // none was found.
  std::string path;
  // Where `path` is the undistorted copy of a dense workspace: the original as it came from the
  // camera, and the (distorted) camera that describes it, into Survey::cameras: camera_idx itself
  // where none is known. Empty: no file was found.
  std::string original_path;
  std::uint32_t original_camera_idx = 0;
  // The mask of the original (photo_mask.h), whose black pixels are not to be looked at; may be
  // empty.
  std::string mask_path;
};

// Points, structure of arrays; n = position.size(); every other array has n entries or none.
struct SurveyPoints {
  std::vector<Vec3d> position;
  std::vector<Rgb8> color;
  std::vector<Vec3f> normal;  // unit, world axes
  std::vector<float> error;   // mean reprojection error, px; -1 unknown
  // Which photographs see point i: photo_idx[photo_begin[i] .. photo_begin[i + 1]), indices into
  // Survey::photographs. photo_begin has n + 1 entries, or none where nothing is known.
  std::vector<std::uint64_t> photo_begin;
  std::vector<std::uint32_t> photo_idx;

  std::size_t size() const { return position.size(); }
  std::size_t MemoryBytes() const;
};

struct Survey {
  std::vector<SurveyCamera> cameras;
  std::vector<Photograph> photographs;  // by name
  SurveyPoints points;
  bool dense = false;  // points from fused.ply, not from the sparse model
  // COLMAP's dense stage takes the index of a pixel for its image coordinate, so that points fused
  // from depth maps project this many pixels of Photograph::camera_idx too far up and left
  // (colmap_formats: half a depth-map pixel). 0 for sparse points.
  double dense_pixel_offset = 0.0;
  std::optional<double> metres_per_unit;  // known scale
  std::optional<Vec3d> up;                // unit, world axes; estimated from the photographs

  // For people: what was dropped or looked odd during the import, one line each.
  std::vector<std::string> warnings;
};

// The upward direction, unit: perpendicular to the photographs' horizontal axes where these span a
// plane (cameras are held level but tilted), else the mean of their -y axes; nullopt without
// photographs or where they disagree so much that neither says anything.
std::optional<Vec3d> EstimateUp(const std::vector<Photograph>& photographs);

// The box that holds the central `share` of the points on each axis, widened by a tenth: what to
// look at when stray points lie far away. {0,0} for no points.
struct Box3d {
  Vec3d min{}, max{};
  Vec3d Center() const { return (min + max) * 0.5; }
  double Diagonal() const { return Length(max - min); }
};
Box3d RobustBounds(const std::vector<Vec3d>& points, double share = 0.98);

}  // namespace sherd
