// Clouds that change between frames: positions, radii, thresholds, colours and channels are
// replaced in place, and what hangs on them is rebuilt, no more.
//
// Every renderer sorts the metaballs into screen tiles anew for each frame, so a change costs what
// it takes to convert the new values. Revisions tell a copy elsewhere (a GPU's) what to bring over.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "metaball/channel.h"
#include "metaball/cloud.h"
#include "metaball/vec.h"

namespace sherd {

// Values are given in the order the metaballs had in the input of MovingCloud, world units. What
// cannot be drawn (not finite, a radius or a threshold that is not positive) is refused with an
// InputError that names the first such metaball, and nothing is changed. Not thread-safe: no frame
// may be in the making while the cloud changes.
class MovingCloud {
 public:
  // A metaball of the input that BuildCloud would drop is refused.
  explicit MovingCloud(const CloudInput& input);

  // The same object after every change: a Scene that holds it needs no update.
  std::shared_ptr<const Cloud> cloud() const { return cloud_; }
  const CloudRevisions& revisions() const { return cloud_->revisions; }
  std::size_t size() const { return cloud_->size(); }
  // The place in the cloud of metaball i of the input.
  std::uint32_t IndexOf(std::size_t i) const { return place_[i]; }

  // All positions, or those of [first, first + positions.size()). They keep the local frame as long
  // as they lie within kRoom times its box, where floats still hold them as finely as at the
  // start to a factor of kRoom; when one does not, a frame that fits is chosen and all positions
  // and radii are converted. The order in memory stays; a cloud whose parts mix over time renders
  // right, if not as fast as one built anew.
  void SetPositions(std::span<const Vec3d> positions, std::size_t first = 0);
  // All radii, or one for all.
  void SetRadii(std::span<const double> radii);
  void SetUniformRadius(double radius);
  void SetThresholds(std::span<const double> thresholds);
  void SetColors(std::span<const Rgb8> colors);
  // Adds the channel, or replaces the one of its name. Geometry is not touched.
  void SetChannel(const Channel& channel);

  static constexpr double kRoom = 2.0;

 private:
  void MoveFrame(std::span<const Vec3d> positions, std::size_t first);
  void CheckCount(std::size_t count, const std::string& what) const;

  std::shared_ptr<Cloud> cloud_;
  std::vector<std::uint32_t> place_;  // by input index: where it lies in the cloud
};

}  // namespace sherd
