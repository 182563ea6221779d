// The field as what it is for polynomial densities: between two support ends one polynomial along
// the ray, whose first root is isolated in Bernstein form (Kanamori et al. 2008 clip; here
// coefficients are halved until one sign change is left, then the bracket is narrowed).
//
// With thresholds of each metaball: blended ones ask for a root of A^2 - B, A = sum f and B = sum f
// T_k, of twice the degree; summed ones subtract the sum of the piece's thresholds; gated ones take
// the first root of every metaball alone.
//
// Guarantees: the first crossing of the polynomial as it is rounded, isolated by coefficients'
// signs: none is passed over but a touch within rounding, counted as grazing, and the place is as
// good as the doubles are, far better than the tolerance. Coordinates are local to the piece and
// the coefficients those of Bernstein's basis: nothing large cancels at degree 64, as it does in
// powers of t from the camera. Fails: only densities that are polynomials of q = 1 - (d/R)^2 can be
// drawn (Error otherwise); every overlapping metaball adds two pieces, and every piece sums up all
// of them anew, so time grows with the square of the overlap.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "metaball/error.h"
#include "metaball/methods/ray_method.h"

namespace sherd {
namespace {

constexpr int kMaxDegree = 64;    // in t; (1 - x^2)^16, squared for blended thresholds
constexpr int kCommonDegree = 8;  // what most densities need, with less to copy
constexpr int kMaxPieces = 1000000;
constexpr double kNarrowest = 1e-13;  // of a piece: what is undecided there is a touch

// Bernstein coefficients on [0, 1], degree + 1 of them used; or these times their binomials, which
// multiply like the coefficients of powers.
template <int kRoom>
using Coefficients = std::array<double, kRoom + 1>;

// A density as a polynomial in q: a[1] q + a[2] q^2 + ...
struct DensityPolynomial {
  int degree = 0;
  std::array<double, kMaxDegree / 4 + 1> a{};
};

DensityPolynomial PolynomialOf(const DensityShape& shape) {
  DensityPolynomial p;
  switch (shape.kind) {
    case ShapeKind::kPower:
      p.degree = shape.degree;
      p.a[shape.degree] = 1;
      return p;
    case ShapeKind::kWyvill:  // 1 - 22/9 (1-q) + 17/9 (1-q)^2 - 4/9 (1-q)^3
      p.degree = 3;
      p.a[2] = 5.0 / 9.0;
      p.a[3] = 4.0 / 9.0;
      return p;
    default:
      throw Error(
          "the polynomial method draws densities that are polynomials of the squared distance "
          "(murakami, wyvill, power, ramp:2, ramp:4), not this one");
  }
}

// binomial[n][k].
const std::array<Coefficients<kMaxDegree>, kMaxDegree + 1>& Binomials() {
  static const auto table = [] {
    std::array<Coefficients<kMaxDegree>, kMaxDegree + 1> b{};
    for (int n = 0; n <= kMaxDegree; ++n) {
      b[n][0] = 1;
      for (int k = 1; k <= n; ++k) b[n][k] = b[n - 1][k - 1] + (k < n ? b[n - 1][k] : 0.0);
    }
    return b;
  }();
  return table;
}

// The first root of a polynomial of Bernstein coefficients c on [0, 1] where it rises to zero from
// below; c[0] < 0.
template <int kRoom>
class RootSearch {
  using Numbers = Coefficients<kRoom>;

 public:
  explicit RootSearch(int degree) : degree_(degree) {}

  // The root, or a negative number. A touch that cannot be decided sets *touch.
  double First(const Numbers& c, bool* touch) {
    if (std::none_of(c.begin(), c.begin() + degree_ + 1, [](double v) { return v >= 0; }))
      return -1;
    todo_.clear();
    todo_.push_back({0.0, 1.0, c});
    while (!todo_.empty()) {
      const Part part = todo_.back();
      todo_.pop_back();
      int changes = 0;
      for (int k = 0; k < degree_; ++k) changes += (part.c[k] < 0) != (part.c[k + 1] < 0) ? 1 : 0;
      if (!(part.c[0] < 0)) return part.v0;
      if (changes == 0) continue;
      if (changes == 1) return Narrow(part);
      if (part.v1 - part.v0 < kNarrowest) {
        if (part.c[degree_] >= 0) return part.v1;
        *touch = true;
        continue;
      }
      Part near, far;
      Halve(part, &near, &far);
      todo_.push_back(far);
      todo_.push_back(near);
    }
    return -1;
  }

