// A density level: the survey reduced to a target count and turned into metaballs.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "metaball/cloud.h"
#include "metaball/control.h"
#include "reconstruction/survey.h"

namespace sherd {

// How points are reduced to a target count (downsample.h).
enum class Reduction {
  kVoxel,      // the cells of a grid
  kBlueNoise,  // evenly spaced: sample elimination
  kAdaptive,   // the same with closer spacing where the surface bends
};
// "voxel", "blue-noise", "adaptive".
std::string ReductionName(Reduction reduction);
std::optional<Reduction> FindReduction(const std::string& name);
std::vector<std::string> ReductionNames();

struct LevelOptions {
  std::uint64_t target_count = 0;  // > 0; more than there are points: every point, and said so
  Reduction reduction = Reduction::kVoxel;
  // The points of the surface that the metaballs stand for are prepared points, and those of a
  // level are among those of every larger one built with the same `reduction` (not kVoxel) from the
  // same points.
  bool nested = false;
  bool remove_outliers = true;
  bool smooth_noise = true;    // by SmoothNoise, before the level is built
  bool close_holes = true;     // by CloseHoles, likewise
  double radius_factor = 0.0;  // radius = factor * local spacing; 0: the default (see radii.cc)
  double threshold = 0.0;      // 0: the default
  int max_photos_per_metaball = 8;
  // The metaballs' colours from the photographs instead of from the points (photo_colors.h): done
  // after BuildLevel, by those who have the photographs.
  bool photo_colors = false;

  friend bool operator==(const LevelOptions&, const LevelOptions&) = default;
};

// The name of the channel (Cloud::channels, 0 to 1) with the share of each metaball's points that
// were surveyed and not added by CloseHoles. A level without such points has no channel.
inline constexpr const char* kSurveyedChannel = "surveyed";

struct LevelStats {
  std::uint64_t source_points = 0;   // before preparation
  std::uint64_t outliers = 0;        // removed
  std::uint64_t closing_points = 0;  // added by CloseHoles
  std::uint64_t target_count = 0;
  std::uint64_t count = 0;  // metaballs
  double spacing = 0.0;     // median local spacing, world units
  double radius_min = 0.0, radius_median = 0.0, radius_max = 0.0;  // world units
  double threshold = 0.7;
  // Share of the metaballs whose surroundings are too sparse for the surface to close (the local
  // spacing is far above the level's own): where holes are to be expected.
  double open_share = 0.0;
  // Distances of all surveyed points from the level's surface, world units: how well it keeps what
  // was surveyed, the noise of the points included. The largest is the one-sided Hausdorff
  // distance. No error is smaller than what is stated (surface_field.h says how they are measured).
  // Negative: not known (a level built before they were measured).
  double error_mean = -1.0, error_p95 = -1.0, error_max = -1.0;
  double seconds = 0.0;
  std::uint64_t cloud_bytes = 0;

  bool HasErrors() const { return error_mean >= 0; }
};

struct Level {
  std::string name;  // "63k"
  Cloud cloud;
  LevelStats stats;
  std::vector<Vec3f> normal;  // one a metaball, world axes; or empty
  // How far each centre lies below the point of the surface that it stands for, against its normal,
  // world units; or empty: the centres are those points.
  std::vector<float> depth;
  // The photographs that see metaball i best, best first (as SurveyPoints::photo_begin, photo_idx).
  std::vector<std::uint32_t> photo_begin;
  std::vector<std::uint16_t> photo_idx;
};

// "63k" -> 63000, "1.5M" -> 1500000, "500" -> 500. Throws InputError for anything else.
std::uint64_t ParseCount(const std::string& text);
// 63000 -> "63k", 1500000 -> "1.5M", 62500 -> "62.5k"; exact: ParseCount gives the number back.
std::string FormatCount(std::uint64_t count);

// What all levels of a survey share: made once, used for each target.
struct PreparedPoints {
  SurveyPoints points;         // outliers removed, normals filled in
  std::vector<float> spacing;  // local spacing of each point, world units
  // How far SmoothNoise moved each point along its normal, world units; or empty.
  std::vector<float> shift;
  std::uint64_t source_points = 0;
  std::uint64_t outliers = 0;
  std::size_t closing = 0;  // the last of the points: CloseHoles added them, nobody surveyed them
  // What nested levels are made of: all points in an order of which each level takes the first.
  // Filled in by OrderPoints for one kind of reduction.
  std::vector<std::uint32_t> order;
  Reduction ordered_for = Reduction::kVoxel;

