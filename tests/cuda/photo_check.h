// Photographs looked up by a backend against the CPU.
#pragma once

#include <cstdint>
#include <string>

#include "cuda/photo_sampler.h"
#include "json_writer.h"

namespace sherd {

struct PhotoCheck {
  std::string backend;
  std::uint64_t pool_bytes = 0, lookups = 0;
  double largest_difference = 0;  // linear colour
  PhotoTileSampler::Use use;
  double seconds = 0;
  bool passed = false;
  std::string error;
};

// backend: "host-loop" or "cuda". Some hundred thousand lookups in photographs of noise.
PhotoCheck CheckPhotos(const std::string& backend, std::uint64_t pool_bytes);

void Print(const PhotoCheck& check);
void Write(const PhotoCheck& check, JsonWriter* json);

}  // namespace sherd
