// The few operations that are spelled differently on the device and on the host.
#pragma once

#include <atomic>
#include <bit>
#include <cstdint>
#include <cstring>

#include "metaball/hostdevice.h"

namespace sherd::kernels {

// Integer atomics: order does not change their result, so a frame repeats itself exactly.
SHERD_HD void AtomicMin(std::uint32_t* target, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  atomicMin(target, value);
#else
  std::atomic_ref<std::uint32_t> ref(*target);
  std::uint32_t seen = ref.load();
  while (value < seen && !ref.compare_exchange_weak(seen, value)) {
  }
#endif
}

SHERD_HD void AtomicMax(std::uint32_t* target, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  atomicMax(target, value);
#else
  std::atomic_ref<std::uint32_t> ref(*target);
  std::uint32_t seen = ref.load();
  while (value > seen && !ref.compare_exchange_weak(seen, value)) {
  }
#endif
}

SHERD_HD void AtomicAdd(std::uint32_t* target, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  atomicAdd(target, value);
#else
  std::atomic_ref<std::uint32_t>(*target).fetch_add(value);
#endif
}

SHERD_HD void AtomicAdd(unsigned long long* target, unsigned long long value) {
#if defined(__CUDA_ARCH__)
  atomicAdd(target, value);
#else
  std::atomic_ref<unsigned long long>(*target).fetch_add(value);
#endif
}

// The value before.
SHERD_HD std::uint32_t AtomicFetchAdd(std::uint32_t* target, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  return atomicAdd(target, value);
#else
  return std::atomic_ref<std::uint32_t>(*target).fetch_add(value);
#endif
}

// For values that several threads may write at once, all of them the same, and that need not be
// seen at once: through the caches.
SHERD_HD std::uint32_t LoadRelaxed(const std::uint32_t* from) {
#if defined(__CUDA_ARCH__)
  return *from;
#else
  return std::atomic_ref<std::uint32_t>(*const_cast<std::uint32_t*>(from))
      .load(std::memory_order_relaxed);
#endif
}
SHERD_HD void StoreRelaxed(std::uint32_t* to, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  *to = value;
#else
  std::atomic_ref<std::uint32_t>(*to).store(value, std::memory_order_relaxed);
#endif
}

SHERD_HD std::uint32_t BitsOf(float v) {
#if defined(__CUDA_ARCH__)
  return __float_as_uint(v);
#else
  return std::bit_cast<std::uint32_t>(v);
#endif
}

SHERD_HD float FloatOf(std::uint32_t bits) {
#if defined(__CUDA_ARCH__)
  return __uint_as_float(bits);
#else
  return std::bit_cast<float>(bits);
#endif
}

// Unsigned integers in the order of the floats (no NaN), and back.
SHERD_HD std::uint32_t OrderedBits(float v) {
  const std::uint32_t bits = BitsOf(v);
  return bits & 0x80000000u ? ~bits : bits | 0x80000000u;
}
SHERD_HD float FloatFromOrdered(std::uint32_t ordered) {
  return FloatOf(ordered & 0x80000000u ? ordered & 0x7fffffffu : ~ordered);
}

}  // namespace sherd::kernels
