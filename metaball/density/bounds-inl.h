// No guard: see shapes.h.
//
// Upper bounds of a sum of densities on a segment of a ray, as polynomials in Bernstein form over
// the segment: c[0] and c[N] are the field's own values at the two ends, and between them the
// polynomial lies nowhere below the field.
//
// A metaball is added with s0 and s1, the segment's ends in radii of its support along the ray from
// the point of closest approach, and across2, that point's squared distance from the centre. Bounds
// that work on the parabola below also take its h instead (AddParabola).

template <class T, int N>
struct Bernstein {
  static constexpr int kDegree = N;
  T c[N + 1];
};

// ---- Polynomial shapes: Bernstein coefficients of q = 1 - u, clamped --------------------------
//
// On [s0, s1] the parabola q(s) = h - s^2, h = 1 - across2, has the Bernstein coefficients
//     q0 = h - s0^2,  q1 = h - s0 s1,  q2 = h - s1^2.
// Clamped at zero they give a polynomial Q >= 0 with Q - q >= 0 (all its coefficients are
// non-negative), so p(Q) >= p(max(q, 0)) for every polynomial p with coefficients >= 0, also where
// the support begins or ends inside the segment; equal at both ends, and everywhere if no qi was
// negative.

template <class T>
struct ClampedParabola {
  T a, b, d;  // Bernstein coefficients of Q
  SHERD_FORMULA ClampedParabola(T s0, T s1, T h) {
    a = Max(h - s0 * s0, T(0));
    b = Max(h - s0 * s1, T(0));
    d = Max(h - s1 * s1, T(0));
  }
};

// Q: ramp of degree 2.
template <class T>
struct LinearBound {
  static constexpr bool kTakesParabola = true;
  using Bound = Bernstein<T, 2>;
  T c0 = T(0), c1 = T(0), c2 = T(0);

  SHERD_FORMULA LinearBound() {}
  SHERD_FORMULA void Add(T s0, T s1, T across2) { AddParabola(s0, s1, T(1) - across2); }
  SHERD_FORMULA void AddParabola(T s0, T s1, T h) {
    const ClampedParabola<T> q(s0, s1, h);
    c0 = c0 + q.a;
    c1 = c1 + q.b;
    c2 = c2 + q.d;
  }
  SHERD_FORMULA Bound Sum() const { return {{c0, c1, c2}}; }
};

// Q^2: Murakami.
template <class T>
struct SquareBound {
  static constexpr bool kTakesParabola = true;
  using Bound = Bernstein<T, 4>;
  T c0 = T(0), c1 = T(0), c2a = T(0), c2b = T(0), c3 = T(0), c4 = T(0);

  SHERD_FORMULA SquareBound() {}
  SHERD_FORMULA void Add(T s0, T s1, T across2) { AddParabola(s0, s1, T(1) - across2); }
  SHERD_FORMULA void AddParabola(T s0, T s1, T h) {
    const ClampedParabola<T> q(s0, s1, h);
    c0 = c0 + q.a * q.a;
    c1 = c1 + q.a * q.b;
    c2a = c2a + q.a * q.d;
    c2b = c2b + q.b * q.b;
    c3 = c3 + q.b * q.d;
    c4 = c4 + q.d * q.d;
  }
  SHERD_FORMULA Bound Sum() const { return {{c0, c1, (c2a + T(2) * c2b) * T(1.0 / 3.0), c3, c4}}; }
};

// Q^2 (k + m Q): Wyvill with k = 5/9, m = 4/9; (1 - u)^3 with k = 0, m = 1.
template <class T, int kNinthsOfSquare>
struct CubeBound {
  static constexpr bool kTakesParabola = true;
  using Bound = Bernstein<T, 6>;
  T c0 = T(0), c1 = T(0), c2 = T(0), c3 = T(0), c4 = T(0), c5 = T(0), c6 = T(0);

  SHERD_FORMULA CubeBound() {}
  SHERD_FORMULA void Add(T s0, T s1, T across2) { AddParabola(s0, s1, T(1) - across2); }
  SHERD_FORMULA void AddParabola(T s0, T s1, T h) {
    const ClampedParabola<T> q(s0, s1, h);
    const T k = T(kNinthsOfSquare / 9.0), m = T(1.0 - kNinthsOfSquare / 9.0);
    // The coefficients of Q^2 and of k + m Q, and of their product.
    const T f0 = q.a * q.a, f1 = q.a * q.b, f3 = q.b * q.d, f4 = q.d * q.d;
    const T f2 = (q.a * q.d + T(2) * q.b * q.b) * T(1.0 / 3.0);
    const T g0 = k + m * q.a, g1 = k + m * q.b, g2 = k + m * q.d;
    c0 = c0 + f0 * g0;
    c1 = c1 + (f0 * g1 + T(2) * f1 * g0) * T(1.0 / 3.0);
    c2 = c2 + (f0 * g2 + T(8) * f1 * g1 + T(6) * f2 * g0) * T(1.0 / 15.0);
    c3 = c3 + (f1 * g2 + T(3) * f2 * g1 + f3 * g0) * T(0.2);
    c4 = c4 + (f4 * g0 + T(8) * f3 * g1 + T(6) * f2 * g2) * T(1.0 / 15.0);
    c5 = c5 + (f4 * g1 + T(2) * f3 * g2) * T(1.0 / 3.0);
    c6 = c6 + f4 * g2;
  }
  SHERD_FORMULA Bound Sum() const { return {{c0, c1, c2, c3, c4, c5, c6}}; }
};

