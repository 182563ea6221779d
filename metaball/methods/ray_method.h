// What a rival method provides: the first crossing along a ray. Everything around it (tiles, rays,
// shading, planes, counts) is shared, so that what is measured is the search.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "metaball/methods/methods.h"
#include "metaball/methods/ray_field.h"
#include "metaball/renderer.h"
#include "metaball/tile_march.h"

namespace sherd {

class RayMethod {
 public:
  virtual ~RayMethod() = default;

  // Throws Error for a surface the method cannot draw. Called before the rays of a frame.
  virtual void Prepare(const MethodSurface& surface) = 0;
  // The first t >= 0 inside (RayField::Excess >= 0), as far as the method can tell. From several
  // threads.
  virtual std::optional<double> FirstCrossing(RayField* field, RayCounts* counts) const = 0;
};

// The methods, each in the file of its name, where what it guarantees is said.
std::unique_ptr<RayMethod> MakeFixedMarch(const MethodOptions& options);
std::unique_ptr<RayMethod> MakeAdaptiveMarch(const MethodOptions& options);
std::unique_ptr<RayMethod> MakeSphereTracing(const MethodOptions& options);
std::unique_ptr<RayMethod> MakeInterval(const MethodOptions& options);
std::unique_ptr<RayMethod> MakePolynomial(const MethodOptions& options);

// name: how the frame's statistics call it.
std::unique_ptr<Renderer> MakeRayMethodRenderer(std::string name,
                                                std::unique_ptr<RayMethod> method);

// Steps along a ray after which a method gives it up as unresolved.
inline constexpr int kMaxSteps = 100000;

// Narrows [t0, t1], where t0 lies outside and t1 inside, to `width` and returns its end, which lies
// inside.
double Bisect(const RayField& field, double t0, double t1, double width);

// The width of the bracket in which a crossing at t is accepted: never finer than the doubles.
inline double BracketAt(const RayField& field, double tolerance, double t) {
  const double wanted = tolerance * field.smallest(), finest = 1e-14 * t;
  return wanted > finest ? wanted : finest;
}

}  // namespace sherd
