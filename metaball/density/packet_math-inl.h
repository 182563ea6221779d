// No guard: included by packet_tracer-inl.h once for each instruction set, inside its namespace.
//
// The words of scalar_math.h for a vector of numbers, one a ray (Highway).

template <class Real>
struct Lanes {
  using D = hn::CappedTag<Real, 16>;
  using V = hn::Vec<D>;
  V v;

  HWY_INLINE Lanes() = default;
  HWY_INLINE Lanes(V value) : v(value) {}
  HWY_INLINE explicit Lanes(double value) : v(hn::Set(D(), static_cast<Real>(value))) {}
  HWY_INLINE explicit Lanes(float value) : v(hn::Set(D(), static_cast<Real>(value))) {}
  HWY_INLINE explicit Lanes(int value) : v(hn::Set(D(), static_cast<Real>(value))) {}

  static HWY_INLINE int Count() { return static_cast<int>(hn::Lanes(D())); }
  static HWY_INLINE Lanes Load(const Real* from) { return hn::LoadU(D(), from); }
  HWY_INLINE void Store(Real* to) const { hn::StoreU(v, D(), to); }

  friend HWY_INLINE Lanes operator+(Lanes a, Lanes b) { return hn::Add(a.v, b.v); }
  friend HWY_INLINE Lanes operator-(Lanes a, Lanes b) { return hn::Sub(a.v, b.v); }
  friend HWY_INLINE Lanes operator*(Lanes a, Lanes b) { return hn::Mul(a.v, b.v); }
  friend HWY_INLINE Lanes operator/(Lanes a, Lanes b) { return hn::Div(a.v, b.v); }
};

template <class Real>
struct LaneMask {
  using M = hn::Mask<typename Lanes<Real>::D>;
  M m;

  HWY_INLINE LaneMask() = default;
  HWY_INLINE LaneMask(M mask) : m(mask) {}
  HWY_INLINE bool None() const { return hn::AllFalse(typename Lanes<Real>::D(), m); }
  HWY_INLINE std::uint32_t Count() const {
    return static_cast<std::uint32_t>(hn::CountTrue(typename Lanes<Real>::D(), m));
  }
};

#define SHERD_LANE_COMPARISON(op, name)                                               \
  template <class Real>                                                               \
  HWY_INLINE LaneMask<Real> operator op(const Lanes<Real>& a, const Lanes<Real>& b) { \
    return hn::name(a.v, b.v);                                                        \
  }
SHERD_LANE_COMPARISON(<, Lt)
SHERD_LANE_COMPARISON(<=, Le)
SHERD_LANE_COMPARISON(>, Gt)
SHERD_LANE_COMPARISON(>=, Ge)
#undef SHERD_LANE_COMPARISON

template <class Real>
HWY_INLINE LaneMask<Real> Not(LaneMask<Real> a) {
  return hn::Not(a.m);
}
template <class Real>
HWY_INLINE LaneMask<Real> Both(LaneMask<Real> a, LaneMask<Real> b) {
  return hn::And(a.m, b.m);
}
template <class Real>
HWY_INLINE LaneMask<Real> Either(LaneMask<Real> a, LaneMask<Real> b) {
  return hn::Or(a.m, b.m);
}
template <class Real>
HWY_INLINE Lanes<Real> Where(LaneMask<Real> c, Lanes<Real> a, Lanes<Real> b) {
  return hn::IfThenElse(c.m, a.v, b.v);
}
template <class Real>
HWY_INLINE Lanes<Real> Max(Lanes<Real> a, Lanes<Real> b) {
  return hn::Max(a.v, b.v);
}
template <class Real>
HWY_INLINE Lanes<Real> Min(Lanes<Real> a, Lanes<Real> b) {
  return hn::Min(a.v, b.v);
}
template <class Real>
HWY_INLINE Lanes<Real> Absolute(Lanes<Real> a) {
  return hn::Abs(a.v);
}
template <class Real>
HWY_INLINE Real LargestOf(Lanes<Real> a) {
  return hn::GetLane(hn::MaxOfLanes(typename Lanes<Real>::D(), a.v));
}
template <class Real>
HWY_INLINE Lanes<Real> SquareRoot(Lanes<Real> a) {
  return hn::Sqrt(a.v);
}
template <class Real>
HWY_INLINE Lanes<Real> Exponential(Lanes<Real> a) {
  return hn::Exp(typename Lanes<Real>::D(), a.v);
}
template <class Real>
HWY_INLINE Lanes<Real> CosineOf(Lanes<Real> a) {
  return hn::Cos(typename Lanes<Real>::D(), a.v);
}
template <class Real>
HWY_INLINE Lanes<Real> SineOf(Lanes<Real> a) {
  return hn::Sin(typename Lanes<Real>::D(), a.v);
}
