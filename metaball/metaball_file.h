// The metaball file: a cloud on disk, exactly (docs/metaball_file.md). Little endian, written to a
// temporary name and renamed, every declared size checked against the file before it is believed.
#pragma once

#include <string>

#include "metaball/cloud.h"
#include "metaball/scene.h"

namespace sherd {

// The extension of metaball files, with its dot.
inline constexpr const char* kMetaballExtension = ".metaballs";

struct MetaballFile {
  Cloud cloud;
  // The surface the file was made for.
  double threshold = 0.7;
  double radius_scale = 1.0;
  DensityModel density;
  ThresholdMode mode = ThresholdMode::kUniform;

  Surface SurfaceOf() const;
};

// True when the file begins with the metaball file's magic number.
bool IsMetaballFile(const std::string& path);
// Throws InputError with the byte where the file stops making sense.
MetaballFile ReadMetaballFile(const std::string& path);
// Version 1 where it can say everything (uniform threshold, Murakami's density, unscaled radii, no
// thresholds of the metaballs' own, no further channels), else version 2. Throws OutputError, or
// InputError for a cloud or surface no reader would take; then no file of that name was made or
// changed.
void WriteMetaballFile(const std::string& path, const Cloud& cloud, const Surface& surface);
// The default surface with this threshold.
void WriteMetaballFile(const std::string& path, const Cloud& cloud, double threshold);

}  // namespace sherd
