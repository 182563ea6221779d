// The kernels' bodies run by plain loops on the CPU, standard algorithms in CUB's place. Slow and
// simple: what every machine without a GPU proves the kernels with.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <numeric>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "cuda/kernels/block.h"
#include "cuda/machine.h"
#include "metaball/error.h"
#include "metaball/parallel.h"

namespace sherd {

// CountWork: compile the kernels that count their operations.
template <bool CountWork>
class HostMachine {
 public:
  static constexpr bool kCountWork = CountWork;

  template <class T>
  class Buffer {
   public:
    T* data() { return values_.get(); }
    const T* data() const { return values_.get(); }
    std::size_t size() const { return size_; }
    std::uint64_t bytes() const { return capacity_ * sizeof(T); }

   private:
    friend HostMachine;
    std::unique_ptr<T[]> values_;
    std::size_t size_ = 0, capacity_ = 0;
  };

  HostMachine(std::uint64_t memory_bytes, kernels::ThreadOrder order)
      : memory_bytes_(memory_bytes), order_(order) {}

  std::string memory_name() const { return "memory"; }
  std::uint64_t ReservedBytes() const { return reserved_; }
  std::uint64_t AvailableBytes() const {
    return memory_bytes_ > reserved_ ? memory_bytes_ - reserved_ : 0;
  }

  void EnableProfile(bool enable) { profile_ = enable; }

  void BeginFrame(std::stop_token stop, int threads) {
    stop_ = std::move(stop);
    threads_ = threads;
    times_.clear();
  }
  void EndFrame() {}
  const std::vector<KernelTime>& times() const { return times_; }

  template <class T>
  void Resize(Buffer<T>* buffer, std::size_t n, const char* what) {
    if (n > buffer->capacity_) {
      const std::uint64_t bytes = n * sizeof(T);
      const std::uint64_t free = AvailableBytes() + buffer->bytes();
      if (bytes > free) {
        throw ResourceError(std::string(what) + ": out of memory", bytes, free);
      }
      Release(buffer);
      buffer->values_ = std::make_unique_for_overwrite<T[]>(n);
      buffer->capacity_ = n;
      reserved_ += bytes;
    }
    buffer->size_ = n;
    // What a kernel reads before it is written must not look like something.
    if (n > 0) std::memset(static_cast<void*>(buffer->data()), 0xcd, n * sizeof(T));
  }
  template <class T>
  void ResizeExactly(Buffer<T>* buffer, std::size_t n, const char* what) {
    Resize(buffer, n, what);
  }
  template <class T>
  void Release(Buffer<T>* buffer) {
    reserved_ -= buffer->bytes();
    *buffer = {};
  }
  void ReleaseScratch() {}
  template <class Body>
  std::uint64_t LaunchBytes() const {
    return 0;
  }
  template <class T>
  void Zero(Buffer<T>* buffer, std::size_t n) {
    std::memset(static_cast<void*>(buffer->data()), 0, n * sizeof(T));
  }
  template <class T>
  void Upload(Buffer<T>* buffer, std::size_t begin, const T* source, std::size_t n) {
    std::copy_n(source, n, buffer->data() + begin);
  }
  template <class T>
  void Download(T* destination, const Buffer<T>& buffer, std::size_t n) {
    std::copy_n(buffer.data(), n, destination);
  }
  template <class T, class Make>
  void Fill(Buffer<T>* buffer, std::size_t n, int threads, const char* what, const Make& make) {
    Resize(buffer, n, what);
    InPieces(n, threads, [&](std::size_t i) { buffer->data()[i] = make(i); });
  }
  template <class T>
  void DownloadRect(T* destination, std::size_t stride, const Buffer<T>& buffer, std::size_t begin,
                    std::size_t buffer_stride, int width, int height) {
    for (int y = 0; y < height; ++y) {
      std::copy_n(buffer.data() + begin + y * buffer_stride, width, destination + y * stride);
    }
  }

  template <class Body>
  void ForEach(const char* name, std::uint64_t n, const Body& body) {
    const Timed timed(this, name);
    InPieces(n, threads_, body);
  }

