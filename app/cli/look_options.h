// How a picture is taken and lit: the options that render and compare share.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>

#include "app/cli/appearance_options.h"
#include "app/cli/command.h"
#include "app/cli/option_types.h"
#include "app/cli/source.h"
#include "app/project/picture.h"
#include "app/project/view.h"
#include "cuda/device_choice.h"
#include "metaball/renderer.h"
#include "metaball/scene.h"
#include "reconstruction/photographs.h"

namespace sherd::cli {

struct LookOptions {
  std::optional<Size> size;
  std::string photo, view;
  std::optional<Vec3d> eye, look_at, up;
  std::optional<double> fov_x, ortho_width, threshold, radius_scale, ambient, diffuse, supersample,
      level_of_detail, threads, dpi, photo_memory;
  bool ortho = false, unlit = false, show_unseen = false, as_shot = false;
  std::vector<std::string> leave_out;  // photographs, by name
  std::string color = "blend", backend = "auto", device, method = "ours", background = "1,1,1",
              photo_folder;
  int bits = 8;
  std::optional<DensityModel> density;
  std::string thresholds;  // empty: the source's
  AppearanceOptions appearance;

  // --backend and --device. Throws InputError where they contradict each other.
  DeviceChoice Device() const;
  bool photo_colors() const { return color == "photo"; }
  // Photographs are needed, for the camera or for the colours.
  bool needs_survey() const { return photo_colors() || !photo.empty(); }
  // A shader as the options say that works where `renderer`, one of RendererOf, draws. Both must
  // outlive it. Throws InputError for a photograph that does not exist.
  PhotographShader Photographs(const Survey& survey, Renderer* renderer) const;
  // Throws InputError where an option for photographs' colours is given without them.
  void CheckPhotoOptions() const;
  ViewRequest Request(bool keep_photo_shape) const;
  Lighting Light() const;
  Surface SurfaceOf(double level_threshold) const;
  // `own` but for what the options say.
  Surface SurfaceOf(Surface own) const;
  RenderSettings Settings(double default_supersample = 1) const;
};

// Adds the options in groups; what contradicts is refused by the parser.
void AddLookOptions(CLI::App* app, LookOptions* look);
// Only the camera's, but for --size.
void AddCameraOptions(CLI::App* app, LookOptions* look);
// Only the surface's and the light's, but for --color.
void AddSurfaceOptions(CLI::App* app, LookOptions* look);
void AddLightOptions(CLI::App* app, LookOptions* look);

// The renderer of Device(), with --level-of-detail around it where that is asked for; a line on
// stderr says why where the choice fell on the CPU although a GPU was wanted or might have been
// there.
std::unique_ptr<Renderer> RendererOf(const LookOptions& look, std::string* why);

Json ToJson(const Vec3d& v);
Json ToJson(const Camera& camera);
// Counts, rare events, seconds, memory and device of a render.
Json ToJson(const RenderStats& stats);

}  // namespace sherd::cli