 private:
  struct Part {
    double v0, v1;
    Numbers c;
  };

  // de Casteljau at the middle.
  void Halve(const Part& part, Part* near, Part* far) const {
    const double middle = 0.5 * (part.v0 + part.v1);
    Numbers p = part.c;
    near->v0 = part.v0;
    near->v1 = far->v0 = middle;
    far->v1 = part.v1;
    near->c[0] = p[0];
    far->c[degree_] = p[degree_];
    for (int level = 1; level <= degree_; ++level) {
      for (int k = 0; k <= degree_ - level; ++k) p[k] = 0.5 * (p[k] + p[k + 1]);
      near->c[level] = p[0];
      far->c[degree_ - level] = p[degree_ - level];
    }
  }

  double ValueAt(const Numbers& c, double v) const {
    Numbers p = c;
    for (int level = 1; level <= degree_; ++level) {
      for (int k = 0; k <= degree_ - level; ++k) p[k] += v * (p[k + 1] - p[k]);
    }
    return p[0];
  }

  // One root, by false position that halves a stuck end's weight (Illinois), which never leaves
  // the bracket; by halving where three steps have not halved it, as beside a double root.
  double Narrow(const Part& part) const {
    double v0 = 0, v1 = 1, f0 = part.c[0], f1 = part.c[degree_];
    int stuck = 0;
    double width_before = 1;
    bool slow = false;
    for (int i = 0; i < 200 && v1 - v0 > 1e-12; ++i) {
      if (i % 3 == 2) {
        slow = v1 - v0 > 0.5 * width_before;
        width_before = v1 - v0;
      }
      double v = f1 > f0 && !slow ? v0 - f0 * (v1 - v0) / (f1 - f0) : 0.5 * (v0 + v1);
      if (!(v > v0 && v < v1)) v = 0.5 * (v0 + v1);
      if (v == v0 || v == v1) break;
      const double f = ValueAt(part.c, v);
      if (f >= 0) {
        v1 = v;
        f1 = f;
        f0 *= stuck > 0 ? 0.5 : 1.0;
        stuck = 1;
        if (f == 0) break;
      } else {
        v0 = v;
        f0 = f;
        f1 *= stuck < 0 ? 0.5 : 1.0;
        stuck = -1;
      }
    }
    return part.v0 + v1 * (part.v1 - part.v0);
  }

  int degree_;
  std::vector<Part> todo_;
};

class Polynomial final : public RayMethod {
 public:
  void Prepare(const MethodSurface& surface) override {
    density_ = PolynomialOf(surface.density.resolved.shape);
    amplitude_ = surface.density.resolved.amplitude;
    degree_ = 2 * density_.degree * (surface.mode == ThresholdMode::kBlended ? 2 : 1);
  }

  std::optional<double> FirstCrossing(RayField* field, RayCounts* counts) const override {
    return degree_ <= kCommonDegree ? Search<kCommonDegree>(field, counts)
                                    : Search<kMaxDegree>(field, counts);
  }

 private:
  template <int kRoom>
  std::optional<double> Search(RayField* field, RayCounts* counts) const {
    RootSearch<kRoom> roots(degree_);
    double t = 0;
    for (int pieces = 0; field->Seek(&t); ++pieces) {
      if (pieces == kMaxPieces) {
        ++counts->unresolved;
        break;
      }
      const double end = field->PieceEnd(t, INFINITY);
      bool touch = false;
      const auto root_of = [&](const Coefficients<kRoom>& c) {
        return c[0] < 0 ? roots.First(c, &touch) : 0.0;
      };
      double v = -1;
      switch (field->surface().mode) {
        case ThresholdMode::kUniform:
        case ThresholdMode::kSummed:
          v = root_of(Sum<kRoom>(*field, t, end));
          break;
        case ThresholdMode::kBlended:
          v = root_of(Blended<kRoom>(*field, t, end));
          break;
        case ThresholdMode::kGated:
          ForEach<kRoom>(*field, t, end, [&](const RayMetaball& m, Coefficients<kRoom> p) {
            FromPowers<kRoom>(m.threshold, &p);
            const double own = root_of(p);
            if (own >= 0) v = v >= 0 ? std::min(v, own) : own;
          });
          break;
      }
      if (touch) ++counts->grazing;
      if (v >= 0) return t + v * (end - t);
      t = end;
    }
    return std::nullopt;
  }

