// The march of march-inl.h for plain numbers, a ray at a time.
#pragma once

#include <cstdint>

#include "metaball/density/shapes.h"
#include "metaball/hostdevice.h"

#define SHERD_FORMULA SHERD_HD

namespace sherd {
#include "metaball/march-inl.h"
}  // namespace sherd

#undef SHERD_FORMULA

namespace sherd {

template <class T>
using RayMarch = March<T, bool>;

// Runs a march while `step(march)` finds it searching, at most max_steps times; returns false when
// they did not suffice (to be counted by the caller; never silent). step returns whether it passed
// a grazing rise, counted in *grazing.
template <class T, class Step>
SHERD_HD bool RunMarch(const Step& step, int max_steps, RayMarch<T>* march,
                       std::uint32_t* grazing) {
  for (int k = 0; k < max_steps && march->searching; ++k) {
    if (step(march)) ++*grazing;
  }
  return !march->searching;
}

}  // namespace sherd
