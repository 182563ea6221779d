// The field along one ray of a screen tile, in double: what the rival methods search.
//
// The tile's list is taken in only as far as the search comes, nearest first, and metaballs left
// behind are dropped, so that every method pays for the same metaballs as ours does.
#pragma once

#include <vector>

#include "metaball/camera.h"
#include "metaball/methods/method_surface.h"
#include "metaball/methods/ray_metaball.h"
#include "metaball/tile_march.h"

namespace sherd {

class RayField {
 public:
  // List and surface must outlive the field.
  void Start(const TileList& list, const RayD& ray, const MethodSurface& surface);

  // Moves *t, which must be >= 0 and never decrease, to where the next support begins if it lies in
  // none. False when no support lies beyond.
  bool Seek(double* t);
  // Takes in every metaball whose support may meet [t, t1], where t is as Seek left it.
  void Cover(double t1);
  // The end of the piece of the ray that begins at t (as Seek left it): up to there no support
  // begins or ends. At most limit.
  double PieceEnd(double t, double limit);

  // The metaballs taken in: at least those whose support holds a point from Seek's t to Cover's t1.
  const std::vector<RayMetaball>& active() const { return active_; }
  // The smallest support radius of the metaballs taken in, local units.
  double smallest() const { return smallest_; }
  const MethodSurface& surface() const { return *surface_; }
  const MethodDensity& density() const { return surface_->density; }

  // By how much the field exceeds what the thresholds ask for: >= 0 inside. -infinity where no
  // support holds the point, and where blended thresholds have nothing to weigh.
  double Excess(double t) const;
  // The same, and its rate along the ray; 0 where it is -infinity.
  double ExcessAndRate(double t, double* rate) const;

 private:
  void TakeIn();

  const TileList* list_ = nullptr;
  const MethodSurface* surface_ = nullptr;
  RayD ray_;
  int next_ = 0;  // in the list
  std::vector<RayMetaball> active_;
  double smallest_ = 0.0;
};

}  // namespace sherd