  // f(metaball, its shape on the piece [t, end] as coefficients times binomials).
  template <int kRoom, class F>
  void ForEach(const RayField& field, double t, double end, const F& f) const {
    for (const RayMetaball& m : field.active()) {
      if (m.enter >= end || m.exit <= t) continue;
      const double s0 = (t - m.b) * m.inverse_radius, s1 = (end - m.b) * m.inverse_radius;
      const double h = 1 - m.miss;
      // Where the support begins or ends q is 0, not nearly so.
      const double q[3] = {m.enter == t ? 0.0 : h - s0 * s0, h - s0 * s1,
                           m.exit == end ? 0.0 : h - s1 * s1};
      // Horner's rule.
      Coefficients<kRoom> p{};
      p[0] = density_.a[density_.degree];
      for (int n = density_.degree - 1, at = 0; n >= 0; --n, at += 2) {
        for (int k = at + 2; k >= 0; --k) {
          double product = k <= at ? p[k] * q[0] : 0.0;
          if (k >= 1 && k - 1 <= at) product += p[k - 1] * 2 * q[1];
          if (k >= 2) product += p[k - 2] * q[2];
          p[k] = product;
        }
        if (density_.a[n] == 0) continue;
        for (int k = 0; k <= at + 2; ++k) p[k] += density_.a[n] * Binomials()[at + 2][k];
      }
      f(m, p);
    }
  }

  // Turns a sum of shapes into Bernstein coefficients of the field less the threshold.
  template <int kRoom>
  void FromPowers(double threshold, Coefficients<kRoom>* p) const {
    for (int k = 0; k <= degree_; ++k) {
      (*p)[k] = amplitude_ * (*p)[k] / Binomials()[degree_][k] - threshold;
    }
  }

  template <int kRoom>
  Coefficients<kRoom> Sum(const RayField& field, double t, double end) const {
    Coefficients<kRoom> sum{};
    double thresholds = 0;
    ForEach<kRoom>(field, t, end, [&](const RayMetaball& m, const Coefficients<kRoom>& p) {
      for (int k = 0; k <= degree_; ++k) sum[k] += p[k];
      thresholds += m.threshold;
    });
    const bool summed = field.surface().mode == ThresholdMode::kSummed;
    FromPowers<kRoom>(summed ? thresholds : field.surface().threshold, &sum);
    return sum;
  }

  // A^2 - B. Where A is 0, at an end of the piece, so is this, and it is negative beside it.
  template <int kRoom>
  Coefficients<kRoom> Blended(const RayField& field, double t, double end) const {
    const int degree = degree_ / 2;  // of A and B
    Coefficients<kRoom> a{}, b{};
    ForEach<kRoom>(field, t, end, [&](const RayMetaball& m, const Coefficients<kRoom>& p) {
      for (int k = 0; k <= degree; ++k) {
        a[k] += amplitude_ * p[k];
        b[k] += amplitude_ * p[k] * m.threshold;
      }
    });
    Coefficients<kRoom> c{};
    for (int i = 0; i <= degree; ++i) {
      for (int j = 0; j <= degree; ++j) c[i + j] += a[i] * a[j] - b[i] * Binomials()[degree][j];
    }
    for (int k = 0; k <= degree_; ++k) c[k] /= Binomials()[degree_][k];
    constexpr double kBelow = -std::numeric_limits<double>::min();
    if (a[0] == 0) {
      for (int k = 0; k <= degree_ && c[k] == 0; ++k) c[k] = kBelow;
    }
    if (a[degree] == 0) {
      for (int k = degree_; k >= 0 && c[k] == 0; --k) c[k] = kBelow;
    }
    return c;
  }

  DensityPolynomial density_;
  int degree_ = 0;  // of what is searched for a root, in t
  double amplitude_ = 1.0;
};

}  // namespace

std::unique_ptr<RayMethod> MakePolynomial(const MethodOptions&) {
  return std::make_unique<Polynomial>();
}

}  // namespace sherd
