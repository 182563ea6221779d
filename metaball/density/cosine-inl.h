// No guard: see shapes.h.
//
// cos(w x), x = sqrt(u), w = (k + 1/2) pi: the trigonometric density (thesis 2.7) up to a zero.
// Every second lobe is negative, the last one when k is odd.

struct CosineShape {
  int k;  // >= 0

  SHERD_FORMULA double Rate() const { return (k + 0.5) * 3.14159265358979323846; }
  template <class T>
  SHERD_FORMULA T Value(T u) const {
    return CosineOf(T(Rate()) * SquareRoot(u));
  }
  template <class T>
  SHERD_FORMULA T Slope(T u) const {
    const T x = SquareRoot(Max(u, T(ConeShape::kTip)));
    return T(-0.5 * Rate()) * SineOf(T(Rate()) * x) / x;
  }
  // f'' = -w^2 cos(w x) s^2 / u - w sin(w x) / x across^2 / u; neither factor exceeds w^2.
  template <class T>
  SHERD_FORMULA T Concavity(const Stretch<T>&) const {
    return T(Rate() * Rate());
  }
  template <class T>
  SHERD_FORMULA T Convexity(const Stretch<T>&) const {
    return T(Rate() * Rate());
  }
  SHERD_FORMULA float Steepest() const { return static_cast<float>(Rate()); }
  SHERD_FORMULA float RimSlope() const { return static_cast<float>(k % 2 ? -Rate() : Rate()); }
};
