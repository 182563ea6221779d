// Small vectors for host and device code. Plain aggregates: no padding, no hidden cost.
#pragma once

#include <cmath>

#include "metaball/hostdevice.h"

namespace sherd {

template <class T>
struct Vec3 {
  T x{}, y{}, z{};

  template <class U>
  SHERD_HD constexpr Vec3<U> cast() const {
    return {static_cast<U>(x), static_cast<U>(y), static_cast<U>(z)};
  }
  friend SHERD_HD constexpr bool operator==(const Vec3& a, const Vec3& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
  }
};

using Vec3f = Vec3<float>;
using Vec3d = Vec3<double>;

template <class T>
SHERD_HD constexpr Vec3<T> operator+(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T>
SHERD_HD constexpr Vec3<T> operator-(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class T>
SHERD_HD constexpr Vec3<T> operator-(const Vec3<T>& a) {
  return {-a.x, -a.y, -a.z};
}
template <class T>
SHERD_HD constexpr Vec3<T> operator*(const Vec3<T>& a, T s) {
  return {a.x * s, a.y * s, a.z * s};
}
template <class T>
SHERD_HD constexpr Vec3<T> operator*(T s, const Vec3<T>& a) {
  return a * s;
}
template <class T>
SHERD_HD constexpr Vec3<T> operator/(const Vec3<T>& a, T s) {
  return {a.x / s, a.y / s, a.z / s};
}
template <class T>
SHERD_HD constexpr Vec3<T>& operator+=(Vec3<T>& a, const Vec3<T>& b) {
  a = a + b;
  return a;
}

template <class T>
SHERD_HD constexpr T Dot(const Vec3<T>& a, const Vec3<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
SHERD_HD constexpr Vec3<T> Cross(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
SHERD_HD T Length(const Vec3<T>& a) {
  using std::sqrt;
  return sqrt(Dot(a, a));
}
// The unit vector along `a`, or `fallback` where `a` has no finite, positive length.
template <class T>
SHERD_HD Vec3<T> Normalized(const Vec3<T>& a, const Vec3<T>& fallback = Vec3<T>{T(0), T(0), T(1)}) {
  const T length = Length(a);
  return length > T(0) && length < T(INFINITY) ? a / length : fallback;
}
// A unit vector perpendicular to `a`, which has a length.
template <class T>
SHERD_HD Vec3<T> Perpendicular(const Vec3<T>& a) {
  using std::abs;
  const Vec3<T> other = abs(a.x) < abs(a.y) ? Vec3<T>{T(1), T(0), T(0)} : Vec3<T>{T(0), T(1), T(0)};
  return Normalized(Cross(a, other));
}
template <class T>
SHERD_HD bool IsFinite(const Vec3<T>& a) {
  using std::isfinite;
  return isfinite(a.x) && isfinite(a.y) && isfinite(a.z);
}

}  // namespace sherd
