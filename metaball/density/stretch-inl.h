// No guard: see shapes.h.
//
// A segment of a ray as one metaball sees it. Lengths are in radii of the support; s runs along the
// ray from the point of closest approach, whose squared distance from the centre is across2; then
// u = (distance / support radius)^2 = across2 + s^2.

template <class T>
struct Stretch {
  T across2;
  T near2;         // the least s^2 on the segment
  T u_min, u_max;  // of u on the part of the segment inside the support; u_max <= 1
};

// v^n for n >= 0.
template <class T>
SHERD_FORMULA T IntegerPower(T v, int n) {
  T result = T(1);
  for (; n > 0; n >>= 1) {
    if (n & 1) result = result * v;
    v = v * v;
  }
  return result;
}
