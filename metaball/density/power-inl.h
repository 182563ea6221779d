// No guard: see shapes.h.
//
// (1 - u)^n: the thesis's Murakami (2.4) for n = 2, its ramps of degree 2 and 4 (A.2) for n = 1 and
// 2, and the generalised exponent of Gourmel et al. (2010).

struct PowerShape {
  int n;  // >= 1

  template <class T>
  SHERD_FORMULA T Value(T u) const {
    return IntegerPower(T(1) - u, n);
  }
  template <class T>
  SHERD_FORMULA T Slope(T u) const {
    return T(-n) * IntegerPower(T(1) - u, n - 1);
  }
  // With q = 1 - u:  -f'' = 2n q^(n-2) w,  w = q - 2(n-1) s^2 = 1 - across^2 - (2n-1) s^2.
  // w falls with s^2; the factor is at most its value at u_min, or at u_max where w is negative.
  template <class T>
  SHERD_FORMULA T Concavity(const Stretch<T>& x) const {
    if (n == 1) return T(2);
    const T w = T(1) - x.across2 - T(2 * n - 1) * x.near2;
    const T q = T(1) - Where(w > T(0), x.u_min, x.u_max);
    return T(2 * n) * w * IntegerPower(q, n - 2);
  }
  // The largest second derivative of all: at u = 3 / (2n-1) on a ray through the centre.
  template <class T>
  SHERD_FORMULA T Convexity(const Stretch<T>&) const {
    if (n == 1) return T(-2);
    return T(4 * n) * IntegerPower(T(1) - T(3) / T(2 * n - 1), n - 2);
  }
  // The largest |df/dx|, x = sqrt(u): at u = 1 / (2n-1).
  SHERD_FORMULA float Steepest() const {
    const float u = 1.0f / static_cast<float>(2 * n - 1);
    return static_cast<float>(2 * n) * sqrtf(u) * IntegerPower(1.0f - u, n - 1);
  }
  // -df/dx at the rim, x = 1.
  SHERD_FORMULA float RimSlope() const { return n == 1 ? 2.0f : 0.0f; }
};
