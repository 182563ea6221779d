// The GPU behind the frame pipeline (machine.h): memory, launches, CUB's sorts and scans, copies.
// Included by .cu files alone.
#pragma once

#include <cuda_runtime.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "cuda/kernels/block.h"
#include "cuda/machine.h"
#include "metaball/error.h"
#include "metaball/parallel.h"

namespace sherd {

// Throws DeviceError naming the call; ResourceError where memory is short, which a launch may want
// too. The error is cleared where CUDA lets it be.
inline void CheckCuda(cudaError_t code, const std::string& call) {
  if (code == cudaSuccess) return;
  cudaGetLastError();
  if (code == cudaErrorMemoryAllocation) {
    throw ResourceError("the GPU's memory is full: " + call, 0, 0);
  }
  throw DeviceError(call, static_cast<int>(code), cudaGetErrorString(code));
}

// body(i) for i in [begin, end).
template <class Body>
__global__ void __launch_bounds__(256)
    ForEachKernel(const __grid_constant__ Body body, std::uint64_t begin, std::uint64_t end) {
  const std::uint64_t i = begin + static_cast<std::uint64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i < end) body(i);
}

// The same where the body says how many threads a block has, and how many blocks a multiprocessor
// is to hold at least, which decides how many registers a thread gets.
template <class Body>
__global__ void __launch_bounds__(Body::kThreads, Body::kBlocksPerMultiprocessor)
    BoundedForEachKernel(const __grid_constant__ Body body, std::uint64_t begin,
                         std::uint64_t end) {
  const std::uint64_t i = begin + static_cast<std::uint64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i < end) body(i);
}

template <class Program>
__global__ void __launch_bounds__(Program::kThreads, Program::kBlocksPerMultiprocessor)
    BlockKernel(const __grid_constant__ Program program) {
  __shared__ alignas(16) unsigned char memory[sizeof(typename Program::Shared)];
  kernels::DeviceBlock<Program> block(reinterpret_cast<typename Program::Shared*>(memory));
  program(block);
}

struct PlusUint64 {
  __host__ __device__ std::uint64_t operator()(std::uint64_t a, std::uint64_t b) const {
    return a + b;
  }
};

class CudaEvent {
 public:
  CudaEvent() { CheckCuda(cudaEventCreate(&event_), "cudaEventCreate"); }
  ~CudaEvent() {
    if (event_) cudaEventDestroy(event_);
  }
  CudaEvent(CudaEvent&& other) noexcept : event_(std::exchange(other.event_, nullptr)) {}
  CudaEvent& operator=(CudaEvent&& other) noexcept {
    std::swap(event_, other.event_);
    return *this;
  }
  cudaEvent_t get() const { return event_; }

 private:
  cudaEvent_t event_ = nullptr;
};

class CudaStream {
 public:
  CudaStream() {
    CheckCuda(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "cudaStreamCreate");
  }
  ~CudaStream() {
    if (stream_) cudaStreamDestroy(stream_);
  }
  CudaStream(CudaStream&& other) noexcept : stream_(std::exchange(other.stream_, nullptr)) {}
  CudaStream& operator=(CudaStream&& other) noexcept {
    std::swap(stream_, other.stream_);
    return *this;
  }
  cudaStream_t get() const { return stream_; }

 private:
  cudaStream_t stream_ = nullptr;
};

// Page-locked host memory: what copies from the device can run into while kernels work.
class PinnedMemory {
 public:
  explicit PinnedMemory(std::size_t bytes) : size_(bytes) {
    CheckCuda(cudaMallocHost(&data_, bytes), "cudaMallocHost");
  }
  ~PinnedMemory() {
    if (data_) cudaFreeHost(data_);
  }
  PinnedMemory(PinnedMemory&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), size_(other.size_) {}
  PinnedMemory& operator=(PinnedMemory&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }
  unsigned char* data() const { return static_cast<unsigned char*>(data_); }
  std::size_t size() const { return size_; }

 private:
  void* data_ = nullptr;
  std::size_t size_ = 0;
};

class DeviceMachine {
 public:
  static constexpr bool kCountWork = false;

