// COLMAP's depth and normal maps (colmap_formats 3.1; colmap/src/colmap/mvs/mat.h). Internal to
// reconstruction/.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace sherd {

// W&H&C& and then W * H * C floats, planar: all of the first channel, row by row, then all of the
// second. Depth maps have one channel, the distance along the camera's axis in model units (<= 0:
// nothing is known); normal maps three, a unit vector in the camera's frame.
struct MapHeader {
  int width = 0, height = 0, channels = 0;
  std::uint64_t bytes = 0;  // of the header

  std::uint64_t pixels() const { return std::uint64_t(width) * static_cast<std::uint64_t>(height); }
};

struct FloatMap {
  int width = 0, height = 0, channels = 0;
  std::vector<float> values;

  float At(int column, int row, int channel = 0) const {
    return values[(static_cast<std::size_t>(channel) * height + row) * width + column];
  }
};

// Throws InputError where the header makes no sense or the file is not as long as it says.
MapHeader ReadMapHeader(const std::string& path);
// Throws InputError also where the map has another number of channels.
FloatMap ReadFloatMap(const std::string& path, int channels);

// The file of photograph `name` in `folder` (stereo/depth_maps or stereo/normal_maps): the
// geometric map, else the photometric one; empty where there is neither.
std::string FindMap(const std::string& folder, const std::string& name);

}  // namespace sherd
