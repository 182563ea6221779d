#include "metaball/appearance/surface_pass.h"

namespace sherd {

TextureView MakeTextureView(const TextureLookup& lookup, const ImageView& image,
                            const SurfaceUv* uv) {
  return {image,           lookup.coordinates, uv, lookup.uv.periodic, lookup.projection,
          lookup.repeat_u, lookup.repeat_v};
}

TextureView TextureOf(const TextureLookup& lookup, const Frame& frame) {
  const SurfaceUv* uv = nullptr;
  for (const UvPlane& plane : frame.uv) {
    if (plane.channel == lookup.uv.channel) uv = plane.values.data();
  }
  return MakeTextureView(lookup, lookup.image->view(), uv);
}

NormalView NormalsOf(const Appearance& appearance, const Frame& frame) {
  const NormalMap& map = appearance.normal_map;
  NormalView view;
  view.normal = appearance.normal;
  view.map = map.source;
  view.influence = frame.influence.data();
  for (const ChannelPlane& plane : frame.channels) {
    if (plane.name == map.channel) view.channel = plane.values.data();
  }
  if (map.source == NormalMapSource::kImage) view.image = TextureOf(map.lookup, frame);
  return view;
}

}  // namespace sherd
