// What a damaged file may cost: cut off at every byte and with every byte changed, each kind of
// file ends in a value or one sherd::Error, and holds no more memory than a stated multiple of its
// size.
#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <new>

#include "metaball/error.h"
#include "tests/fuzz/file_kinds.h"

namespace {

// Of what operator new has given and delete has not taken back.
std::atomic<std::size_t> held{0}, most_held{0};

void* Count(void* p) {
  if (!p) throw std::bad_alloc();
  const std::size_t now = held += malloc_usable_size(p);
  std::size_t most = most_held;
  while (now > most && !most_held.compare_exchange_weak(most, now)) {
  }
  return p;
}

void Release(void* p) {
  if (p) held -= malloc_usable_size(p);
  std::free(p);
}

}  // namespace

void* operator new(std::size_t size) { return Count(std::malloc(size)); }
void* operator new[](std::size_t size) { return Count(std::malloc(size)); }
void operator delete(void* p) noexcept { Release(p); }
void operator delete[](void* p) noexcept { Release(p); }
void operator delete(void* p, std::size_t) noexcept { Release(p); }
void operator delete[](void* p, std::size_t) noexcept { Release(p); }

namespace sherd::fuzz {
namespace {

// docs/architecture.md states both.
constexpr std::size_t kFactor = 96;
constexpr std::size_t kFixed = 64 << 10;  // buffers, messages, what stands beside the file

constexpr std::size_t kLong = 64 << 10;

class DamagedFiles : public ::testing::TestWithParam<std::size_t> {
 protected:
  const FileKind& kind() const { return FileKinds()[GetParam()]; }

  // The most that was held while it was read, in bytes; fails the test for any other exception.
  std::size_t Cost(const std::string& bytes, bool* refused = nullptr) {
    const std::string folder = scratch_.For(kind());
    WriteBytes(folder + "/" + kind().name, kind().complete ? kind().complete(bytes) : bytes);
    const std::size_t before = held;
    most_held = before;
    try {
      kind().read(folder);
      if (refused) *refused = false;
    } catch (const Error& error) {
      if (refused) *refused = true;
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    } catch (const std::exception& error) {
      ADD_FAILURE() << kind().name << ": " << error.what();
    }
    return most_held - before;
  }

  ScratchFolder scratch_;
};

TEST_P(DamagedFiles, SeedsAreRead) {
  for (const std::string& seed : kind().seeds) {
    bool refused = true;
    Cost(seed, &refused);
    EXPECT_FALSE(refused) << kind().name;
  }
}

TEST_P(DamagedFiles, CutOffAtEveryByte) {
  for (const std::string& seed : kind().seeds) {
    for (std::size_t length = 0; length <= seed.size(); ++length) {
      ASSERT_LE(Cost(seed.substr(0, length)), kFactor * length + kFixed) << length;
    }
  }
}

TEST_P(DamagedFiles, EveryByteChanged) {
  for (const std::string& seed : kind().seeds) {
    for (std::size_t i = 0; i < seed.size(); ++i) {
      for (const char value : {'\x00', '\x7f', '\xff', '9', '-'}) {
        std::string damaged = seed;
        damaged[i] = value;
        ASSERT_LE(Cost(damaged), kFactor * seed.size() + kFixed) << i;
      }
    }
  }
}

// The densest content a file can have: its end once more, thousands of times, and runs of one byte.
TEST_P(DamagedFiles, LongRepetitions) {
  for (const std::string& seed : kind().seeds) {
    for (std::size_t i = 0; i < seed.size(); i += 1 + seed.size() / 6) {
      std::string longer = seed;
      while (longer.size() < kLong) longer += seed.substr(i);
      ASSERT_LE(Cost(longer), kFactor * longer.size() + kFixed) << i;
      for (const char c : {'\0', '\1', '[', '1', ' ', '\n', '#'}) {
        longer = seed.substr(0, i) + std::string(kLong, c) + seed.substr(i);
        ASSERT_LE(Cost(longer), kFactor * longer.size() + kFixed) << i << " " << int(c);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, DamagedFiles, ::testing::Range<std::size_t>(0, FileKinds().size()),
                         [](const auto& test) {
                           std::string name = FileKinds()[test.param].name;
                           std::replace(name.begin(), name.end(), '.', '_');
                           return name;
                         });

}  // namespace
}  // namespace sherd::fuzz
