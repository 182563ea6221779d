// Points from depth maps. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <string>

#include "metaball/control.h"
#include "reconstruction/survey.h"

namespace sherd {

struct FusionOptions {
  std::string stereo_folder;      // of the dense workspace: depth_maps/ and normal_maps/
  std::uint64_t decimate_to = 0;  // at most about this many points; 0: all
  std::uint64_t memory_limit_bytes = 0;
  // A point of one map agrees with another map where that map's depth at its place differs by at
  // most this share, and the two normals, where both are known, by at most this angle.
  double depth_tolerance = 0.01;
  double normal_tolerance_deg = 20;
  // Other maps that must agree; fewer where there are not so many maps (one map alone: none).
  int agreeing = 2;
};

// Fills survey->points from the depth maps of its photographs, whose cameras and poses are there:
// every valid pixel is carried into the world through the centre of its pixel (0.5, 0.5), is kept
// where other maps agree, and becomes the mean of what the agreeing maps say; their pixels are then
// used up. Normals come from the normal maps (zero where there is none, and no normals at all where
// no photograph has one), colours from Photograph::path (grey where there is none), the lists of
// photographs from the maps that agree. Maps that cannot be read are left out with one warning.
// dense_pixel_offset becomes 0, for the pixels' centres are kept. The same for any number of
// threads. Throws InputError where no map can be used, ResourceError, Cancelled.
//
// After the fusion of Schoenberger et al., "Pixelwise view selection for unstructured multi-view
// stereo", 2016, section 5, without its recursion: only the reference map's own point is compared.
void FuseDepthMaps(const FusionOptions& options, Survey* survey, const Control& control);

}  // namespace sherd