  template <class Program>
  void ForEachBlock(const char* name, int blocks, const Program& program) {
    const Timed timed(this, name);
    struct Arena {
      alignas(16) std::byte shared[sizeof(typename Program::Shared)];
      std::array<typename Program::Ray, Program::kThreads> rays;
    };
    std::vector<std::unique_ptr<Arena>> arenas(ThreadCount(threads_));
    ParallelFor(blocks, threads_, [&](std::int64_t index, int worker) {
      ThrowIfStopped();
      if (!arenas[worker]) arenas[worker] = std::make_unique<Arena>();
      Arena& arena = *arenas[worker];
      std::memset(arena.shared, 0xcd, sizeof(arena.shared));  // as on the device: no content
      arena.rays.fill({});
      kernels::HostBlock<Program> block(arena.shared, arena.rays.data(), static_cast<int>(index),
                                        order_);
      program(block);
    });
  }

  void SortPairs(const char* name, SortBuffer<Buffer<std::uint32_t>>* keys,
                 SortBuffer<Buffer<std::uint32_t>>* values, std::uint64_t n, int bits) {
    const Timed timed(this, name);
    const std::uint32_t mask = bits >= 32 ? ~0u : (1u << bits) - 1;
    std::vector<std::uint64_t> pairs(n);
    for (std::uint64_t i = 0; i < n; ++i) {
      pairs[i] =
          static_cast<std::uint64_t>(keys->content.data()[i]) << 32 | values->content.data()[i];
    }
    std::stable_sort(pairs.begin(), pairs.end(), [mask](std::uint64_t a, std::uint64_t b) {
      return (static_cast<std::uint32_t>(a >> 32) & mask) <
             (static_cast<std::uint32_t>(b >> 32) & mask);
    });
    for (std::uint64_t i = 0; i < n; ++i) {
      keys->content.data()[i] = static_cast<std::uint32_t>(pairs[i] >> 32);
      values->content.data()[i] = static_cast<std::uint32_t>(pairs[i]);
    }
  }

  void ExclusiveSum(const char* name, const Buffer<std::uint32_t>& in, Buffer<std::uint64_t>* out,
                    std::uint64_t n) {
    const Timed timed(this, name);
    std::exclusive_scan(in.data(), in.data() + n, out->data(), std::uint64_t{0});
  }

  void Mark(FrameStage stage) { marks_[static_cast<int>(stage)] = Clock::now(); }
  double Seconds(FrameStage from, FrameStage to) const {
    return std::chrono::duration<double>(marks_[static_cast<int>(to)] -
                                         marks_[static_cast<int>(from)])
        .count();
  }

 private:
  using Clock = std::chrono::steady_clock;

  class Timed {
   public:
    Timed(HostMachine* machine, const char* name) : machine_(machine), name_(name) {}
    ~Timed() {
      if (!machine_->profile_) return;
      const std::chrono::duration<double, std::milli> took = Clock::now() - begin_;
      machine_->times_.push_back({name_, took.count()});
    }

   private:
    HostMachine* machine_;
    const char* name_;
    Clock::time_point begin_ = Clock::now();
  };

  template <class Body>
  void InPieces(std::uint64_t n, int threads, const Body& body) const {
    constexpr std::uint64_t kPiece = 4096;
    ParallelFor(static_cast<std::int64_t>((n + kPiece - 1) / kPiece), threads,
                [&](std::int64_t piece, int) {
                  ThrowIfStopped();
                  const std::uint64_t begin = static_cast<std::uint64_t>(piece) * kPiece;
                  const std::uint64_t end = std::min(n, begin + kPiece);
                  for (std::uint64_t i = begin; i < end; ++i) body(i);
                });
  }

  void ThrowIfStopped() const {
    if (stop_.stop_requested()) throw Cancelled();
  }

  std::uint64_t memory_bytes_, reserved_ = 0;
  kernels::ThreadOrder order_;
  int threads_ = 0;
  std::stop_token stop_;
  std::array<Clock::time_point, 4> marks_{};
  bool profile_ = false;
  std::vector<KernelTime> times_;
};

}  // namespace sherd
