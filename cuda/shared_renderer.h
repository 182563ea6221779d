// One picture by several renderers at once, such as those of the GPUs of one machine.
#pragma once

#include <memory>
#include <vector>

#include "metaball/renderer.h"

namespace sherd {

// Cuts every picture into bands of rows, one for each renderer, which draw them at once, each on a
// thread of its own, and joins them: the picture is that of one renderer, but for the last bits of
// the rays. The bands of the next picture are sized by what each took for its last one, so that all
// end together. Passes of an appearance are the renderers' own; their filter sees beyond a band's
// border. RenderSettings::threads are divided among them.
//
// A renderer that ends in a DeviceError is left out from then on, one that ends in a ResourceError
// as long as the cloud is the same and its radius factor not smaller; the others draw its band, and
// stats.device says so. Where none is left that error is thrown: DeviceError by every later call
// too, while after a ResourceError the next call asks all of them again. Any other error, and a
// stop, ends the picture as soon as the others have stopped.
//
// stats: counts are sums, and a stage lasts as long as that of the slowest. `renderers`: one or
// more.
std::unique_ptr<Renderer> MakeSharedRenderer(std::vector<std::unique_ptr<Renderer>> renderers);

}  // namespace sherd
