#include "reconstruction/mask_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
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
  columns_ = std::max(1, static_cast<int>(width / cell));
  rows_ = std::max(1, static_cast<int>(height / cell));
  cells_per_px_x_ = columns_ / width;
  cells_per_px_y_ = rows_ / height;
  cell_px_ = 1 / std::max(cells_per_px_x_, cells_per_px_y_);

  cv::Mat clear(rows_, columns_, CV_8U, cv::Scalar(255));
  bool any = false;
  // Every cell that a black pixel touches: the mask may be finer or coarser than the grid.
  const std::int64_t mask_width = mask.width(), mask_height = mask.height();
  for (std::int64_t y = 0; y < mask_height; ++y) {
    const auto top = static_cast<int>(y * rows_ / mask_height);
    const auto bottom = static_cast<int>(((y + 1) * rows_ - 1) / mask_height);
    for (std::int64_t x = 0; x < mask_width; ++x) {
      if (!mask.IgnoresPixel(static_cast<int>(x), static_cast<int>(y))) continue;
      any = true;
      const auto left = static_cast<int>(x * columns_ / mask_width);
      const auto right = static_cast<int>(((x + 1) * columns_ - 1) / mask_width);
      for (int row = top; row <= bottom; ++row) {
        std::fill(clear.ptr(row) + left, clear.ptr(row) + right + 1, std::uint8_t{0});
      }
    }
  }
  if (!any) return;
  cv::Mat distance;
  cv::distanceTransform(clear, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  quarters_.reserve(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
  for (int row = 0; row < rows_; ++row) {
    const float* const cells = distance.ptr<float>(row);
    for (int column = 0; column < columns_; ++column) {
      quarters_.push_back(static_cast<std::uint8_t>(std::min(255.0f, 4 * cells[column])));
    }
  }
}

double MaskDistance::At(double x, double y) const {
  if (quarters_.empty()) return std::numeric_limits<double>::infinity();
  x = std::clamp(x * cells_per_px_x_ - 0.5, 0.0, static_cast<double>(columns_ - 1));
  y = std::clamp(y * cells_per_px_y_ - 0.5, 0.0, static_cast<double>(rows_ - 1));
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, columns_ - 1), y1 = std::min(y0 + 1, rows_ - 1);
  const double fx = x - x0, fy = y - y0;
  const auto at = [&](int column, int row) {
    return quarters_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                     static_cast<std::size_t>(column)] /
           4.0;
  };
  const double top = at(x0, y0) * (1 - fx) + at(x1, y0) * fx;
  const double bottom = at(x0, y1) * (1 - fx) + at(x1, y1) * fx;
  // Half a cell's diagonal for where in the black cell its pixel lies, and as much for where
  // between the centres the place does.
  const double cells = top * (1 - fy) + bottom * fy - std::numbers::sqrt2;
  return std::max(0.0, cells) * cell_px_;
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
