// From photographs to a workspace: COLMAP as another program, stage by stage.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "metaball/control.h"

namespace sherd {

struct ReconstructOptions {
  std::string photos;     // a folder; only read
  std::string workspace;  // a folder of its own, made where it is missing; not inside `photos`
  std::string colmap = "colmap";
  std::string camera_model = "SIMPLE_RADIAL";
  bool single_camera = false;  // all photographs by one camera at one focal length
  bool sequential = false;     // photographs in the order they were taken; else every pair is tried
  int max_image_size = 0;      // of features and of undistorted photographs, px; 0: COLMAP's own
  int threads = 0;             // 0: COLMAP's own choice
  bool dense = true;           // where COLMAP was built with CUDA
};

struct ReconstructStage {
  std::string name;      // "features"
  bool skipped = false;  // finished by an earlier run with the same options
  double seconds = 0;
};

struct ReconstructResult {
  std::string version;  // COLMAP's own words: "COLMAP 3.8"
  bool cuda = false;
  std::vector<ReconstructStage> stages;
  std::string log;         // DIR/colmap.log
  std::string no_dense;    // why there is no dense cloud; empty where there is one
  std::size_t models = 0;  // sparse/0, sparse/1, ...
};

// Runs features, matching, mapping, undistortion and, where it can, the dense stages. Each writes
// beside its result and is renamed into place when it has succeeded, so a stage that fails, is
// killed or fills the disk leaves what was there, and the next run goes on from the last finished
// stage (workspace/reconstruct.json; a stage runs again when its options or those of one before it
// have changed). Throws InputError (no photographs, no COLMAP, COLMAP's failure with its last words
// and the log's name), OutputError, Cancelled.
ReconstructResult Reconstruct(const ReconstructOptions& options, const Control& control = {});

// How far COLMAP's output says it is: "[3/10]", "[1/2, 2/2]", "view 3 / 10", and "Registering image
// #7 (4)" against the number of photographs. nullopt for other lines.
std::optional<double> ColmapProgress(std::string_view line, std::size_t photographs);

}  // namespace sherd
