#include "app/project/settings.h"

#include <string>

#include "metaball/error.h"

namespace sherd {
namespace {

constexpr SettingInfo kSettings[] = {
    // The surface.
    {"threshold", "Threshold", "", "field value of the surface (thesis 2.8); lower is fuller", 1e-6,
     1e6, 0.7, 3},
    {"radius-scale", "Radius factor", "", "multiplies every metaball's radius", 1e-3, 1e3, 1.0, 2},
    // Light (thesis 3.7).
    {"ambient", "Ambient light", "", "share of the colour that is always there", 0.0, 10.0, 0.35,
     2},
    {"diffuse", "Diffuse light", "", "share of the colour that depends on the light's angle", 0.0,
     10.0, 0.65, 2},
    {"ao-directions", "Ambient directions", "",
     "directions in which a surface point looks for the sky", 4.0, 1024.0, 32.0, 0},
    {"ao-distance", "Ambient distance", "world units",
     "how far away something still hides the sky (0: a tenth of the cloud's diagonal)", 0.0, 1e12,
     0.0, 3},
    // The picture.
    {"filter", "Low-pass filter", "px",
     "mean over a square of so many pixels (thesis 4.3): 1, 3, 5, 7, 9 or 11", 1.0, 11.0, 1.0, 0},
    {"fov-x", "Field of view", "deg", "horizontal angle of a perspective picture", 1.0, 170.0, 50.0,
     1},
    {"ortho-width", "Picture width", "world units",
     "orthographic picture of this width (default: what fits)", 1e-12, 1e12, 0.0, 3},
    {"supersample", "Samples per side", "px", "n x n rays a pixel", 1.0, 8.0, 1.0, 0},
    {"level-of-detail", "Level of detail", "px",
     "merges metaballs below a pixel where the surface stays within so many pixels (0: never)", 0.0,
     100.0, 0.0, 2},
    {"dpi", "Dots per inch", "1/in", "resolution written into the picture file (0: none)", 0.0,
     100000.0, 0.0, 0},
    {"reference-threshold", "Largest difference", "1/255",
     "largest root mean square difference from the reference", 0.0, 255.0, 1.0, 2},
    {"photo-memory", "Memory for photographs", "MiB",
     "bounds the photographs' pixels and depth maps held at a time", 1.0, 1e6, 1024.0, 0},
    {"threads", "Threads", "", "threads of the CPU renderer (0: all)", 0.0, 1024.0, 0.0, 0},
    // Levels.
    {"radius-factor", "Radius per spacing", "",
     "a metaball's radius as a multiple of the local spacing of the points (0: the default)", 0.0,
     100.0, 0.0, 2},
    {"photos-per-metaball", "Photographs per metaball", "",
     "photographs remembered for each metaball, best first", 1.0, 64.0, 8.0, 0},
    // The survey.
    {"metres-per-unit", "Metres per unit", "m", "length of one world unit", 1e-12, 1e12, 1.0, 6},
};

}  // namespace

std::span<const SettingInfo> Settings() { return kSettings; }

const SettingInfo& Setting(std::string_view name) {
  for (const SettingInfo& setting : kSettings) {
    if (setting.name == name) return setting;
  }
  throw Error("no setting is called " + std::string(name));
}

}  // namespace sherd
