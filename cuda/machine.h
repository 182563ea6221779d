// What the frame pipeline asks of the machine it runs on. The GPU (device_machine.h) and the
// host loop (host_machine.h) answer the same questions, so the pipeline is one text.
//
//   template <class T> class Buffer     memory of the machine: data(), size(), bytes()
//   Resize(&buffer, n, what)            n elements; the content is lost when it grows
//   ResizeExactly(&buffer, n, what)     the same without room to grow
//   Release(&buffer), ReleaseScratch()   gives memory back
//   Zero(&buffer, n)                    the first n elements
//   Upload(&buffer, begin, source, n), Download(destination, buffer, n)
//                                       Download waits for all work before it
//   Fill(&buffer, n, threads, what, make)
//                                       resizes and uploads make(i), called on that many threads
//   DownloadRect(destination, stride, buffer, begin, buffer_stride, width, height)
//                                       rows of a rectangle; strides in elements
//   AvailableBytes()                    memory that could still be reserved
//   ForEach(name, n, body)              body(i) for i in [0, n); Body::kThreadsAtOnce, if there is
//                                       one, bounds the work that cannot be stopped any more
//   LaunchBytes<Body>()                 memory that ForEach itself wants for its threads' own
//   arrays ForEachBlock(name, n, program)      program(block) for each of n blocks (block.h)
//   SortPairs(&keys, &values, n, bits)  stable, by the low `bits` of the keys
//   ExclusiveSum(in, &out, n)           32-bit counts to 64-bit offsets
//   Mark(stage)                         the frame's clock, read by Seconds(from, to)
//
// All calls are queued in order; errors are thrown (DeviceError, ResourceError).
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace sherd {

// Two arrays of which one holds the content and the other is room for a sort's passes.
template <class B>
struct SortBuffer {
  B content, room;
};

// For people who are told what memory is short of.
inline std::string Megabytes(std::uint64_t bytes) {
  return std::to_string((bytes >> 20) + 1) + " MB";
}

// The parts of a frame that are timed.
enum class FrameStage { kBegin, kBinned, kTraced, kEnd };

// A kernel or library call and what it took.
struct KernelTime {
  std::string name;
  double milliseconds = 0.0;
};

// Operations counted by the host loop where they are asked for: what a ray's work consists of.
struct FrameWork {
  std::uint64_t tests = 0;       // a metaball tried against a ray
  std::uint64_t adds = 0;        // a metaball added to a bound
  std::uint64_t steps = 0;       // steps of the march
  std::uint64_t staged = 0;      // entries of tile lists read, for the march and for shading
  std::uint64_t shade_adds = 0;  // a metaball tried at a hit
  std::uint64_t wide_rays = 0;   // rays near more metaballs than their column holds
};

}  // namespace sherd
