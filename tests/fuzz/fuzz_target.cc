// One libFuzzer target; SHERD_FUZZ_GROUP says which files it makes up (file_kinds.h). The first
// byte of an input chooses the kind within the group, the rest is the file. Anything but a value or
// an sherd::Error is a finding.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "metaball/error.h"
#include "tests/fuzz/file_kinds.h"

namespace {

using sherd::fuzz::FileKind;

const std::vector<FileKind>& Kinds() {
  static const std::vector<FileKind> kinds = [] {
    std::vector<FileKind> own;
    for (const FileKind& kind : sherd::fuzz::FileKinds()) {
      if (kind.group == SHERD_FUZZ_GROUP) own.push_back(kind);
    }
    if (own.empty()) std::abort();
    return own;
  }();
  return kinds;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const sherd::fuzz::ScratchFolder scratch;
  if (size == 0) return 0;
  const FileKind& kind = Kinds()[data[0] % Kinds().size()];
  std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  if (kind.complete) bytes = kind.complete(std::move(bytes));
  const std::string folder = scratch.For(kind);
  sherd::fuzz::WriteBytes(folder + "/" + kind.name, bytes);
  try {
    kind.read(folder);
  } catch (const sherd::Error&) {
    // What a damaged file is to end in.
  }
  return 0;
}

// With --write-seeds=FOLDER before libFuzzer's own options: writes the group's seeds and ends.
extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  constexpr char kOption[] = "--write-seeds=";
  for (int i = 1; i < *argc; ++i) {
    if (std::strncmp((*argv)[i], kOption, sizeof kOption - 1) != 0) continue;
    const std::string folder = (*argv)[i] + sizeof kOption - 1;
    std::filesystem::create_directories(folder);
    for (std::size_t k = 0; k < Kinds().size(); ++k) {
      for (std::size_t s = 0; s < Kinds()[k].seeds.size(); ++s) {
        sherd::fuzz::WriteBytes(folder + "/" + Kinds()[k].name + "." + std::to_string(s),
                                static_cast<char>(k) + Kinds()[k].seeds[s]);
      }
    }
    std::exit(0);
  }
  return 0;
}
