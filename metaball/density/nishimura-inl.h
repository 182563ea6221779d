// No guard: see shapes.h.
//
// Nishimura's density (thesis 2.2): 1 - 3 x^2 up to x = 1/3, then 3/2 (1 - x)^2; x = sqrt(u).

struct NishimuraShape {
  template <class T>
  SHERD_FORMULA T Value(T u) const {
    const T rest = T(1) - SquareRoot(u);
    return Where(u < T(1.0 / 9.0), T(1) - T(3) * u, T(1.5) * rest * rest);
  }
  template <class T>
  SHERD_FORMULA T Slope(T u) const {
    const T outer = Max(u, T(1.0 / 9.0));
    return Where(u < T(1.0 / 9.0), T(-3), T(1.5) - T(1.5) / SquareRoot(outer));
  }
  // -f'' is 6 inside; outside it is 3 (across^2 / x^3 - 1), which falls with x.
  template <class T>
  SHERD_FORMULA T Concavity(const Stretch<T>& x) const {
    const T u = Max(x.u_min, T(1.0 / 9.0));
    const T outer = T(3) * (x.across2 / (u * SquareRoot(u)) - T(1));
    return Where(x.u_min < T(1.0 / 9.0), T(6), outer);
  }
  template <class T>
  SHERD_FORMULA T Convexity(const Stretch<T>&) const {
    return T(3);
  }
  SHERD_FORMULA float Steepest() const { return 2.0f; }
  SHERD_FORMULA float RimSlope() const { return 0.0f; }
};
