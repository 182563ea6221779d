// A COLMAP workspace small enough to be written, imported and built in a moment: a wavy square of
// 2 x 2 units in the x-y plane, z up, with four photographs.
#pragma once

#include <string>
#include <vector>

#include "metaball/camera.h"
#include "metaball/cloud.h"
#include "reconstruction/survey.h"

namespace sherd::testing {

// A fresh, empty folder of the running test under ::testing::TempDir().
std::string FreshFolder(const std::string& name);

void WriteText(const std::string& path, const std::string& text);
std::string ReadText(const std::string& path);
// Names of what lies in a folder, sorted.
std::vector<std::string> Listing(const std::string& folder);

inline constexpr int kPhotoWidth = 160, kPhotoHeight = 120;

// The surface: n points, or somewhat fewer.
std::vector<Vec3d> WavyPoints(int n);
Rgb8 WavyColor(const Vec3d& p);

// Where the photographs were taken; photo_1.png to photo_4.png, photo_4 in the folder "late".
std::vector<Photograph> WavyPhotographs();
Camera WavyCamera(int photograph);

// sparse/0 as text; images/ with every photograph where `with_images`; no points within `hole` of
// the middle.
void WriteWorkspace(const std::string& folder, int points, bool with_images = true,
                    double hole = 0);
// x y z, radius and colour, ascii.
void WritePly(const std::string& path, int points);

// The survey that an import of the workspace should find, made without any file.
Survey WavySurvey(int points);

}  // namespace sherd::testing
