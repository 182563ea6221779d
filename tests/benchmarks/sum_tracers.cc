#include "sum_tracers.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/benchmarks/sum_tracers.cc"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

#include "metaball/packet_tracer-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sherd {
namespace HWY_NAMESPACE {

// A sum and what its additions have lost: two-sum (Knuth, TAOCP 2, 4.2.2), right whatever the sizes
// and signs.
template <class T>
struct CompensatedSum {
  T sum = T(0), lost = T(0);

  HWY_INLINE CompensatedSum() {}
  HWY_INLINE void Add(T v) {
    const T s = sum + v;
    const T added = s - sum;
    lost = lost + ((sum - (s - added)) + (v - added));
    sum = s;
  }
  HWY_INLINE T Total() const { return sum + lost; }
};

struct CompensatedMurakami : MurakamiShape {};
struct CompensatedCosine : CosineShape {};

// SquareBound and CurvatureBound with every sum compensated.
template <class T>
struct TightBound<T, CompensatedMurakami> {
  static constexpr bool kTakesParabola = true;
  CompensatedSum<T> c0, c1, c2a, c2b, c3, c4;

  HWY_INLINE explicit TightBound(const CompensatedMurakami&) {}
  HWY_INLINE void AddParabola(T s0, T s1, T h) {
    const ClampedParabola<T> q(s0, s1, h);
    c0.Add(q.a * q.a);
    c1.Add(q.a * q.b);
    c2a.Add(q.a * q.d);
    c2b.Add(q.b * q.b);
    c3.Add(q.b * q.d);
    c4.Add(q.d * q.d);
  }
  HWY_INLINE Bernstein<T, 4> Sum() const {
    return {{c0.Total(), c1.Total(), (c2a.Total() + T(2) * c2b.Total()) * T(1.0 / 3.0), c3.Total(),
             c4.Total()}};
  }
};
template <class T>
struct TightBound<T, CompensatedCosine> {
  static constexpr bool kTakesParabola = false;
  CompensatedCosine shape;
  CompensatedSum<T> f0, f1;
  T bend = T(0);

  HWY_INLINE explicit TightBound(const CompensatedCosine& own) : shape(own) {}
  HWY_INLINE void Add(T s0, T s1, T across2) {
    const EndsAndBends<T> x = BendsOf<false>(shape, s0, s1, across2);
    f0.Add(x.f0);
    f1.Add(x.f1);
    bend = bend + x.concave_d2;
  }
  HWY_INLINE Bernstein<T, 2> Sum() const {
    const T a = f0.Total(), b = f1.Total();
    return {{a, T(0.5) * (a + b) + T(0.25) * bend, b}};
  }
};

template <class Real, class Shape>
void TraceShape(const TraceJob& job, const Shape& shape, int tile, TraceCounts* counts) {
  using Tracer = PacketTracer<ThresholdMode::kUniform, Real, true, Shape>;
  static thread_local typename Tracer::Memory memory;
  Tracer(job, shape, tile, &memory, counts).Run(tile);
}

template <class Plain, class Compensated>
void TraceSums(const TraceJob& job, const Plain& plain, const Compensated& compensated, Sums sums,
               int tile, TraceCounts* counts) {
  switch (sums) {
    case Sums::kPlain:
      return TraceShape<float>(job, plain, tile, counts);
    case Sums::kCompensated:
      return TraceShape<float>(job, compensated, tile, counts);
    case Sums::kDouble:
      return TraceShape<double>(job, plain, tile, counts);
  }
}

void Trace(const TraceJob& job, Sums sums, int tile, TraceCounts* counts) {
  if (job.shape.kind == ShapeKind::kCosine) {
    const int k = job.shape.degree;
    TraceSums(job, CosineShape{k}, CompensatedCosine{{k}}, sums, tile, counts);
  } else {
    TraceSums(job, MurakamiShape{}, CompensatedMurakami{}, sums, tile, counts);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace sherd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sherd {

HWY_EXPORT(Trace);

void TraceWithSums(const TraceJob& job, Sums sums, int tile, TraceCounts* counts) {
  HWY_DYNAMIC_DISPATCH(Trace)(job, sums, tile, counts);
}

}  // namespace sherd
#endif  // HWY_ONCE
