// No guard: see shapes.h.
//
// 1 - x, x = sqrt(u): the ratio (thesis 2.5, A.1) and the ramp of degree 1 (thesis 2.6).

struct ConeShape {
  // Nearer to the centre than this the derivative by u is that of the rim of the tip.
  static constexpr double kTip = 1e-12;

  template <class T>
  SHERD_FORMULA T Value(T u) const {
    return T(1) - SquareRoot(u);
  }
  template <class T>
  SHERD_FORMULA T Slope(T u) const {
    return T(-0.5) / SquareRoot(Max(u, T(kTip)));
  }
  // -f'' = across^2 / x^3. On a ray through the tip it has no bound; Steepest limits the bound
  // then.
  template <class T>
  SHERD_FORMULA T Concavity(const Stretch<T>& x) const {
    const T u = Max(x.u_min, T(kTip));
    return Max(x.across2, T(kTip)) / (u * SquareRoot(u));
  }
  template <class T>
  SHERD_FORMULA T Convexity(const Stretch<T>&) const {
    return T(0);
  }
  SHERD_FORMULA float Steepest() const { return 1.0f; }
  SHERD_FORMULA float RimSlope() const { return 1.0f; }
};