  std::size_t surveyed() const { return points.size() - closing; }
  // Where point i was before SmoothNoise.
  Vec3d SurveyedPosition(std::size_t i) const {
    if (shift.empty()) return points.position[i];
    return points.position[i] - points.normal[i].cast<double>() * static_cast<double>(shift[i]);
  }
};

// Outlier removal, local spacing from the nearest neighbours, normals where missing (oriented
// towards the photographs that see the point). Throws InputError for a survey without points,
// ResourceError, Cancelled.
PreparedPoints PreparePoints(const Survey& survey, bool remove_outliers,
                             const Control& control = {});
// The same of points that were taken out of the survey: there is no second copy of them.
PreparedPoints PreparePoints(SurveyPoints points, const Survey& survey, bool remove_outliers,
                             const Control& control = {});

// Moves every point along its normal onto the surface that its surroundings stand for, and averages
// the normals: over up to 64 neighbours where these agree within their noise, over fewer where the
// surface bends (local regression of degree 1 and 2 whose scale is chosen by the intersection of
// confidence intervals: Katkovnik 1999; for points: Xu and Foi, "Anisotropic denoising of 3D point
// clouds by aggregation of multiple surface-adaptive estimates", 2021). Points whose surroundings
// are no surface stay. `remove_outliers`: points that still stand out go, those through which
// hardly any neighbour's tangent plane passes (the plane fit criterion of Weyrich et al.,
// "Post-processing of scanned 3D surface data", 2004). Deterministic. Throws Cancelled, and then
// nothing has changed.
void SmoothNoise(bool remove_outliers, PreparedPoints* points, const Control& control = {});

// Adds points that close the gaps and holes of the survey, 2.4 to 16 local spacings wide: from the
// points at the rim of a hole along the surface that all points around stand for (an implicit
// surface of moving least squares), where these lie on all sides, face the same way and the
// photographs do not see through (seen_through.h). None where it is not known which photographs see
// the points: nothing then tells a hole of the survey from one of what was surveyed. The points
// take colour, photographs and spacing of the nearest surveyed one. Once, after SmoothNoise, before
// OrderPoints. Deterministic. Throws ResourceError, Cancelled, and then nothing has changed.
void CloseHoles(const Survey& survey, PreparedPoints* points, const Control& control = {});

// Needed once before nested levels are built. Throws Cancelled; InputError for kVoxel, whose cells
// do not nest.
void OrderPoints(Reduction reduction, PreparedPoints* points, const Control& control = {});

// PreparePoints and what `options` ask for of SmoothNoise, CloseHoles and OrderPoints, in this
// order. points: the survey's, taken out of it or copied.
PreparedPoints PrepareForLevels(SurveyPoints points, const Survey& survey,
                                const LevelOptions& options, const Control& control = {});

// The count reached is within 1 % of the target (or all points when there are fewer).
// Deterministic: the same points give the same level on every machine and for any number of
// threads.
Level BuildLevel(const PreparedPoints& points, const Survey& survey, const LevelOptions& options,
                 const Control& control = {});

// Radii for metaballs that came without: the same rule as BuildLevel's. positions in world units;
// returns one radius each. `spacing`, when given, receives the local spacing.
std::vector<double> RadiiFromSpacing(const std::vector<Vec3d>& positions,
                                     double radius_factor = 0.0,
                                     std::vector<double>* spacing = nullptr);

}  // namespace sherd
