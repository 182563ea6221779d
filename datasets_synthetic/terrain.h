// The ground: turf around the trench, the four stratified sections and the excavated floor with its
// steps and pits. World: metres, z up, the trench's middle at the origin, its rim about z = 0.
#pragma once

#include <cstdint>

#include "datasets_synthetic/triangle_mesh.h"

namespace sherd::synthetic {

inline constexpr double kTrenchHalfX = 2.0, kTrenchHalfY = 1.5;
// The box that the dense cloud covers (what a surveyor would cut the cloud to).
inline constexpr Vec3d kSurveyLow{-3.0, -2.5, -1.6}, kSurveyHigh{3.0, 2.5, 0.5};

inline bool InSurveyArea(const Vec3d& p) {
  return p.x >= kSurveyLow.x && p.x <= kSurveyHigh.x && p.y >= kSurveyLow.y &&
         p.y <= kSurveyHigh.y && p.z >= kSurveyLow.z && p.z <= kSurveyHigh.z;
}

class Terrain {
 public:
  explicit Terrain(std::uint32_t seed) : seed_(seed) {}

  // Height of the ground around the trench, and of the floor inside.
  double GroundHeight(double x, double y) const;
  double FloorHeight(double x, double y) const;
  // How far the section stands outside the trench's outline at the height z, near (x, y).
  double SectionOffset(const Vec3d& p) const;
  // Signed distance to the trench's outline, a rectangle with rounded corners; positive outside.
  static double OutlineDistance(double x, double y);
  // Whether p lies in the earth, at least `depth` below the surface (to within the unevenness).
  bool Buried(const Vec3d& p, double depth) const;
  // The point on the section seen from inside at the outline's place s, at the height z, and the
  // horizontal direction from it into the trench.
  Vec3d SectionPoint(double s, double z, Vec3d* inward) const;
  // Where s ends (somewhat more than the outline is long: the corners are stretched).
  static double OutlineLength();

  void AddTo(TriangleMesh* mesh, std::size_t part_idx) const;

 private:
  void AddFloor(TriangleMesh* mesh, std::size_t part_idx) const;
  void AddSectionsAndTurf(TriangleMesh* mesh, std::size_t part_idx) const;

  std::uint32_t seed_;
};

// Features of the floor, for the materials (colours of fills and of the hearth).
struct Hearth {
  static constexpr double x = -0.42, y = 0.5, radius = 0.30;
};
struct GraveCut {
  static constexpr double x = 1.42, y = 0.72, half_x = 0.42, half_y = 0.2, yaw = 0.3;
};
// Distance outside the grave-like cut's outline (negative inside).
double GraveCutDistance(double x, double y);
struct PostHole {
  double x, y, radius, depth;
};
inline constexpr PostHole kPostHoles[] = {
    {-0.74, 1.02, 0.10, 0.20}, {-0.80, -0.16, 0.11, 0.17}, {-1.52, -0.72, 0.12, 0.18}};

}  // namespace sherd::synthetic
