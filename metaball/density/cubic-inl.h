// No guard: see shapes.h.
//
// (1 - x)^2 (1 + x), x = sqrt(u): the ramp of degree 3 (thesis A.2).

struct CubicShape {
  template <class T>
  SHERD_FORMULA T Value(T u) const {
    return (T(1) - SquareRoot(u)) * (T(1) - u);
  }
  // f = 1 - x - x^2 + x^3, df/du = f' / (2x).
  template <class T>
  SHERD_FORMULA T Slope(T u) const {
    const T x = SquareRoot(Max(u, T(ConeShape::kTip)));
    return T(-0.5) / x - T(1) + T(1.5) * x;
  }
  // -f'' = 2 - 6 x + across^2 (1 / x^3 + 3 / x), which falls with x.
  template <class T>
  SHERD_FORMULA T Concavity(const Stretch<T>& x) const {
    const T u = Max(x.u_min, T(ConeShape::kTip));
    const T root = SquareRoot(u);
    return T(2) - T(6) * root + Max(x.across2, T(ConeShape::kTip)) * (T(1) / u + T(3)) / root;
  }
  template <class T>
  SHERD_FORMULA T Convexity(const Stretch<T>& x) const {
    return Max(T(6) * SquareRoot(x.u_max) - T(2), T(0));
  }
  SHERD_FORMULA float Steepest() const { return 4.0f / 3.0f; }  // at x = 1/3
  SHERD_FORMULA float RimSlope() const { return 0.0f; }
};
