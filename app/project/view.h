// From what a user asks to see to a Camera: photographs, numbered presets, explicit cameras.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/project/preset_axes.h"
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
  bool orthographic = false;              // without ortho_width: as wide as `bounds` needs
  ViewPreset preset = ViewPreset::kIso;   // fitting `bounds`
  // A photograph whose shape is not the picture's: false stretches its intrinsics to the size,
  // true shows it whole and undistorted, with more of the scene on two sides.
  bool keep_photo_shape = false;
};

// What a camera is made from. `survey` may be null (a bare cloud): then there are no photographs.
struct ViewContext {
  Box3d bounds;
  std::optional<Vec3d> up;     // default: +z
  std::optional<Vec3d> front;  // the direction in which "front" looks; default: see PresetAxes
  const Survey* survey = nullptr;
  // Some of the points inside `bounds`, world: the presets then fit these (but for the outermost
  // 0.2 % on each side) instead of the box's corners. May be empty.
  std::vector<Vec3d> points;
};

// At most `count` of the points inside `bounds`, evenly taken from their order.
std::vector<Vec3d> SamplePoints(const std::vector<Vec3d>& points, const Box3d& bounds,
                                std::size_t count = 4096);

// Width over height of what the view shows of the points, for choosing a picture's shape; 1 where
// nothing can be said. A photograph's own shape.
double SubjectAspect(const ViewContext& context, const ViewRequest& request);

// The photograph called `name`, or whose name ends in it ("DSC05083", "left/0001.jpg"), without
// regard to case where nothing else fits. Throws InputError (see MakeCamera).
std::size_t FindPhotograph(const Survey& survey, const std::string& name);

// Throws InputError for a photograph that does not exist or is ambiguous (naming near ones).
Camera MakeCamera(const ViewContext& context, const ViewRequest& request, int width, int height);

// For a caption: "top, orthographic", "photograph DSC05083.JPG", "eye 1, 2, 3".
std::string DescribeView(const ViewRequest& request);

}  // namespace sherd
