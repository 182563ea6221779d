// The words formulas are written in, for plain numbers. packet_math-inl.h has the same words for
// vectors of rays, so that a formula is written once for the scalar path, the vectors and the GPU.
#pragma once

#include <cmath>

#include "metaball/hostdevice.h"

namespace sherd {

template <class T>
SHERD_HD T Max(T a, T b) {
  return a > b ? a : b;
}
template <class T>
SHERD_HD T Min(T a, T b) {
  return a < b ? a : b;
}
// `a` where the condition holds, else `b`; both are evaluated.
template <class T>
SHERD_HD T Where(bool condition, T a, T b) {
  return condition ? a : b;
}
SHERD_HD bool Not(bool a) { return !a; }
SHERD_HD bool Both(bool a, bool b) { return a && b; }
SHERD_HD bool Either(bool a, bool b) { return a || b; }
SHERD_HD float SquareRoot(float v) { return sqrtf(v); }
SHERD_HD double SquareRoot(double v) { return sqrt(v); }
SHERD_HD float Exponential(float v) { return expf(v); }
SHERD_HD double Exponential(double v) { return exp(v); }
SHERD_HD float CosineOf(float v) { return cosf(v); }
SHERD_HD double CosineOf(double v) { return cos(v); }
SHERD_HD float SineOf(float v) { return sinf(v); }
SHERD_HD double SineOf(double v) { return sin(v); }

}  // namespace sherd
