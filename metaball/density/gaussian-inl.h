// No guard: see shapes.h.
//
// Blinn's density (thesis 2.1) once its support is cut where the tail is kBlinnTail = e^-A of the
// amplitude, and lowered by that much: e^(-A u) - e^-A.

struct GaussianShape {
  static constexpr double kA = 13.815510557964274;  // -ln kBlinnTail
  static constexpr double kTail = 1e-6;

  template <class T>
  SHERD_FORMULA T Value(T u) const {
    return Exponential(T(-kA) * u) - T(kTail);
  }
  template <class T>
  SHERD_FORMULA T Slope(T u) const {
    return T(-kA) * Exponential(T(-kA) * u);
  }
  // -f'' = 2A e^(-A u) w,  w = 1 - 2A s^2, as for power-inl.h.
  template <class T>
  SHERD_FORMULA T Concavity(const Stretch<T>& x) const {
    const T w = T(1) - T(2 * kA) * x.near2;
    return T(2 * kA) * w * Exponential(T(-kA) * Where(w > T(0), x.u_min, x.u_max));
  }
  // Largest where A u = 3/2 on a ray through the centre.
  template <class T>
  SHERD_FORMULA T Convexity(const Stretch<T>&) const {
    return T(4 * kA * 0.22313016014842982);
  }
  SHERD_FORMULA float Steepest() const { return 3.1883f; }  // sqrt(2A / e)
  SHERD_FORMULA float RimSlope() const { return static_cast<float>(2.1 * kA * kTail); }
};
