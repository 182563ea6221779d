// What the benchmark programs of this folder have in common: options, scenes of a size, reports.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "datasets_synthetic/peer_scenes.h"

namespace sherd {

struct PictureSize {
  int width = 0, height = 0;
};

// The scene with its camera's picture of that size: the same horizontal angle on square pixels.
PeerScene Sized(const PeerScene& peer, const PictureSize& size);

struct BenchOptions {
  std::string json;  // where the report goes; empty: nowhere
  std::vector<std::uint64_t> counts{10'000,    63'000,    250'000,   500'000,
                                    1'000'000, 5'000'000, 20'000'000};
  std::vector<PictureSize> sizes{{1280, 720}, {1920, 1080}, {3840, 2160}};
  int frames = 50;  // that are measured
  int warm_up = 5;  // that are drawn before and do not count
};

// Reads --json FILE, --counts N,N,..., --sizes WxH,WxH,..., --frames N and --warm-up N. Throws
// std::invalid_argument in words for the user.
BenchOptions ParseBenchOptions(int argc, char** argv);

// The same for a program with options of its own: `own` is asked first, takes its option's value by
// calling `value` (which throws where none is left), and answers false for what is not its own.
using OptionValue = std::function<std::string()>;
using OwnOption = std::function<bool(const std::string& name, const OptionValue& value)>;
BenchOptions ParseBenchOptions(int argc, char** argv, const OwnOption& own);

// "63k" is 63 thousand, "5M" 5 million; a plain number is itself. From 1 to a thousand million.
// Throws std::invalid_argument naming `option`.
std::uint64_t ParseCount(const std::string& option, const std::string& text);

// The parts between commas, at least one and none empty. Throws std::invalid_argument naming
// `option`.
std::vector<std::string> SplitList(const std::string& option, const std::string& list);

// Whole or not at all (AtomicFile). Throws OutputError.
void WriteText(const std::string& path, const std::string& text);

}  // namespace sherd
