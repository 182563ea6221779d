// How a group of metaballs becomes one, and how far that may move the surface.
//
// Lengths are those of supports in local units: radius times radius factor times the density's
// support. c is the density's core in radii of the support: the distance at which one metaball
// alone falls to the threshold.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "metaball/cloud.h"
#include "metaball/density/model.h"
#include "metaball/scene.h"

namespace sherd {

// What takes the place of a group.
struct MergedMetaball {
  Vec3f center{};  // the mean of the centres, weighted by the square of the radii; local units
  float radius = 0;
  double error = 0;                  // local units, >= 0; see GroupMerge
  std::uint32_t representative = 0;  // the member nearest to `center`
};

// Merges groups for one surface. The merged radius keeps, at the height of the surface above a
// sheet of metaballs, the sum of the members' field over the plane there, so that the surface of a
// sheet stays where it is however the sheet is cut into groups; it is never smaller than the
// largest of the group, wide enough for those of neighbouring cells to close a sheet, and never so
// large that the merged one alone reached beyond the group's own surface.
//
// The error is a bound, not a measurement. For a density that is nowhere negative and whose peak is
// not below the threshold, every metaball's centre, and the ball of c radii around it, is inside.
// With members i of support s_i at distance d_i from the merged one of support S,
//   - a point that a member's support holds is at most s_i + d_i from the merged centre, and the
//     ball of radius c S around that is inside the merged surface;
//   - a point that the merged support holds is at most S + d_i from each member's centre, and the
//     ball of radius c s_i around that is inside the full surface;
// and a point inside one of the two surfaces which no member's or merged support holds is inside
// the other as well, since all that holds it is in both. So no point of one solid is farther from
// the other than the largest
//   max(max_i (s_i + d_i - c S), min_i (S + d_i - c s_i)) over all groups.
class GroupMerge {
 public:
  // offset: the height of the surface above a sheet in radii of the support (SurfaceOffset).
  // Surface as WhyNot allows it.
  GroupMerge(const Surface& surface, double offset);

  // Why the bound does not hold for a surface; empty where it does. Throws Error for a density out
  // of range.
  static std::string WhyNot(const Surface& surface);

  // members: indices into the cloud, at least one, all in a cell with this edge (local units).
  MergedMetaball Merge(const Cloud& cloud, std::span<const std::uint32_t> members,
                       double cell_edge) const;

  double core() const { return core_; }
  double offset() const { return offset_; }
  // The support of a radius.
  double SupportOf(float radius) const { return radius * scale_; }

 private:
  // The share of a sheet's field that reaches `height` above it, in radii of the support.
  double PlaneSum(double height) const;
  double GrowthFor(double sum) const;

  double scale_ = 1, offset_ = 0, core_ = 0;
  std::vector<double> plane_sum_;  // by the square of the height, from 0 to 1
  std::vector<double> growth_;     // PlaneSum(offset / q) q^2 by log2 q
  std::vector<double> reach_;      // by k: how far k metaballs in one place reach
};

// The distance in radii at which a density falls to `value`, from below: 0 where it never reaches
// it. The shape must not rise.
double DistanceOfValue(const DensityShape& shape, double value);

}  // namespace sherd
