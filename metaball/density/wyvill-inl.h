// No guard: see shapes.h.
//
// Wyvill's density (thesis 2.3): 1 - 22/9 u + 17/9 u^2 - 4/9 u^3 = 5/9 q^2 + 4/9 q^3, q = 1 - u.

struct WyvillShape {
  template <class T>
  SHERD_FORMULA T Value(T u) const {
    const T q = T(1) - u;
    return q * q * (T(5.0 / 9.0) + T(4.0 / 9.0) * q);
  }
  template <class T>
  SHERD_FORMULA T Slope(T u) const {
    const T q = T(1) - u;
    return T(-10.0 / 9.0) * q - T(12.0 / 9.0) * q * q;
  }
  // The bounds of q^2 and q^3 (power-inl.h), added.
  template <class T>
  SHERD_FORMULA T Concavity(const Stretch<T>& x) const {
    return T(5.0 / 9.0) * PowerShape{2}.Concavity(x) + T(4.0 / 9.0) * PowerShape{3}.Concavity(x);
  }
  // f'' = -44/9 + 204/9 x^2 - 120/9 x^4 on a ray through the centre, largest at x^2 = 0.85.
  template <class T>
  SHERD_FORMULA T Convexity(const Stretch<T>&) const {
    return T(4.7445);
  }
  // At f'' = 0, x^2 = (204 - sqrt(204^2 - 4 * 120 * 44)) / 240.
  SHERD_FORMULA float Steepest() const { return 1.5837f; }
  SHERD_FORMULA float RimSlope() const { return 0.0f; }
};
