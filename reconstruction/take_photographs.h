// What the loaders of a survey share. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "reconstruction/colmap_model.h"
#include "reconstruction/survey.h"

namespace sherd {

// Moves cameras and photographs of `model` into the survey, the photographs by name: COLMAP's order
// in the file is that of registration, or of a hash table. photo_of[i] is the photograph made of
// image i of the file, or kNoPhoto where its camera is missing.
std::vector<std::uint32_t> TakePhotographs(ColmapModel* model, Survey* survey);

// "1 point", "2 points".
std::string Counted(std::uint64_t count, const char* one, const char* many);
// One warning for points that were dropped, where there are any.
void WarnNotFinite(const std::string& path, std::uint64_t count, Survey* survey);
// One warning where coordinates up to `largest` were stored as 32-bit numbers and lost digits by
// it. `what_to_do` ends the line.
void WarnOfFloats(const std::string& path, double largest, const std::string& what_to_do,
                  Survey* survey);
// 0 where there is no such file.
std::uint64_t FileBytes(const std::string& path);

}  // namespace sherd
