// Textures and normals prepared for one frame: what the views of them point at.
#pragma once

#include "metaball/appearance/appearance.h"
#include "metaball/appearance/image_view.h"
#include "metaball/appearance/normal_view.h"
#include "metaball/appearance/texture_view.h"
#include "metaball/frame.h"

namespace sherd {

// image: of lookup.image, or a copy of it on a device. uv: the UV plane of lookup.uv; not read
// where the coordinates are projected.
TextureView MakeTextureView(const TextureLookup& lookup, const ImageView& image,
                            const SurfaceUv* uv);

// A texture looked up in one frame, which holds the UV plane of lookup.uv where the coordinates
// come from a channel. Lookup and frame must live on unchanged.
TextureView TextureOf(const TextureLookup& lookup, const Frame& frame);

// The normals of one frame, which holds the planes they need (deferred.h). Appearance and frame
// must live on unchanged.
NormalView NormalsOf(const Appearance& appearance, const Frame& frame);

}  // namespace sherd
