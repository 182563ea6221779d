// What the scene is made of: one entry for each thing that has a material and a place of its own.
#pragma once

#include <cstdint>

#include "metaball/vec.h"

namespace sherd::synthetic {

// TruthHit::object_id.
enum ObjectId : int {
  kGround = 0,        // trench, sections and the ground beside them
  kStone = 1,         // the stone wall and all other stones
  kSherd = 2,         // sherds and the broken jar
  kPole = 3,          // range pole
  kScaleBar = 4,      //
  kBoard = 5,         // white board with text
  kSurroundings = 6,  // ground outside the survey area
};

enum class Material { kEarth, kStone, kPottery, kPole, kScaleBar, kBoard, kWood };

// A place and three orthonormal, right-handed axes.
struct Frame3 {
  Vec3d origin{}, x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};

  Vec3d ToWorld(const Vec3d& p) const { return origin + x * p.x + y * p.y + z * p.z; }
  Vec3d ToLocal(const Vec3d& p) const {
    const Vec3d d = p - origin;
    return {Dot(d, x), Dot(d, y), Dot(d, z)};
  }
};

// How a thing lies: turned by `yaw` about z, then tipped by `tilt` about the horizontal direction
// `toward`. Radians.
struct Turn {
  double yaw = 0, tilt = 0, toward = 0;
};
Frame3 MakeFrame(const Vec3d& origin, const Turn& turn);

struct Part {
  Material material = Material::kEarth;
  int object_id = kGround;
  Frame3 frame;
  Vec3d size{};   // half extents, or what the material needs (see where the part is made)
  Vec3f color{};  // linear albedo
  std::uint32_t seed = 0;
};

}  // namespace sherd::synthetic
