// The CPU renderer, with the choice of its inner loop for tests and benchmarks.
#pragma once

#include <memory>

#include "metaball/renderer.h"

namespace sherd {

enum class CpuPath {
  kBest,    // vectors where they are built in
  kScalar,  // a ray at a time: the truth the vectors are tested against
};

std::unique_ptr<Renderer> MakeCpuRenderer(CpuPath path);

}  // namespace sherd
