// fused.ply.vis: which photographs see each point of a fused cloud. Internal to reconstruction/.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "reconstruction/binary_reader.h"
#include "reconstruction/survey.h"

namespace sherd {

// The records of a .vis file (colmap_formats 3.4), one after another.
class VisibilityReader {
 public:
  // Throws InputError when the file cannot hold `num_points` records or declares another number.
  VisibilityReader(const std::string& path, std::uint64_t num_points);

  // Appends the next record, sorted and without repetitions. Throws InputError.
  void Read(std::vector<std::uint32_t>* image_idx);
  void Skip();
  void ExpectEnd() { reader_.ExpectEnd("records"); }
  std::uint64_t bytes() const { return reader_.size(); }

 private:
  BinaryReader reader_;
};

// Share, over a sample of the points, of the listed photographs in whose picture the point lies
// when index i of the lists means photographs[photo_of[i]]; indices without a photograph count as
// outside. 1 where nothing is listed.
double ShareInside(const Survey& survey, const std::vector<std::uint32_t>& photo_of);

}  // namespace sherd
