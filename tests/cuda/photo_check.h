// Photographs' colours by a backend against the formulas' own, and against the host loop.
#pragma once

#include <cstdint>
#include <string>

#include "cuda/photo_shader.h"
#include "json_writer.h"

namespace sherd {

struct PhotoCheck {
  std::string backend;
  bool holes = false;
  std::uint64_t pool_bytes = 0, pixels = 0;
  std::uint64_t pixels_off = 0, allowed = 0;
  ProfilingPhotoShader::Use use;
  double seconds = 0;  // of a second picture
  bool passed = false;
  std::string error;
};

// backend: "host-loop" or "cuda". A field photographed in noise; with holes the host loop is what a
// GPU is compared with, and is compared with itself in a roomy pool.
PhotoCheck CheckPhotos(const std::string& backend, std::uint64_t pool_bytes, bool holes);

void Print(const PhotoCheck& check);
void Write(const PhotoCheck& check, JsonWriter* json);

}  // namespace sherd
