#include "metaball/appearance/bake.h"

#include <algorithm>
#include <cstddef>

#include "metaball/appearance/gather.h"
#include "metaball/error.h"
#include "metaball/parallel.h"

namespace sherd {

std::vector<Rgb8> TextureColors(const Cloud& cloud, const TextureLookup& lookup, int threads) {
  if (!lookup.image) throw Error("the texture has no image");
  const bool own = lookup.coordinates == TextureCoordinates::kChannel;
  const Channel* channel = own ? &ChannelNamed(cloud, lookup.uv.channel) : nullptr;
  if (own && channel->components() != 2) {
    throw Error("channel '" + lookup.uv.channel + "' cannot hold texture coordinates: it has " +
                std::to_string(channel->components()) + " components, not 2");
  }
  const bool wraps_u = own ? lookup.uv.periodic : lookup.projection.wraps_u();
  const bool wraps_v = own && lookup.uv.periodic;
  std::vector<Rgb8> colors(cloud.size());
  constexpr std::size_t kBlock = 4096;
  const std::size_t n = cloud.size();
  ParallelFor(static_cast<std::int64_t>((n + kBlock - 1) / kBlock), threads,
              [&](std::int64_t block, int) {
                const std::size_t begin = static_cast<std::size_t>(block) * kBlock;
                for (std::size_t i = begin; i < std::min(n, begin + kBlock); ++i) {
                  double u = 0, v = 0;
                  if (own) {
                    const ChannelValue uv = channel->Get(i);
                    u = uv.v[0];
                    v = uv.v[1];
                  } else {
                    lookup.projection.At(cloud.frame.WorldFromLocal(cloud.center[i]), &u, &v);
                  }
                  colors[i] = Rgb8FromLinear(
                      lookup.image->Sample(static_cast<float>(u), static_cast<float>(v), {},
                                           lookup.repeat_u || wraps_u, lookup.repeat_v || wraps_v));
                }
              });
  return colors;
}

}  // namespace sherd
