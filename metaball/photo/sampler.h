// The interface in front of every machine that looks photographs up.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "metaball/control.h"
#include "metaball/photo/filter.h"
#include "metaball/photo/lookup.h"
#include "metaball/photo/pyramid.h"

namespace sherd {

// A photograph by what is known of it before it is decoded.
struct PhotoExtent {
  std::uint32_t photo = 0;    // tells it from the others a sampler is given
  int width = 0, height = 0;  // of the file; positive
  int finest = 0;             // the finest level that is asked for
};

// Not thread-safe. `lookups` are of the one photograph.
class PhotoSampler {
 public:
  virtual ~PhotoSampler() = default;

  // False where Sample can do without pixels: a store still holds all that these lookups read.
  // Holds until the next call of Sample with pixels.
  virtual bool NeedsPixels(const PhotoExtent& photo, std::span<const PhotoLookup> lookups,
                           const Control& control) = 0;
  // colors[i]: what lookups[i] asks for (filter.h). `pixels` may be null where NeedsPixels said so;
  // it may hold coarser levels alone. Throws Cancelled; DeviceError and ResourceError where it
  // works on a device, which leaves `colors` undefined.
  virtual void Sample(const PhotoExtent& photo, const PhotoPyramid* pixels,
                      std::span<const PhotoLookup> lookups, PhotoColors* colors,
                      const Control& control) = 0;
};

// Reads the pixels where they are, with all cores; needs them always.
std::unique_ptr<PhotoSampler> MakeCpuPhotoSampler();

}  // namespace sherd
