// One ray through the thesis's octree (thesis_renderer.h), and the rules where the thesis leaves
// them open:
// - Marching runs from the first support's beginning to the last one's end, of the metaballs the
//   node has found, inside the node and outside.
// - The step follows Singh and Narayanan's two measures: it shortens with the field's distance from
//   the threshold and where the ray runs along the surface (kNear, kHorizon below). A change of
//   sign between two points is narrowed by bisection.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "metaball/camera.h"
#include "metaball/methods/hit_pixel.h"
#include "metaball/methods/ray_metaball.h"
#include "metaball/scene.h"
#include "metaball/thesis/octree.h"
#include "metaball/thesis/thesis_renderer.h"

namespace sherd {

// What all rays of a frame share.
struct ThesisFrame {
  const Cloud* cloud = nullptr;
  const MortonOctree* octree = nullptr;
  Surface surface;
  ThesisOptions options;
  MethodDensity density;
  bool monotone = true;       // the density falls from the centre outwards
  double uniform_iso = -1.0;  // u at which a lone metaball of the surface's threshold has its
                              // surface; < 0: nowhere

  bool gated() const { return options.gated || surface.mode == ThresholdMode::kGated; }
  double ThresholdOf(std::uint32_t i) const {
    return surface.mode == ThresholdMode::kUniform || cloud->threshold.empty()
               ? surface.threshold
               : static_cast<double>(cloud->threshold[i]);
  }
  double SupportRadiusOf(std::uint32_t i) const {
    return static_cast<double>(cloud->RadiusOf(i)) * surface.radius_scale *
           density.resolved.support;
  }
};

ThesisFrame PrepareThesisFrame(const Scene& scene, const MortonOctree& octree,
                               const ThesisOptions& options);

// The search of one ray after another; one object a thread.
class ThesisSearch {
 public:
  explicit ThesisSearch(const ThesisFrame& frame) : frame_(&frame) {}

  // The depth of the crossing that ends the search, local units along the ray.
  std::optional<double> Trace(const RayD& local_ray, RayCounts* counts);
  // The metaballs at the crossing that Trace has just found.
  HitSums Gather(double depth) const;

 private:
  struct Taken {
    RayMetaball met;
    Vec3d across;  // from the ray's closest approach to the centre
  };

  void Take(std::uint32_t node);
  std::optional<double> SearchNode(RayCounts* counts) const;
  std::optional<double> SolveLone(const Taken& taken) const;
  std::optional<double> March(RayCounts* counts) const;
  // The surface is where this becomes positive; never more negative than the threshold.
  double Level(double t) const;
  // The cosine between the ray and the field's gradient, without sign.
  double Horizon(double t) const;

  const ThesisFrame* frame_;
  RayD ray_;
  std::vector<Taken> taken_;
};

}  // namespace sherd
