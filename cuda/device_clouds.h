// The clouds that were drawn last, in the machine's memory: levels of detail that follow the camera
// and densities that are compared are not brought over again at every change. Only those that
// somebody still holds, and only while nothing else needs the room.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <list>
#include <memory>

#include "cuda/device_cloud.h"
#include "metaball/color.h"
#include "metaball/scene.h"

namespace sherd {

template <class Machine>
class DeviceClouds {
 public:
  bool Holds(const std::shared_ptr<const Cloud>& cloud) const {
    return std::ranges::any_of(clouds_,
                               [&](const DeviceCloud<Machine>& held) { return held.Holds(cloud); });
  }

  // Makes the scene's cloud the current one, as DeviceCloud::Use does. The others stay while they
  // take no more than a quarter of the memory that the machine has to give.
  void Use(const Scene& scene, int threads, Machine* machine) {
    for (auto it = clouds_.begin(); it != clouds_.end();) {
      const auto held = it++;
      if (held->Expired()) Erase(held, machine);
    }
    const auto known = std::ranges::find_if(
        clouds_, [&](const DeviceCloud<Machine>& held) { return held.Holds(scene.cloud); });
    if (known != clouds_.end()) {
      clouds_.splice(clouds_.begin(), clouds_, known);
    } else {
      const std::uint64_t room = machine->AvailableBytes() + machine->ReservedBytes();
      while (!clouds_.empty() && (clouds_.size() == kMost || Bytes() > room / 4)) {
        Erase(std::prev(clouds_.end()), machine);
      }
      clouds_.emplace_front();
    }
    clouds_.front().Use(scene, threads, machine);
    if (srgb_table_.size() == 0) {
      machine->Fill(&srgb_table_, 256, 1, "tables",
                    [](std::size_t i) { return SrgbToLinearTable()[i]; });
    }
  }

  // After Use.
  DeviceCloud<Machine>& current() { return clouds_.front(); }
  const DeviceCloud<Machine>& current() const { return clouds_.front(); }

  // What 8-bit colours of all clouds stand for: 256 values.
  const float* linear_from_srgb() const { return srgb_table_.data(); }

  // Of the clouds alone.
  std::uint64_t Bytes() const {
    std::uint64_t bytes = 0;
    for (const DeviceCloud<Machine>& held : clouds_) bytes += held.Bytes();
    return bytes;
  }
  // Of all but the current one.
  std::uint64_t OtherBytes() const { return clouds_.empty() ? 0 : Bytes() - current().Bytes(); }
  void ReleaseOthers(Machine* machine) {
    while (clouds_.size() > 1) Erase(std::prev(clouds_.end()), machine);
  }

 private:
  static constexpr std::size_t kMost = 8;

  void Erase(typename std::list<DeviceCloud<Machine>>::iterator it, Machine* machine) {
    it->Release(machine);
    clouds_.erase(it);
  }

  typename Machine::template Buffer<float> srgb_table_;
  std::list<DeviceCloud<Machine>> clouds_;  // the current one first, then by when they were drawn
};

}  // namespace sherd
