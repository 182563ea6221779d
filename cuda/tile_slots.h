// Which tile lies in which slot of a pool, and which was used longest ago.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <span>
#include <unordered_map>
#include <vector>

namespace sherd {

class TileSlots {
 public:
  std::uint64_t slots() const { return slots_; }
  std::uint64_t held() const { return held_.size(); }
  void AddSlots(std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) {
      free_.push_back(static_cast<std::uint32_t>(slots_ + i));
    }
    slots_ += count;
  }

  bool Holds(std::uint64_t key) const { return held_.contains(key); }
  // The slot of a tile that is held.
  std::uint32_t SlotOf(std::uint64_t key) const { return held_.at(key)->slot; }
  // Makes a tile the one used last; false where it is not held.
  bool Touch(std::uint64_t key) {
    const auto found = held_.find(key);
    if (found == held_.end()) return false;
    by_use_.splice(by_use_.begin(), by_use_, found->second);
    return true;
  }
  // `count` free slots, at most slots(): what was used longest ago gives up its own. They stay free
  // until Hold takes them in their order.
  std::span<const std::uint32_t> MakeFree(std::size_t count) {
    while (free_.size() < count) {
      free_.push_back(by_use_.back().slot);
      held_.erase(by_use_.back().key);
      by_use_.pop_back();
    }
    return std::span(free_).last(count);
  }
  void Hold(std::span<const std::uint64_t> keys) {
    const auto slots = std::span(free_).last(keys.size());
    for (std::size_t i = 0; i < keys.size(); ++i) {
      by_use_.push_front({keys[i], slots[i]});
      held_[keys[i]] = by_use_.begin();
    }
    free_.resize(free_.size() - keys.size());
  }

 private:
  struct Tile {
    std::uint64_t key;
    std::uint32_t slot;
  };
  std::uint64_t slots_ = 0;
  std::vector<std::uint32_t> free_;
  std::list<Tile> by_use_;  // the one used last first
  std::unordered_map<std::uint64_t, std::list<Tile>::iterator> held_;
};

}  // namespace sherd
