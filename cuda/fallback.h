// A renderer that finishes its frame on another one when the first cannot.
#pragma once

#include <functional>
#include <memory>

#include "metaball/renderer.h"

namespace sherd {

using RendererFactory = std::function<std::unique_ptr<Renderer>()>;

// Renders by `primary`. Where a frame ends in a DeviceError or a ResourceError of the primary, the
// same frame is rendered by a renderer from `make_secondary` (made when first needed), and its
// stats.device says what happened. After a DeviceError the primary is thrown away and made anew by
// `make_primary` for the next frame; if that or the next frame fails too, the secondary stays.
std::unique_ptr<Renderer> MakeFallbackRenderer(std::unique_ptr<Renderer> primary,
                                               RendererFactory make_primary,
                                               RendererFactory make_secondary);

}  // namespace sherd
