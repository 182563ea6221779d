#include <algorithm>

#include "metaball/parallel.h"
#include "metaball/photo/sampler.h"

namespace sherd {
namespace {

class CpuPhotoSampler final : public PhotoSampler {
 public:
  bool NeedsPixels(const PhotoExtent&, std::span<const PhotoLookup>, const Control&) override {
    return true;
  }
  void Sample(const PhotoExtent&, const PhotoPyramid* pixels, std::span<const PhotoLookup> lookups,
              PhotoColors* colors, const Control& control) override {
    constexpr std::size_t kBlock = 2048;
    const std::size_t blocks = (lookups.size() + kBlock - 1) / kBlock;
    ParallelFor(static_cast<std::int64_t>(blocks), 0, [&](std::int64_t block, int) {
      control.ThrowIfStopped();
      const std::size_t begin = static_cast<std::size_t>(block) * kBlock;
      const std::size_t end = std::min(lookups.size(), begin + kBlock);
      for (std::size_t i = begin; i < end; ++i) colors[i] = SampleColors(*pixels, lookups[i]);
    });
  }
};

}  // namespace

std::unique_ptr<PhotoSampler> MakeCpuPhotoSampler() { return std::make_unique<CpuPhotoSampler>(); }

}  // namespace sherd
