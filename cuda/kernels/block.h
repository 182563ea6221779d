// How a block of threads runs a program written for both machines.
//
// A program P has kThreads, a type Shared (the block's common memory, not initialised), a type Ray
// (a thread's own state) and operator()(Block&). In it:
//   block.shared(), block.index()
//   block.Each(f)      f(thread, ray) for every thread, then a barrier
//   block.EachAny(f)   the same; true when any of them returned true
// Between two barriers no thread may read what another one writes; the host runs the threads one
// after another in any order it is told, so a program that breaks this rule gives different
// pictures for different orders (a test).
#pragma once

#include <cstdint>
#include <cstring>
#include <vector>

#include "metaball/hostdevice.h"

namespace sherd::kernels {

enum class ThreadOrder { kForward, kBackward, kInterleaved };

template <class Program>
class HostBlock {
 public:
  HostBlock(void* shared_memory, typename Program::Ray* rays, int index, ThreadOrder order)
      : shared_(static_cast<typename Program::Shared*>(shared_memory)),
        rays_(rays),
        index_(index),
        order_(order) {}

  typename Program::Shared& shared() { return *shared_; }
  int index() const { return index_; }

  template <class F>
  void Each(const F& f) {
    for (int k = 0; k < Program::kThreads; ++k) f(Thread(k), rays_[Thread(k)]);
  }
  template <class F>
  bool EachAny(const F& f) {
    bool any = false;
    for (int k = 0; k < Program::kThreads; ++k) any |= f(Thread(k), rays_[Thread(k)]);
    return any;
  }

 private:
  int Thread(int k) const {
    switch (order_) {
      case ThreadOrder::kBackward:
        return Program::kThreads - 1 - k;
      case ThreadOrder::kInterleaved:
        return k * 37 % Program::kThreads;  // 37 and the power of two have no common factor
      default:
        return k;
    }
  }

  typename Program::Shared* shared_;
  typename Program::Ray* rays_;
  int index_;
  ThreadOrder order_;
};

#if defined(__CUDACC__)
template <class Program>
class DeviceBlock {
 public:
  __device__ explicit DeviceBlock(typename Program::Shared* shared) : shared_(shared) {}
  __device__ typename Program::Shared& shared() { return *shared_; }
  __device__ int index() const { return static_cast<int>(blockIdx.x); }

  template <class F>
  __device__ __forceinline__ void Each(const F& f) {
    f(static_cast<int>(threadIdx.x), ray_);
    __syncthreads();
  }
  template <class F>
  __device__ __forceinline__ bool EachAny(const F& f) {
    return __syncthreads_or(f(static_cast<int>(threadIdx.x), ray_)) != 0;
  }

 private:
  typename Program::Shared* shared_;
  typename Program::Ray ray_;
};
#endif

}  // namespace sherd::kernels
