// No guard: see shapes.h.
#include "metaball/density/stretch-inl.h"
//
#include "metaball/density/power-inl.h"
//
#include "metaball/density/cone-inl.h"
#include "metaball/density/cosine-inl.h"
#include "metaball/density/cubic-inl.h"
#include "metaball/density/gaussian-inl.h"
#include "metaball/density/nishimura-inl.h"
#include "metaball/density/reciprocal-inl.h"
#include "metaball/density/wyvill-inl.h"
//
#include "metaball/density/bounds-inl.h"

// (1 - u)^N with N known to the compiler.
template <int N>
struct FixedPowerShape : PowerShape {
  // Value and slope are 0 where the support ends.
  static constexpr bool kFlatRim = N >= 2;

  SHERD_FORMULA FixedPowerShape() : PowerShape{N} {}
  template <class T>
  SHERD_FORMULA T Value(T u) const {
    return IntegerPower(T(1) - u, N);
  }
  template <class T>
  SHERD_FORMULA T Slope(T u) const {
    return T(-N) * IntegerPower(T(1) - u, N - 1);
  }
};
using LinearShape = FixedPowerShape<1>;
using MurakamiShape = FixedPowerShape<2>;
using CubeShape = FixedPowerShape<3>;

// The bound to use for a shape: its own polynomial where it is one of low degree, that of the
// second derivative elsewhere.
template <class T, class Shape>
struct TightBound : CurvatureBound<T, Shape> {
  SHERD_FORMULA explicit TightBound(const Shape& own) : CurvatureBound<T, Shape>(own) {}
};
template <class T>
struct TightBound<T, LinearShape> : LinearBound<T> {
  SHERD_FORMULA explicit TightBound(const LinearShape&) {}
};
template <class T>
struct TightBound<T, MurakamiShape> : SquareBound<T> {
  SHERD_FORMULA explicit TightBound(const MurakamiShape&) {}
};
template <class T>
struct TightBound<T, CubeShape> : CubeBound<T, 0> {
  SHERD_FORMULA explicit TightBound(const CubeShape&) {}
};
template <class T>
struct TightBound<T, WyvillShape> : CubeBound<T, 5> {
  SHERD_FORMULA explicit TightBound(const WyvillShape&) {}
};

// Calls f(shape) with the shape's own type.
template <class F>
SHERD_FORMULA decltype(auto) WithShape(const DensityShape& shape, F&& f) {
  switch (shape.kind) {
    case ShapeKind::kWyvill:
      return f(WyvillShape{});
    case ShapeKind::kNishimura:
      return f(NishimuraShape{});
    case ShapeKind::kGaussian:
      return f(GaussianShape{});
    case ShapeKind::kCone:
      return f(ConeShape{});
    case ShapeKind::kReciprocal:
      return f(ReciprocalShape{});
    case ShapeKind::kCubic:
      return f(CubicShape{});
    case ShapeKind::kCosine:
      return f(CosineShape{shape.degree});
    case ShapeKind::kPower:
      break;
  }
  switch (shape.degree) {
    case 1:
      return f(LinearShape{});
    case 2:
      return f(MurakamiShape{});
    case 3:
      return f(CubeShape{});
    default:
      return f(PowerShape{shape.degree});
  }
}

// Any shape, chosen at run time by every call: where a type for each would be too many. The
// brackets around WithShape keep a vector's namespace from finding the scalar one as well.
struct AnyShape {
  DensityShape shape;

  template <class T>
  SHERD_FORMULA T Value(T u) const {
    return (WithShape)(shape, [u](const auto& s) SHERD_FORMULA_LAMBDA { return s.Value(u); });
  }
  template <class T>
  SHERD_FORMULA T Slope(T u) const {
    return (WithShape)(shape, [u](const auto& s) SHERD_FORMULA_LAMBDA { return s.Slope(u); });
  }
  template <class T>
  SHERD_FORMULA T Concavity(const Stretch<T>& x) const {
    return (WithShape)(shape, [&x](const auto& s) SHERD_FORMULA_LAMBDA { return s.Concavity(x); });
  }
  template <class T>
  SHERD_FORMULA T Convexity(const Stretch<T>& x) const {
    return (WithShape)(shape, [&x](const auto& s) SHERD_FORMULA_LAMBDA { return s.Convexity(x); });
  }
  SHERD_FORMULA float Steepest() const {
    return (WithShape)(shape, [](const auto& s) SHERD_FORMULA_LAMBDA { return s.Steepest(); });
  }
  SHERD_FORMULA float RimSlope() const {
    return (WithShape)(shape, [](const auto& s) SHERD_FORMULA_LAMBDA { return s.RimSlope(); });
  }
};