  template <class T>
  class Buffer {
   public:
    Buffer() = default;
    ~Buffer() {
      if (data_) cudaFree(data_);
    }
    Buffer(Buffer&& other) noexcept { *this = std::move(other); }
    Buffer& operator=(Buffer&& other) noexcept {
      std::swap(data_, other.data_);
      std::swap(size_, other.size_);
      std::swap(capacity_, other.capacity_);
      return *this;
    }
    T* data() { return data_; }
    const T* data() const { return data_; }
    std::size_t size() const { return size_; }
    std::uint64_t bytes() const { return capacity_ * sizeof(T); }

   private:
    friend DeviceMachine;
    T* data_ = nullptr;
    std::size_t size_ = 0, capacity_ = 0;
  };

  explicit DeviceMachine(int device) : device_(device) {}

  std::string memory_name() const { return "the GPU's memory"; }
  std::uint64_t ReservedBytes() const { return reserved_; }
  std::uint64_t AvailableBytes() const {
    std::size_t free = 0, total = 0;
    CheckCuda(cudaMemGetInfo(&free, &total), "cudaMemGetInfo");
    return free > kKeptFree ? free - kKeptFree : 0;
  }

  void EnableProfile(bool enable) { profile_ = enable; }

  // The host's thread may be another one than last time.
  void BeginFrame(std::stop_token stop, int) {
    CheckCuda(cudaSetDevice(device_), "cudaSetDevice");
    // What another renderer's end left in this thread is no fault of this one's first launch.
    cudaGetLastError();
    stop_ = std::move(stop);
    timed_ = 0;
  }
  void EndFrame() {
    Synchronize();
    times_.clear();
    for (std::size_t i = 0; i < timed_; ++i) {
      float ms = 0.0f;
      CheckCuda(cudaEventElapsedTime(&ms, timings_[i].begin.get(), timings_[i].end.get()),
                "cudaEventElapsedTime");
      times_.push_back({timings_[i].name, ms});
    }
  }
  const std::vector<KernelTime>& times() const { return times_; }

