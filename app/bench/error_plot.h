// Error against time, for a report's page.
#pragma once

#include <string>
#include <vector>

#include "app/bench/bench_files.h"
#include "app/bench/measure.h"

namespace sherd {

// Writes PATH_WITHOUT_EXTENSION.png and .svg: the share of wrong pixels and the depth error's 99th
// percentile against the time of a frame, both axes logarithmic, errors of zero on a line of their
// own at the lower end. The front of what nothing else beats is a line. Measurements that have an
// error are left out. Throws OutputError, and Error where nothing was drawn. Not thread-safe: one
// plot at a time in a process.
void WriteErrorPlot(const BenchScene& scene, const std::vector<Measurement>& measurements,
                    const std::string& path_without_extension);

}  // namespace sherd
