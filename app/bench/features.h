// What each feature costs: bytes a metaball, and the time of a frame beside the plain one.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/bench/figure_table.h"
#include "cuda/device_choice.h"
#include "metaball/control.h"

namespace sherd {

struct FeatureOptions {
  std::uint64_t metaballs = 250000;  // of the height field
  int width = 1280, height = 720;
  int threads = 0;  // 0: all
  int repeat = 5;
  DeviceChoice gpu;  // MakeGpuRenderer (contenders.h)
};

struct BytesRow {
  std::string what;
  double bytes = 0;  // a metaball; the cloud's own vectors, or the renderer's working memory
};
// The thesis's record of centre, radius, threshold, normal and texture coordinates (its table 4.1).
inline constexpr double kThesisBytesPerMetaball = 40;

struct FeatureRow {
  std::string feature, backend;
  std::string error;  // why it could not be drawn
  int width = 0, height = 0;
  double seconds = 0;        // median
  double plain_seconds = 0;  // of the plain frame of this size, measured just before and after
  double ratio() const { return plain_seconds > 0 ? seconds / plain_seconds : 0; }
};

std::vector<BytesRow> MeasureBytes(const FeatureOptions& options, const Control& control);
// Throws Cancelled.
std::vector<FeatureRow> MeasureFeatures(const FeatureOptions& options, const Control& control);

FigureTable FiguresOf(const std::vector<BytesRow>& rows);
FigureTable FiguresOf(const std::vector<FeatureRow>& rows);
// For a screen; the first row are the names of the columns.
std::vector<std::vector<std::string>> ScreenTable(const std::vector<BytesRow>& rows);
std::vector<std::vector<std::string>> ScreenTable(const std::vector<FeatureRow>& rows);

}  // namespace sherd
