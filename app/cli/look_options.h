// How a picture is taken and lit: the options that render and compare share.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>

#include "app/cli/command.h"
#include "app/cli/option_types.h"
#include "app/cli/source.h"
#include "app/project/picture.h"
#include "app/project/view.h"
#include "metaball/renderer.h"
#include "metaball/scene.h"

namespace sherd::cli {

struct LookOptions {
  std::optional<Size> size;
  std::string photo, view;
  std::optional<Vec3d> eye, look_at, up, light;
  std::optional<double> fov_x, ortho_width, threshold, radius_scale, ambient, diffuse, supersample,
      threads, dpi;
  bool ortho = false, unlit = false;
  std::string color = "blend", backend = "auto", background = "1,1,1", photo_folder;
  int bits = 8;

  bool photo_colors() const { return color == "photo"; }
  // Photographs are needed, for the camera or for the colours.
  bool needs_survey() const { return photo_colors() || !photo.empty(); }
  ViewRequest Request(bool keep_photo_shape) const;
  Lighting Light() const;
  Surface SurfaceOf(double level_threshold) const;
  RenderSettings Settings(double default_supersample = 1) const;
};

// Adds the options in groups; what contradicts is refused by the parser.
void AddLookOptions(CLI::App* app, LookOptions* look);

// --backend's renderer; a line on stderr says why where the choice fell on the CPU although a GPU
// was wanted or might have been there.
std::unique_ptr<Renderer> RendererOf(const LookOptions& look, std::string* why);

Json ToJson(const Vec3d& v);
Json ToJson(const Camera& camera);
// Counts, rare events, seconds, memory and device of a render.
Json ToJson(const RenderStats& stats);

}  // namespace sherd::cli
