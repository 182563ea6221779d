// Photographs on a frame's surface by a GPU: photo_pass.h over a DeviceMachine.
#include "cuda/photo_shader.h"

#include <algorithm>
#include <utility>

#include "cuda/device_machine.h"
#include "cuda/photo_pass.h"

namespace sherd {

std::unique_ptr<ProfilingPhotoShader> MakeCudaPhotoShader(std::uint64_t pool_bytes, int gpu) {
  constexpr std::uint64_t kMostBytes = std::uint64_t{4} << 30;
  DeviceMachine machine(gpu);
  if (pool_bytes == 0) pool_bytes = std::min(machine.AvailableBytes() / 4, kMostBytes);
  return std::make_unique<PhotoPass<DeviceMachine>>(std::move(machine), pool_bytes);
}

}  // namespace sherd