// ---- Any shape: the chord and a bound of the second derivative ---------------------------------
//
// Where -f'' <= m on a segment of length d, f lies below its chord + m/2 (s - s0) (s1 - s), a
// parabola whose middle Bernstein coefficient stands m d^2 / 4 above the chord's. Where the support
// begins or ends inside the segment f is 0 outside: m >= 0 covers that as long as f rises from
// there; where it dips (a negative lobe at the rim) the kink of slope j adds 2 j / d, twice when
// the whole support lies inside. And for any function with slopes up to l, m = 8 l / d is enough.
// With the signs turned the same gives a lower bound.

template <class T>
struct EndsAndBends {
  T f0, f1;      // the density at the ends
  T concave_d2;  // m d^2
  T convex_d2;   // the same for f'' <= m; only where it is asked for
};

template <bool kLower, class T, class Shape>
SHERD_FORMULA EndsAndBends<T> BendsOf(const Shape& shape, T s0, T s1, T across2) {
  const T one = T(1), zero = T(0);
  const T u0 = across2 + s0 * s0, u1 = across2 + s1 * s1;
  const T near = Max(s0, zero) + Max(zero - s1, zero);
  Stretch<T> x;
  x.across2 = across2;
  x.near2 = near * near;
  x.u_min = Min(across2 + x.near2, one);
  x.u_max = Min(Max(u0, u1), one);
  const auto in0 = u0 < one;
  const auto in1 = u1 < one;
  const auto inside = Both(in0, in1);
  const auto outside = Not(x.u_min < one);
  const T d = s1 - s0;
  const T steepest_d = T(8.0f * shape.Steepest()) * d;
  const T kink_d = T(4.0f) * d;
  const float rim = shape.RimSlope();

  EndsAndBends<T> r;
  r.f0 = Where(in0, shape.Value(Min(u0, one)), zero);
  r.f1 = Where(in1, shape.Value(Min(u1, one)), zero);
  const T concave = shape.Concavity(x) * d * d;
  const T concave_rim = Max(concave, zero) + T(rim < 0.0f ? -rim : 0.0f) * kink_d;
  r.concave_d2 = Where(outside, zero, Min(Where(inside, concave, concave_rim), steepest_d));
  if constexpr (kLower) {
    const T convex = shape.Convexity(x) * d * d;
    const T convex_rim = Max(convex, zero) + T(rim > 0.0f ? rim : 0.0f) * kink_d;
    r.convex_d2 = Where(outside, zero, Min(Where(inside, convex, convex_rim), steepest_d));
  }
  return r;
}

template <class T, class ShapeT>
struct CurvatureBound {
  static constexpr bool kTakesParabola = false;
  using Bound = Bernstein<T, 2>;
  ShapeT shape;
  T f0 = T(0), f1 = T(0), bend = T(0);

  SHERD_FORMULA explicit CurvatureBound(const ShapeT& own) : shape(own) {}
  SHERD_FORMULA void Add(T s0, T s1, T across2) {
    const EndsAndBends<T> x = BendsOf<false>(shape, s0, s1, across2);
    f0 = f0 + x.f0;
    f1 = f1 + x.f1;
    bend = bend + x.concave_d2;
  }
  SHERD_FORMULA Bound Sum() const { return {{f0, T(0.5) * (f0 + f1) + T(0.25) * bend, f1}}; }
};

// For blended thresholds: an upper bound of A = sum f and a lower bound of B = sum f T_k.
template <class T, class ShapeT>
struct BlendedBound {
  ShapeT shape;
  T a0 = T(0), a1 = T(0), a_bend = T(0);
  T b0 = T(0), b1 = T(0), b_bend = T(0);

  SHERD_FORMULA explicit BlendedBound(const ShapeT& own) : shape(own) {}
  SHERD_FORMULA void Add(T s0, T s1, T across2, T threshold) {
    const EndsAndBends<T> x = BendsOf<true>(shape, s0, s1, across2);
    a0 = a0 + x.f0;
    a1 = a1 + x.f1;
    a_bend = a_bend + x.concave_d2;
    b0 = b0 + threshold * x.f0;
    b1 = b1 + threshold * x.f1;
    b_bend = b_bend + threshold * x.convex_d2;
  }
  // A upper, raised to degree 4.
  SHERD_FORMULA Bernstein<T, 4> Weight() const {
    const T m = T(0.5) * (a0 + a1) + T(0.25) * a_bend;
    return {{a0, T(0.5) * (a0 + m), (a0 + T(4) * m + a1) * T(1.0 / 6.0), T(0.5) * (m + a1), a1}};
  }
  // An upper bound of A^2 - B, which is >= 0 where A >= B / A and A > 0. A's bound is not below A,
  // and A >= 0, so the squares keep that order.
  SHERD_FORMULA Bernstein<T, 4> Excess() const {
    const T m = T(0.5) * (a0 + a1) + T(0.25) * a_bend;
    const T l = T(0.5) * (b0 + b1) - T(0.25) * b_bend;
    return {{a0 * a0 - b0, a0 * m - T(0.5) * (b0 + l),
             (a0 * a1 + T(2) * m * m) * T(1.0 / 3.0) - (b0 + T(4) * l + b1) * T(1.0 / 6.0),
             m * a1 - T(0.5) * (l + b1), a1 * a1 - b1}};
  }
};
