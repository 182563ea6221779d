// The sheet that a level's metaballs stand for. Internal to reconstruction/.
#pragma once

#include "metaball/photo/sheet_view.h"
#include "metaball/support_index.h"
#include "reconstruction/level.h"

namespace sherd {

inline SupportIndex IndexOfSheet(const Cloud& cloud) {
  return SupportIndex(cloud, 0.0f, SheetView::kWidening);
}

// index: IndexOfSheet of an equal cloud. Both must live on.
inline SheetView SheetOf(const Level& level, const SupportIndex& index) {
  const Cloud& cloud = level.cloud;
  const std::size_t n = cloud.size();
  SheetView sheet;
  sheet.frame = cloud.frame;
  sheet.count = static_cast<std::uint32_t>(n);
  sheet.center = cloud.center.data();
  if (!cloud.radius.empty()) sheet.radius = cloud.radius.data();
  sheet.uniform_radius = cloud.uniform_radius;
  if (level.normal.size() == n) sheet.normal = level.normal.data();
  if (level.depth.size() == n) sheet.depth = level.depth.data();
  if (level.photo_begin.size() == n + 1) {
    sheet.photo_begin = level.photo_begin.data();
    sheet.photo_idx = level.photo_idx.data();
  }
  sheet.index = index.view();
  return sheet;
}

}  // namespace sherd
