// The metaball file: a cloud on disk, exactly (docs/metaball_file.md). Little endian, written to a
// temporary name and renamed, every declared size checked against the file before it is believed.
#pragma once

#include <string>

#include "metaball/cloud.h"

namespace sherd {

// The extension of metaball files, with its dot.
inline constexpr const char* kMetaballExtension = ".metaballs";

struct MetaballFile {
  Cloud cloud;
  double threshold = 0.7;  // the surface the file was made for
};

// True when the file begins with the metaball file's magic number.
bool IsMetaballFile(const std::string& path);
// Throws InputError with the byte where the file stops making sense.
MetaballFile ReadMetaballFile(const std::string& path);
// Throws OutputError; then no file of that name was made or changed.
void WriteMetaballFile(const std::string& path, const Cloud& cloud, double threshold);

}  // namespace sherd
