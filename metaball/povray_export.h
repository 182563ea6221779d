// A scene in POV-Ray's language (povray.org), for comparison and for its lights and materials.
//
// POV-Ray's blob is Murakami's density: a sphere component of strength s and radius r adds
// s (1 - d^2 / r^2)^2, textures are blended by the components' shares, and the surface is where the
// sum reaches the threshold. So the picture is the same. Values are linear light: render with
// File_Gamma=1.0 to compare numbers.
#pragma once

#include <string>

#include "metaball/camera.h"
#include "metaball/scene.h"

namespace sherd {

// Writes blob, camera, light and black background. The picture's shape is the camera's: render with
// +W and +H of its size. Where the metaballs lie far from zero (surveys in UTM coordinates), all
// coordinates are relative to the point that a comment on the first lines names. Throws Error for a
// density, threshold mode or thresholds that no blob has, saying what can be done instead;
// OutputError, and then no file of that name was made or changed.
void WritePovRay(const std::string& path, const Scene& scene, const Camera& camera);

}  // namespace sherd
