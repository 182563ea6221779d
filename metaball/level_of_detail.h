// A level of detail for pictures in which metaballs are smaller than a pixel: coarser clouds whose
// surface is proven to stay near the full one's.
//
// The metaballs of each cell of an octree are merged into one (GroupMerge), those that are large
// for their cell stay as they are, so that a cloud of mixed radii loses only what is small. A level
// states how far its surface may be from the full one: no point inside one of the two surfaces is
// farther than `error` from a point inside the other. In a picture, with that error projected to
// `error_px`: outlines lie within error_px of each other, and within error_px of every pixel of one
// picture the other's surface is met at most `error` farther away. Gaps narrower than that may
// close. Colours are means over the cells, for which no bound is stated.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "metaball/camera.h"
#include "metaball/cloud.h"
#include "metaball/control.h"
#include "metaball/group_merge.h"
#include "metaball/scene.h"

namespace sherd {

struct LevelOfDetail {
  std::shared_ptr<const Cloud> cloud;         // null until it is first chosen
  std::vector<std::uint32_t> representative;  // by metaball: one of the full cloud for its id
  int cell_log2 = 0;                          // edge of a cell in the finest cells
  std::size_t metaballs = 0;
  double error = 0;  // world units; proven
};

// What a frame is drawn from.
struct LevelChoice {
  const LevelOfDetail* level = nullptr;  // null: the full cloud
  double error_px = 0;                   // of that level in that frame
};

// Not thread-safe. Levels are measured when a frame asks for one coarser than those known, and
// their clouds made when they are first chosen; each costs one or two passes over the full cloud.
class LevelsOfDetail {
 public:
  // The cloud must not change, and be there as long as For is called. threads: 0 for all.
  LevelsOfDetail(const Cloud& cloud, const Surface& surface, int threads = 0);

  // Why there are no levels; empty where there may be.
  const std::string& why_not() const { return why_not_; }

  // The coarsest level whose error is less than `pixels` of a pixel at the nearest depth that may
  // be seen; the full cloud where there is none. Throws Cancelled.
  LevelChoice For(const Camera& camera, double pixels, const Control& control = {});

  // Those measured so far, from fine to coarse.
  const std::vector<LevelOfDetail>& levels() const { return levels_; }
  // Of the levels' clouds and of what finding them needs.
  std::size_t MemoryBytes() const;

 private:
  struct Block {  // of metaballs that follow each other in memory
    Vec3f min{}, max{};
    float radius = 0;  // the largest
  };

  void SortByKey();
  void BuildBlocks();
  bool MeasureNext(const Control& control);
  void MakeCloud(LevelOfDetail* level, const Control& control) const;
  // Upper bound in pixels of `error` (world units); infinite at the camera.
  double ProjectedError(const Camera& camera, double error, double margin_px) const;
  std::uint64_t KeyOf(std::uint32_t i) const;
  std::uint32_t At(std::size_t k) const {
    return order_.empty() ? static_cast<std::uint32_t>(k) : order_[k];
  }
  double CellEdge(int cell_log2) const;
  // Ends of parts of the metaballs in order, none of which cuts a cell.
  std::vector<std::size_t> PartEnds(int cell_log2) const;
  // Calls visit(members, merge) for each metaball of a level made from [begin, end).
  template <class Visit>
  void ForEachGroup(std::size_t begin, std::size_t end, int cell_log2, const Visit& visit) const;

  const Cloud* cloud_;
  int threads_;
  std::string why_not_;
  double extent_ = 1;                 // local: the octree's root is [-extent, extent]^3
  std::vector<std::uint32_t> order_;  // by key; empty where the cloud is in that order
  std::vector<Block> blocks_;
  float smallest_radius_ = 0;
  std::unique_ptr<GroupMerge> merge_;  // from the first level on
  double core_ = 0, scale_ = 1;
  Surface surface_;
  std::vector<LevelOfDetail> levels_;
  int next_log2_ = 0;
};

}  // namespace sherd
