// What every place of the scene looks like: colour and small relief as functions of the position,
// limited to what a pixel can show.
#pragma once

#include <cstdint>

#include "datasets_synthetic/board_text.h"
#include "datasets_synthetic/part.h"
#include "datasets_synthetic/terrain.h"
#include "metaball/vec.h"

namespace sherd::synthetic {

inline Vec3f Mix(const Vec3f& a, const Vec3f& b, float t) { return a * (1 - t) + b * t; }
inline Vec3f Times(const Vec3f& a, const Vec3f& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }

struct Surface {
  Vec3f albedo{};  // linear
  // Gradient of a small relief, metres per metre: the shaded normal is n minus its tangential part.
  Vec3f relief{};
};

class Materials {
 public:
  Materials(std::uint32_t seed, const Terrain& terrain, const BoardText& board,
            const Frame3& board_frame)
      : seed_(seed), terrain_(terrain), board_(board), board_frame_(board_frame) {}

  // `normal`: unit, outwards. `footprint_m`: the side of a pixel on the surface.
  Surface At(const Part& part, const Vec3d& p, const Vec3d& normal, double footprint_m) const;

 private:
  Surface Earth(const Vec3d& p, const Vec3d& normal, double footprint) const;
  Surface Turf(const Vec3d& p, double footprint, float* bare) const;
  Surface Stone(const Part& part, const Vec3d& p, double footprint) const;
  Surface Pottery(const Part& part, const Vec3d& p, const Vec3d& normal, double footprint) const;
  Surface Pole(const Part& part, const Vec3d& p, double footprint) const;
  Surface ScaleBar(const Part& part, const Vec3d& p, double footprint) const;
  Surface Board(const Part& part, const Vec3d& p, const Vec3d& normal, double footprint) const;
  Surface Wood(const Part& part, const Vec3d& p, double footprint) const;

  std::uint32_t seed_;
  const Terrain& terrain_;
  const BoardText& board_;
  Frame3 board_frame_;
};

}  // namespace sherd::synthetic
