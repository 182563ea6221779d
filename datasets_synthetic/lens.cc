#include "datasets_synthetic/lens.h"

#include <algorithm>
#include <cmath>

namespace sherd::synthetic {
namespace {

// Distorted coordinates of (u, v) and their derivatives.
struct Distorted {
  double u, v;
  double du_du, du_dv, dv_du, dv_dv;
};
Distorted Distort(const Lens& l, double u, double v) {
  const double r2 = u * u + v * v;
  const double radial = 1 + r2 * (l.k1 + l.k2 * r2);
  const double slope = 2 * (l.k1 + 2 * l.k2 * r2);  // d radial / d r2, twice
  Distorted d;
  d.u = u * radial + 2 * l.p1 * u * v + l.p2 * (r2 + 2 * u * u);
  d.v = v * radial + 2 * l.p2 * u * v + l.p1 * (r2 + 2 * v * v);
  d.du_du = radial + u * u * slope + 2 * l.p1 * v + 6 * l.p2 * u;
  d.du_dv = u * v * slope + 2 * l.p1 * u + 2 * l.p2 * v;
  d.dv_du = u * v * slope + 2 * l.p2 * v + 2 * l.p1 * u;
  d.dv_dv = radial + v * v * slope + 2 * l.p2 * u + 6 * l.p1 * v;
  return d;
}

}  // namespace

bool Lens::Project(double u, double v, double* x, double* y) const {
  if (max_radius > 0 && u * u + v * v > 1.02 * max_radius * max_radius) return false;
  const Distorted d = Distort(*this, u, v);
  *x = fx * d.u + cx;
  *y = fy * d.v + cy;
  return true;
}

void Lens::Unproject(double x, double y, double* u, double* v) const {
  const double tu = (x - cx) / fx, tv = (y - cy) / fy;
  *u = tu;
  *v = tv;
  if (!distorted()) return;
  for (int i = 0; i < 20; ++i) {
    const Distorted d = Distort(*this, *u, *v);
    const double eu = d.u - tu, ev = d.v - tv;
    const double det = d.du_du * d.dv_dv - d.du_dv * d.dv_du;
    const double su = (d.dv_dv * eu - d.du_dv * ev) / det;
    const double sv = (d.du_du * ev - d.dv_du * eu) / det;
    *u -= su;
    *v -= sv;
    if (std::abs(su) + std::abs(sv) < 1e-14) return;
  }
}

std::vector<double> Lens::Params() const {
  if (distorted()) return {fx, fy, cx, cy, k1, k2, p1, p2};
  return {fx, fy, cx, cy};
}

void Lens::SetMaxRadius() {
  max_radius = 0;
  for (const double x : {0.0, 0.5 * width, static_cast<double>(width)}) {
    for (const double y : {0.0, 0.5 * height, static_cast<double>(height)}) {
      double u, v;
      Unproject(x, y, &u, &v);
      max_radius = std::max(max_radius, std::hypot(u, v));
    }
  }
}

Lens UndistortedLens(const Lens& lens) {
  if (!lens.distorted()) return lens;
  Lens out = lens;
  out.k1 = out.k2 = out.p1 = out.p2 = 0;
  // Where the border pixels' centres come to lie: the innermost of each side bounds the picture.
  double left = 0, right = lens.width, top = 0, bottom = lens.height;
  const auto place = [&](double x, double y, double* px, double* py) {
    double u, v;
    lens.Unproject(x, y, &u, &v);
    *px = lens.fx * u + lens.cx;
    *py = lens.fy * v + lens.cy;
  };
  double px, py;
  for (int y = 0; y < lens.height; ++y) {
    place(0.5, y + 0.5, &px, &py);
    left = y == 0 ? px : std::max(left, px);
    place(lens.width - 0.5, y + 0.5, &px, &py);
    right = y == 0 ? px : std::min(right, px);
  }
  for (int x = 0; x < lens.width; ++x) {
    place(x + 0.5, 0.5, &px, &py);
    top = x == 0 ? py : std::max(top, py);
    place(x + 0.5, lens.height - 0.5, &px, &py);
    bottom = x == 0 ? py : std::min(bottom, py);
  }
  const auto scale = [](double c, double size, double low, double high) {
    // As COLMAP does it: one factor a side, the picture shrinks about the principal point.
    return std::clamp(1.0 / std::max(c / (c - low), (size - 0.5 - c) / (high - c)), 0.2, 2.0);
  };
  const double sx = scale(lens.cx, lens.width, left, right);
  const double sy = scale(lens.cy, lens.height, top, bottom);
  out.width = std::max(1, static_cast<int>(sx * lens.width));
  out.height = std::max(1, static_cast<int>(sy * lens.height));
  out.cx = lens.cx * out.width / lens.width;
  out.cy = lens.cy * out.height / lens.height;
  out.SetMaxRadius();
  return out;
}

Lens ResizedLens(const Lens& lens, int w, int h) {
  Lens out = lens;
  const double sx = static_cast<double>(w) / lens.width, sy = static_cast<double>(h) / lens.height;
  out.width = w;
  out.height = h;
  out.fx *= sx;
  out.cx *= sx;
  out.fy *= sy;
  out.cy *= sy;
  return out;
}

}  // namespace sherd::synthetic
