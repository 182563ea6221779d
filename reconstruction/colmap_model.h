// A COLMAP sparse model as its files hold it (colmap_formats: doc/format.rst and
// src/colmap/scene/reconstruction_io_{binary,text}.cc). Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "metaball/control.h"
#include "reconstruction/survey.h"

namespace sherd {

struct ColmapImage {
  std::uint32_t image_id = 0;
  std::uint32_t camera_id = 0;
  Rigid3d cam_from_world;
  std::string name;
};

// Points as they are read. photo_idx of `points` holds image *ids* until ResolveTracks.
struct ColmapModel {
  std::string folder;
  std::vector<SurveyCamera> cameras;  // in the file's order
  std::vector<ColmapImage> images;    // in the file's order
  SurveyPoints points;
  std::uint64_t points_not_finite = 0;  // dropped
  std::uint64_t cameras_of_unknown_model = 0;
  std::string unknown_model_name;
  // The image ids in the order of frames.bin (.txt); empty where there is no such file.
  std::vector<std::uint32_t> frame_image_ids;
  std::vector<std::string> warnings;
};

struct ColmapReadOptions {
  bool points = true;
  std::uint64_t decimate_to = 0;  // at most about this many points; 0: all
};

// Reads the model in `folder`. Throws InputError with the byte or line, Cancelled.
ColmapModel ReadColmapModel(const std::string& folder, bool binary,
                            const ColmapReadOptions& options, const Control& control);

// --- the parts, one file each ---

void ReadCamerasBinary(const std::string& path, ColmapModel* model);
void ReadImagesBinary(const std::string& path, ColmapModel* model, const Control& control);
void ReadPointsBinary(const std::string& path, const ColmapReadOptions& options, ColmapModel* model,
                      const Control& control);

void ReadCamerasText(const std::string& path, ColmapModel* model);
void ReadImagesText(const std::string& path, ColmapModel* model, const Control& control);
void ReadPointsText(const std::string& path, const ColmapReadOptions& options, ColmapModel* model,
                    const Control& control);

// rigs.* and frames.* (COLMAP >= 3.12), where they are there: sets frame_image_ids and warns when
// the poses composed from them are not those of images.*. A damaged file is a warning, not an
// error: nothing but the order of the photographs depends on it.
void ReadFrames(const std::string& folder, bool binary, ColmapModel* model);

// What every reader checks. `place` names the record's place in the file.
void CheckCamera(const std::string& path, const std::string& place, const SurveyCamera& camera);
// Makes the quaternion a unit one; throws InputError when it is none, or the pose is not finite.
void CheckPose(const std::string& path, const std::string& place, Rigid3d* pose);

// Which of `total` records a thinned reading keeps: one of each of `kept` equal strata, chosen
// evenly but without a fixed stride (which would follow the scan lines of a depth map).
class Thinning {
 public:
  Thinning(std::uint64_t total, std::uint64_t kept);
  // To be asked for 0, 1, 2, ... in order.
  bool Keep(std::uint64_t i);
  bool all() const { return kept_ == 0; }

 private:
  void NextStratum();
  std::uint64_t total_, kept_;
  std::uint64_t stratum_ = 0, chosen_ = 0;
};

}  // namespace sherd
