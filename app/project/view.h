// From what a user asks to see to a Camera: photographs, numbered presets, explicit cameras.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "metaball/camera.h"
#include "reconstruction/survey.h"

namespace sherd {

enum class ViewPreset { kFront, kBack, kLeft, kRight, kTop, kBottom, kIso };
// "front", "back", ... ; InputError listing the names.
ViewPreset ParseViewPreset(const std::string& name);
const std::vector<std::string>& ViewPresetNames();

struct ViewRequest {
  // The first of these that is set decides: photograph, explicit eye, preset.
  std::string photo;                      // a photograph's name, or the end of one
  std::optional<Vec3d> eye, look_at, up;  // world
  std::optional<double> fov_x_deg;        // (0, 180); default 50
  std::optional<double> ortho_width;      // world units: orthographic
  ViewPreset preset = ViewPreset::kIso;   // perspective fitting `bounds`, unless ortho_width is set
};

// What a camera is made from. `survey` may be null (a bare cloud): then there are no photographs.
struct ViewContext {
  Box3d bounds;
  std::optional<Vec3d> up;  // default: +z
  const Survey* survey = nullptr;
};

// Throws InputError for a photograph that does not exist or is ambiguous (naming near ones).
Camera MakeCamera(const ViewContext& context, const ViewRequest& request, int width, int height);

}  // namespace sherd
