// The survey as the project keeps it (NAME.sherd.d/survey.bin), so that opening a project needs the
// workspace no more, and the photographs and normals of a level's metaballs (attributes.bin).
//
// survey.bin, little endian, see CheckedWriter for what surrounds it:
//   uint32 cameras, each: uint32 camera_id, int32 model, uint64 width, height, uint32 n, n float64
//   uint32 photographs, each: uint32 image_id, uint32 camera_idx, float64 qw qx qy qz tx ty tz,
//     text name, text path (relative to the project's folder; empty: not found), text original
//     path, uint32 its camera_idx, text mask path (from version 2)
//   uint64 points n, uint32 channels (1 colour, 2 normal, 4 error, 8 photographs, 16 dense),
//   float64 dense_pixel_offset
//   float64[3 n] position, uint8[3 n] colour, float32[3 n] normal, float32[n] error,
//   uint64 total, uint32[n] photographs of each point, uint32[total] photo_idx
// outline.bin: uint64 n, float64[3 n] position of some points
// attributes.bin: text name, uint64 metaballs n, uint32 channels (2 normal, 8 photographs,
//   32 depth, from version 2 on), float32[3 n] normal, uint64 total, uint32[n] photographs of each,
//   uint16[total] photo_idx, float32[n] depth
// (text: uint32 length and that many bytes.)
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "metaball/control.h"
#include "reconstruction/level.h"
#include "reconstruction/survey.h"

namespace sherd {

// Photograph::path is written as it is. Throws OutputError, Cancelled.
void WriteSurveyFile(const std::string& path, const Survey& survey, const Control& control = {});
// Points, cameras and photographs; the rest of Survey (scale, up, warnings) is the project file's.
// Throws InputError with the byte, Cancelled.
Survey ReadSurveyFile(const std::string& path, const Control& control = {});

// The few points of a survey that the view presets are fitted to.
void WriteOutlineFile(const std::string& path, const std::vector<Vec3d>& points);
std::vector<Vec3d> ReadOutlineFile(const std::string& path);

// Name, normals, photographs and depths of a level; its cloud has a file of its own.
void WriteLevelAttributes(const std::string& path, const Level& level);
// `level->cloud` is already there: the counts must agree. `photographs`: how many the survey has.
void ReadLevelAttributes(const std::string& path, std::uint64_t photographs, Level* level,
                         const Control& control = {});

}  // namespace sherd