  template <class T>
  void Resize(Buffer<T>* buffer, std::size_t n, const char* what) {
    // A little more than asked for, so that a slowly growing need does not reallocate each frame.
    Resize(buffer, n, n + n / 8, what);
  }
  template <class T>
  void ResizeExactly(Buffer<T>* buffer, std::size_t n, const char* what) {
    Resize(buffer, n, n, what);
  }
  template <class T>
  void Release(Buffer<T>* buffer) {
    if (!buffer->data_) return;
    reserved_ -= buffer->bytes();
    T* data = std::exchange(buffer->data_, nullptr);
    buffer->size_ = buffer->capacity_ = 0;
    CheckCuda(cudaFree(data), "cudaFree");
  }
  void ReleaseScratch() { Release(&scratch_); }
  template <class Body>
  std::uint64_t LaunchBytes() const {
    static_assert(requires { Body::kBlocksPerMultiprocessor; });
    cudaFuncAttributes kernel;
    CheckCuda(cudaFuncGetAttributes(&kernel, BoundedForEachKernel<Body>), "cudaFuncGetAttributes");
    int multiprocessors = 0, threads = 0;
    CheckCuda(cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device_),
              "cudaDeviceGetAttribute");
    CheckCuda(cudaDeviceGetAttribute(&threads, cudaDevAttrMaxThreadsPerMultiProcessor, device_),
              "cudaDeviceGetAttribute");
    return kernel.localSizeBytes * static_cast<std::uint64_t>(multiprocessors) * threads;
  }
  template <class T>
  void Zero(Buffer<T>* buffer, std::size_t n) {
    if (n == 0) return;
    CheckCuda(cudaMemsetAsync(buffer->data(), 0, n * sizeof(T), stream_.get()), "cudaMemsetAsync");
  }
  template <class T>
  void Upload(Buffer<T>* buffer, std::size_t begin, const T* source, std::size_t n) {
    if (n == 0) return;
    // From ordinary memory: the call returns when the source may change.
    CheckCuda(cudaMemcpyAsync(buffer->data() + begin, source, n * sizeof(T), cudaMemcpyHostToDevice,
                              stream_.get()),
              "cudaMemcpyAsync to the GPU");
  }
  template <class T>
  void Download(T* destination, const Buffer<T>& buffer, std::size_t n) {
    const std::size_t bytes = n * sizeof(T);
    if (bytes > kSmallBytes) throw Error("DeviceMachine::Download is for small things");
    CheckCuda(
        cudaMemcpyAsync(small_.data(), buffer.data(), bytes, cudaMemcpyDeviceToHost, stream_.get()),
        "cudaMemcpyAsync from the GPU");
    Synchronize();
    std::memcpy(static_cast<void*>(destination), small_.data(), bytes);
  }
  // Through two pinned pieces in turn: one is made while the GPU fetches the other.
  template <class T, class Make>
  void Fill(Buffer<T>* buffer, std::size_t n, int threads, const char* what, const Make& make) {
    ResizeExactly(buffer, n, what);
    constexpr std::size_t kPiece = kPieceBytes / sizeof(T);
    constexpr std::size_t kPart = kPiece / 16;
    int piece = 0;
    for (std::size_t begin = 0; begin < n; begin += kPiece, piece ^= 1) {
      ThrowIfStopped();
      const std::size_t count = std::min(kPiece, n - begin);
      CheckCuda(cudaEventSynchronize(fetched_[piece].get()), "cudaEventSynchronize");
      T* const made = reinterpret_cast<T*>(pieces_[piece].data());
      ParallelFor(static_cast<std::int64_t>((count + kPart - 1) / kPart), threads,
                  [&](std::int64_t part, int) {
                    const std::size_t end = std::min(count, (part + 1) * kPart);
                    for (std::size_t i = part * kPart; i < end; ++i) made[i] = make(begin + i);
                  });
      CheckCuda(cudaMemcpyAsync(buffer->data() + begin, made, count * sizeof(T),
                                cudaMemcpyHostToDevice, stream_.get()),
                "cudaMemcpyAsync to the GPU");
      CheckCuda(cudaEventRecord(fetched_[piece].get(), stream_.get()), "cudaEventRecord");
    }
  }
  // Through the same two: one is filled by the GPU while the other is copied on.
  template <class T>
  void DownloadRect(T* destination, std::size_t stride, const Buffer<T>& buffer, std::size_t begin,
                    std::size_t buffer_stride, int width, int height) {
    const std::size_t row = static_cast<std::size_t>(width) * sizeof(T);
    const int rows = static_cast<int>(std::max<std::size_t>(1, kPieceBytes / row));
    const auto fetch = [&](int y, int piece) {
      const auto count = static_cast<std::size_t>(std::min(rows, height - y));
      CheckCuda(cudaMemcpy2DAsync(
                    pieces_[piece].data(), row, buffer.data() + begin + y * buffer_stride,
                    buffer_stride * sizeof(T), row, count, cudaMemcpyDeviceToHost, stream_.get()),
                "cudaMemcpy2DAsync of the picture");
      CheckCuda(cudaEventRecord(fetched_[piece].get(), stream_.get()), "cudaEventRecord");
    };
    fetch(0, 0);
    for (int y = 0, piece = 0; y < height; y += rows, piece ^= 1) {
      ThrowIfStopped();
      if (y + rows < height) fetch(y + rows, piece ^ 1);
      CheckCuda(cudaEventSynchronize(fetched_[piece].get()), LastWork());
      const int count = std::min(rows, height - y);
      // One thread copies less than the bus brings.
      const int parts =
          std::clamp<int>(static_cast<int>(count * row / kPartBytes), 1, kCopyThreads);
      ParallelFor(parts, parts, [&](std::int64_t part, int) {
        const auto end = static_cast<int>(count * (part + 1) / parts);
        for (auto k = static_cast<int>(count * part / parts); k < end; ++k) {
          std::memcpy(static_cast<void*>(destination + (y + k) * stride),
                      pieces_[piece].data() + k * row, row);
        }
      });
    }
  }

  template <class Body>
  void ForEach(const char* name, std::uint64_t n, const Body& body) {
    if (n == 0) return;
    ThrowIfStopped();
    const Timed timed(this, name);
    if constexpr (requires { Body::kThreadsAtOnce; }) {
      // One slice runs and one waits behind it: the GPU has work, and two are all that a frame
      // that is cancelled waits for.
      int slice = 0;
      for (std::uint64_t begin = 0; begin < n; begin += Body::kThreadsAtOnce, slice ^= 1) {
        if (begin >= 2 * Body::kThreadsAtOnce) {
          CheckCuda(cudaEventSynchronize(sliced_[slice].get()), LastWork());
          ThrowIfStopped();
        }
        LaunchForEach(name, body, begin, std::min(n, begin + Body::kThreadsAtOnce));
        CheckCuda(cudaEventRecord(sliced_[slice].get(), stream_.get()), "cudaEventRecord");
      }
    } else {
      LaunchForEach(name, body, 0, n);
    }
  }

  template <class Program>
  void ForEachBlock(const char* name, int blocks, const Program& program) {
    if (blocks == 0) return;
    ThrowIfStopped();
    const Timed timed(this, name);
    // Blocks are limited by shared memory, and read little else through the cache it shares.
    CheckCuda(
        cudaFuncSetAttribute(BlockKernel<Program>, cudaFuncAttributePreferredSharedMemoryCarveout,
                             cudaSharedmemCarveoutMaxShared),
        "cudaFuncSetAttribute");
    BlockKernel<Program>
        <<<static_cast<unsigned>(blocks), Program::kThreads, 0, stream_.get()>>>(program);
    CheckCuda(cudaGetLastError(), std::string("launch of ") + name);
  }

  void SortPairs(const char* name, SortBuffer<Buffer<std::uint32_t>>* keys,
                 SortBuffer<Buffer<std::uint32_t>>* values, std::uint64_t n, int bits) {
    if (n == 0) return;
    ThrowIfStopped();
    cub::DoubleBuffer<std::uint32_t> k(keys->content.data(), keys->room.data());
    cub::DoubleBuffer<std::uint32_t> v(values->content.data(), values->room.data());
    const auto count = static_cast<std::uint32_t>(n);
    std::size_t bytes = 0;
    CheckCuda(cub::DeviceRadixSort::SortPairs(nullptr, bytes, k, v, count, 0, bits, stream_.get()),
              name);
    Resize(&scratch_, bytes, "sorting");
    const Timed timed(this, name);
    CheckCuda(cub::DeviceRadixSort::SortPairs(scratch_.data(), bytes, k, v, count, 0, bits,
                                              stream_.get()),
              name);
    if (k.Current() != keys->content.data()) std::swap(keys->content, keys->room);
    if (v.Current() != values->content.data()) std::swap(values->content, values->room);
  }

  void ExclusiveSum(const char* name, const Buffer<std::uint32_t>& in, Buffer<std::uint64_t>* out,
                    std::uint64_t n) {
    const auto count = static_cast<std::uint32_t>(n);
    const auto scan = [&](void* room, std::size_t& bytes) {
      return cub::DeviceScan::ExclusiveScan(room, bytes, in.data(), out->data(), PlusUint64{},
                                            std::uint64_t{0}, count, stream_.get());
    };
    std::size_t bytes = 0;
    CheckCuda(scan(nullptr, bytes), name);
    Resize(&scratch_, bytes, "scanning");
    const Timed timed(this, name);
    CheckCuda(scan(scratch_.data(), bytes), name);
  }

  void Mark(FrameStage stage) {
    CheckCuda(cudaEventRecord(marks_[static_cast<int>(stage)].get(), stream_.get()),
              "cudaEventRecord");
  }
  // Waits for `to`.
  double Seconds(FrameStage from, FrameStage to) {
    CheckCuda(cudaEventSynchronize(marks_[static_cast<int>(to)].get()), LastWork());
    float ms = 0.0f;
    CheckCuda(cudaEventElapsedTime(&ms, marks_[static_cast<int>(from)].get(),
                                   marks_[static_cast<int>(to)].get()),
              "cudaEventElapsedTime");
    return ms * 1e-3;
  }

 private:
  static constexpr std::uint64_t kKeptFree = std::uint64_t{64} << 20;  // for the driver and others
  static constexpr std::size_t kPieceBytes = std::size_t{8} << 20;
  static constexpr std::size_t kPartBytes = std::size_t{1} << 20;
  static constexpr int kCopyThreads = 4;
  static constexpr std::size_t kSmallBytes = 4096;

  template <class Body>
  void LaunchForEach(const char* name, const Body& body, std::uint64_t begin, std::uint64_t end) {
    const auto blocks = [&](unsigned threads) {
      return static_cast<unsigned>((end - begin + threads - 1) / threads);
    };
    if constexpr (requires { Body::kBlocksPerMultiprocessor; }) {
      BoundedForEachKernel<Body>
          <<<blocks(Body::kThreads), Body::kThreads, 0, stream_.get()>>>(body, begin, end);
    } else {
      constexpr unsigned kThreads = 256;
      ForEachKernel<Body><<<blocks(kThreads), kThreads, 0, stream_.get()>>>(body, begin, end);
    }
    CheckCuda(cudaGetLastError(), std::string("launch of ") + name);
  }

  template <class T>
  void Resize(Buffer<T>* buffer, std::size_t n, std::size_t capacity, const char* what) {
    if (n > buffer->capacity_) {
      const std::uint64_t exact = n * sizeof(T);
      Release(buffer);
      // Room to grow must not take what is kept free.
      if (capacity * sizeof(T) > AvailableBytes()) capacity = n;
      cudaError_t code = cudaMalloc(reinterpret_cast<void**>(&buffer->data_), capacity * sizeof(T));
      if (code == cudaErrorMemoryAllocation) {
        cudaGetLastError();
        capacity = n;
        code = cudaMalloc(reinterpret_cast<void**>(&buffer->data_), exact);
      }
      if (code == cudaErrorMemoryAllocation) {
        cudaGetLastError();
        buffer->data_ = nullptr;
        const std::uint64_t free = AvailableBytes();
        throw ResourceError(std::string("the GPU's memory is full: ") + what + " need " +
                                std::to_string(exact >> 20) + " MB, " + std::to_string(free >> 20) +
                                " MB are free",
                            exact, free);
      }
      CheckCuda(code, "cudaMalloc");
      buffer->capacity_ = capacity;
      reserved_ += buffer->bytes();
    }
    buffer->size_ = n;
  }

  struct Timing {
    std::string name;
    CudaEvent begin, end;
  };
  // Records a launch's begin and end when the profile is on.
  class Timed {
   public:
    Timed(DeviceMachine* machine, const char* name) : machine_(machine) {
      machine_->last_work_ = name;
      if (!machine_->profile_) return;
      if (machine_->timed_ == machine_->timings_.size()) machine_->timings_.push_back({});
      Timing& timing = machine_->timings_[machine_->timed_];
      timing.name = name;
      CheckCuda(cudaEventRecord(timing.begin.get(), machine_->stream_.get()), "cudaEventRecord");
    }
    ~Timed() {
      if (!machine_->profile_) return;
      cudaEventRecord(machine_->timings_[machine_->timed_].end.get(), machine_->stream_.get());
      ++machine_->timed_;
    }

   private:
    DeviceMachine* machine_;
  };

  void ThrowIfStopped() const {
    if (stop_.stop_requested()) throw Cancelled();
  }
  // An error that comes to light while waiting belongs to what was launched before.
  std::string LastWork() const { return std::string("the work up to ") + last_work_; }
  void Synchronize() const { CheckCuda(cudaStreamSynchronize(stream_.get()), LastWork()); }

  // Sets the device before the members below are made on it.
  struct OnDevice {
    explicit OnDevice(int device) { CheckCuda(cudaSetDevice(device), "cudaSetDevice"); }
  };

  int device_;
  OnDevice on_device_{device_};
  CudaStream stream_;
  std::array<CudaEvent, 4> marks_;
  std::array<CudaEvent, 2> fetched_;  // the last copy to or from each of the pieces
  std::array<CudaEvent, 2> sliced_;   // the slices of a long launch that were begun last
  PinnedMemory small_{kSmallBytes};
  std::array<PinnedMemory, 2> pieces_{PinnedMemory(kPieceBytes), PinnedMemory(kPieceBytes)};
  Buffer<unsigned char> scratch_;
  std::uint64_t reserved_ = 0;
  std::stop_token stop_;
  const char* last_work_ = "the frame's begin";
  bool profile_ = false;
  std::size_t timed_ = 0;
  std::vector<Timing> timings_;
  std::vector<KernelTime> times_;
};

}  // namespace sherd
