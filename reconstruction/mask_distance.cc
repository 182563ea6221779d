#include "reconstruction/mask_distance.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "metaball/error.h"
#include "reconstruction/parallel.h"
#include "reconstruction/photo_mask.h"

namespace sherd {

MaskDistance::MaskDistance(const std::string& path, const SurveyCamera& camera,
                           std::size_t max_bytes) {
  const PhotoMask mask(path);
  const auto width = static_cast<double>(camera.width), height = static_cast<double>(camera.height);
  const double cell = std::max(
      {1.0, std::max(width, height) / kLargestSide,
       std::sqrt(width * height / static_cast<double>(std::max<std::size_t>(1, max_bytes)))});
  const int columns = grid_.columns = std::max(1, static_cast<int>(width / cell));
  const int rows = grid_.rows = std::max(1, static_cast<int>(height / cell));
  grid_.cells_per_px_x = columns / width;
  grid_.cells_per_px_y = rows / height;
  grid_.cell_px = 1 / std::max(grid_.cells_per_px_x, grid_.cells_per_px_y);

  cv::Mat clear(rows, columns, CV_8U, cv::Scalar(255));
  bool any = false;
  // Every cell that a black pixel touches: the mask may be finer or coarser than the grid.
  const std::int64_t mask_width = mask.width(), mask_height = mask.height();
  for (std::int64_t y = 0; y < mask_height; ++y) {
    const auto top = static_cast<int>(y * rows / mask_height);
    const auto bottom = static_cast<int>(((y + 1) * rows - 1) / mask_height);
    for (std::int64_t x = 0; x < mask_width; ++x) {
      if (!mask.IgnoresPixel(static_cast<int>(x), static_cast<int>(y))) continue;
      any = true;
      const auto left = static_cast<int>(x * columns / mask_width);
      const auto right = static_cast<int>(((x + 1) * columns - 1) / mask_width);
      for (int row = top; row <= bottom; ++row) {
        std::fill(clear.ptr(row) + left, clear.ptr(row) + right + 1, std::uint8_t{0});
      }
    }
  }
  if (!any) return;
  cv::Mat distance;
  cv::distanceTransform(clear, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  quarters_.reserve(grid_.cells());
  for (int row = 0; row < rows; ++row) {
    const float* const cells = distance.ptr<float>(row);
    for (int column = 0; column < columns; ++column) {
      quarters_.push_back(static_cast<std::uint8_t>(std::min(255.0f, 4 * cells[column])));
    }
  }
}

MaskDistances::MaskDistances(const Survey& survey, std::size_t max_bytes) : survey_(survey) {
  constexpr std::size_t kMostOfEach =
      std::size_t{MaskDistance::kLargestSide} * MaskDistance::kLargestSide;
  const auto masks = static_cast<std::size_t>(
      std::count_if(survey.photographs.begin(), survey.photographs.end(),
                    [](const Photograph& photo) { return !photo.mask_path.empty(); }));
  if (masks == 0) return;
  bytes_of_each_ = std::min(max_bytes / masks, kMostOfEach);
  max_bytes_ = masks * bytes_of_each_;
  entries_.resize(survey.photographs.size());
}

void MaskDistances::Read(const std::vector<bool>& photos, const Control& control) {
  std::vector<std::size_t> wanted;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const bool has_mask = !survey_.photographs[i].mask_path.empty();
    if (photos[i] && has_mask && !entries_[i].tried) wanted.push_back(i);
  }
  ParallelBlocks(
      wanted.size(), 1,
      [&](std::size_t begin, std::size_t) {
        const Photograph& photo = survey_.photographs[wanted[begin]];
        Entry& entry = entries_[wanted[begin]];
        try {
          entry.mask = std::make_unique<MaskDistance>(
              photo.mask_path, survey_.cameras[photo.original_camera_idx], bytes_of_each_);
        } catch (const InputError& error) {
          entry.problem = error.what();
        }
        entry.tried = true;
      },
      control, "reading the masks");
}

std::string MaskDistances::Warning() const {
  std::size_t count = 0;
  std::string example;
  for (const Entry& entry : entries_) {
    if (!entry.problem.empty() && count++ == 0) example = entry.problem;
  }
  return count > 0 ? MasksLeftOut(count, example) : "";
}

}  // namespace sherd
