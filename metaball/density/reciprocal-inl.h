// No guard: see shapes.h.
//
// 1 / x - 1, the reciprocal of the ratio (thesis 2.5), with x softened at the centre, where it is
// singular: 1 / sqrt(u + e^2) - 1 / sqrt(1 + e^2), e = kReciprocalCore.

struct ReciprocalShape {
  static constexpr double kCore2 = 1e-6;
  static constexpr double kAtRim = 0.99999950000037500;  // 1 / sqrt(1 + kCore2)

  template <class T>
  SHERD_FORMULA T Value(T u) const {
    return T(1) / SquareRoot(u + T(kCore2)) - T(kAtRim);
  }
  template <class T>
  SHERD_FORMULA T Slope(T u) const {
    const T v = u + T(kCore2);
    return T(-0.5) / (v * SquareRoot(v));
  }
  // With v = u + e^2:  -f'' = v^(-5/2) w,  w = across^2 + e^2 - 2 s^2, as for power-inl.h.
  template <class T>
  SHERD_FORMULA T Concavity(const Stretch<T>& x) const {
    const T w = x.across2 + T(kCore2) - T(2) * x.near2;
    const T v = Where(w > T(0), x.u_min, x.u_max) + T(kCore2);
    return w / (v * v * SquareRoot(v));
  }
  template <class T>
  SHERD_FORMULA T Convexity(const Stretch<T>& x) const {
    const T v = x.u_min + T(kCore2);
    return T(2) / (v * SquareRoot(v));
  }
  SHERD_FORMULA float Steepest() const { return 0.385f / static_cast<float>(kCore2); }
  SHERD_FORMULA float RimSlope() const { return 1.0f; }
};
