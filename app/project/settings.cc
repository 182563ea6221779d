#include "app/project/settings.h"

#include <string>

#include "metaball/error.h"

namespace sherd {
namespace {

constexpr SettingInfo kSettings[] = {
    {"threshold", "Threshold", "", "field value of the surface (thesis 2.8); lower is fuller", 1e-6,
     1e6, 0.7, 3},
    {"radius-scale", "Radius factor", "", "multiplies every metaball's radius", 1e-3, 1e3, 1.0, 2},
    {"ambient", "Ambient light", "", "share of the colour that is always there", 0.0, 10.0, 0.35,
     2},
    {"diffuse", "Diffuse light", "", "share of the colour that depends on the light's angle", 0.0,
     10.0, 0.65, 2},
    {"fov-x", "Field of view", "deg", "horizontal angle of a perspective picture", 1.0, 170.0, 50.0,
     1},
    {"supersample", "Samples per side", "px", "n x n rays a pixel", 1.0, 8.0, 1.0, 0},
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
