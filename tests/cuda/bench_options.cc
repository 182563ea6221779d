#include "bench_options.h"

#include <algorithm>
#include <charconv>
#include <stdexcept>
#include <system_error>

#include "metaball/atomic_file.h"

namespace sherd {
namespace {

[[noreturn]] void Refuse(const std::string& option, const std::string& text,
                         const std::string& what) {
  throw std::invalid_argument(option + ": '" + text + "' is not " + what);
}

// The whole number at the start of [begin, end), or nothing; where it ends.
template <class T>
const char* ReadNumber(const char* begin, const char* end, T* number) {
  const auto [after, error] = std::from_chars(begin, end, *number);
  return error == std::errc{} ? after : nullptr;
}

int ParseInt(const std::string& option, const std::string& text, int least) {
  int number = 0;
  const char* const end = text.data() + text.size();
  if (ReadNumber(text.data(), end, &number) != end || number < least) {
    Refuse(option, text, "a whole number from " + std::to_string(least) + " on");
  }
  return number;
}

PictureSize ParseSize(const std::string& option, const std::string& text) {
  constexpr int kLargest = 65'536;
  PictureSize size;
  const char* const end = text.data() + text.size();
  const char* at = ReadNumber(text.data(), end, &size.width);
  const bool good = at && at != end && *at == 'x' && ReadNumber(at + 1, end, &size.height) == end &&
                    size.width >= 1 && size.height >= 1 && size.width <= kLargest &&
                    size.height <= kLargest;
  if (!good) Refuse(option, text, "WxH, each from 1 to 65536");
  return size;
}

}  // namespace

PeerScene Sized(const PeerScene& peer, const PictureSize& size) {
  const double scale = static_cast<double>(size.width) / peer.camera.width;
  PeerScene sized = peer;
  sized.camera.width = size.width;
  sized.camera.height = size.height;
  sized.camera.fx *= scale;
  sized.camera.fy *= scale;
  sized.camera.cx = 0.5 * size.width;
  sized.camera.cy = 0.5 * size.height;
  return sized;
}

BenchOptions ParseBenchOptions(int argc, char** argv) {
  return ParseBenchOptions(argc, argv,
                           [](const std::string&, const OptionValue&) { return false; });
}

BenchOptions ParseBenchOptions(int argc, char** argv, const OwnOption& own) {
  BenchOptions options;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    const OptionValue value = [&]() -> std::string {
      if (i + 1 == argc) throw std::invalid_argument(name + " needs a value");
      return argv[++i];
    };
    if (own(name, value)) continue;
    if (name == "--json") {
      options.json = value();
    } else if (name == "--counts") {
      options.counts.clear();
      for (const std::string& part : SplitList(name, value())) {
        options.counts.push_back(ParseCount(name, part));
      }
    } else if (name == "--sizes") {
      options.sizes.clear();
      for (const std::string& part : SplitList(name, value())) {
        options.sizes.push_back(ParseSize(name, part));
      }
    } else if (name == "--frames") {
      options.frames = ParseInt(name, value(), 1);
    } else if (name == "--warm-up") {
      options.warm_up = ParseInt(name, value(), 0);
    } else {
      throw std::invalid_argument("there is no option '" + name + "'");
    }
  }
  return options;
}

std::uint64_t ParseCount(const std::string& option, const std::string& text) {
  constexpr std::uint64_t kMost = 1'000'000'000;
  std::uint64_t count = 0, unit = 1;
  const char* const end = text.data() + text.size();
  const char* after = ReadNumber(text.data(), end, &count);
  if (after && after + 1 == end && (*after == 'k' || *after == 'M')) {
    unit = *after == 'k' ? 1000 : 1'000'000;
    ++after;
  }
  if (after != end || count < 1 || count > kMost / unit) {
    Refuse(option, text, "a count such as 500, 63k or 5M, up to 1000M");
  }
  return count * unit;
}

std::vector<std::string> SplitList(const std::string& option, const std::string& list) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= list.size();) {
    const std::size_t end = std::min(list.find(',', begin), list.size());
    parts.push_back(list.substr(begin, end - begin));
    if (parts.back().empty()) Refuse(option, list, "a list with something between its commas");
    begin = end + 1;
  }
  return parts;
}

void WriteText(const std::string& path, const std::string& text) {
  AtomicFile file(path);
  file.Write(text.data(), text.size());
  file.Commit();
}

}  // namespace sherd
