#include "metaball/thesis_file.h"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string_view>

#include "metaball/atomic_file.h"
#include "metaball/error.h"

namespace sherd {
namespace {

static_assert(std::endian::native == std::endian::little, "the file is little endian");

constexpr std::uint32_t kMostMetaballs = 2147483647;
constexpr std::size_t kBufferBytes = 1 << 20;
constexpr const char* kDamaged = "the file is damaged or cut off: copy or export it again";

bool IsBinaryName(const std::string& path, const char* hint) {
  if (path.ends_with(kThesisBinaryExtension)) return true;
  if (path.ends_with(kThesisTextExtension)) return false;
  throw InputError(path, "", "has neither the extension .mbt (text) nor .mbb (binary)", hint);
}

// What is wrong with number `at` of a record; null where nothing is.
const char* FaultOf(const ThesisLayout& layout, int at, float value) {
  if (!std::isfinite(value)) return "is not finite";
  if (at == layout.radius && !(value > 0)) return "is no radius: it must be positive";
  if (at == layout.threshold && !(value > 0)) return "is no threshold: it must be positive";
  const bool color = layout.color >= 0 && at >= layout.color && at < layout.color + 3;
  if (color && !(value >= 0 && value <= 1)) return "is no colour: it must lie between 0 and 1";
  return nullptr;
}

const char* FaultOfDefault(float value) {
  return value > 0 && std::isfinite(value) ? nullptr : "the default must be positive and finite";
}

std::string CountFault(std::uint64_t count, int width, std::uint64_t size) {
  return std::to_string(count) + " metaballs of " + std::to_string(width) +
         " numbers do not fit a file of " + std::to_string(size) + " bytes";
}

std::string Quoted(const char* begin, const char* end) {
  std::string text(1, '\'');
  text.append(begin, end);
  text += '\'';
  return text;
}

void AppendNumber(std::string* text, float value) {
  char buffer[32];
  text->append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
}

// Of a file that is open as `in`.
std::uint64_t SizeOf(const std::string& path, const std::ifstream& in) {
  std::error_code code;
  const std::uint64_t size = std::filesystem::file_size(path, code);
  if (!in || code) {
    throw InputError(path, "", "cannot be opened", "check the name and the permissions");
  }
  return size;
}

class BinaryReader {
 public:
  explicit BinaryReader(const std::string& path)
      : path_(path), in_(path, std::ios::binary), size_(SizeOf(path, in_)) {}

  ThesisFile Read() {
    ThesisFile file;
    file.count = Take<std::uint32_t>();
    if (file.count > kMostMetaballs) Fail(0, "a file holds at most 2147483647 metaballs", "");
    file.flags = Take<std::uint32_t>();
    if (file.flags & ~kThesisFlags) {
      Fail(4, "has feature flags beyond 63: " + std::to_string(file.flags),
           "see docs/thesis_file.md");
    }
    ReadNames(&file);
    const ThesisLayout layout = LayoutOf(file, path_);
    if (layout.radius < 0) file.default_radius = TakeDefault();
    if (layout.threshold < 0) file.default_threshold = TakeDefault();
    // Both factors are below 2^31: the product cannot overflow.
    const std::uint64_t numbers = std::uint64_t{file.count} * static_cast<unsigned>(layout.width);
    if (numbers * 4 != size_ - at_ || numbers > size_) {
      Fail(0, CountFault(file.count, layout.width, size_), kDamaged);
    }
    file.values.resize(numbers);
    if (!in_.read(reinterpret_cast<char*>(file.values.data()),
                  static_cast<std::streamsize>(numbers * 4))) {
      Fail(at_, "reading failed", kDamaged);
    }
    for (std::uint64_t k = 0; k < numbers; ++k) {
      const int at = static_cast<int>(k % static_cast<unsigned>(layout.width));
      if (const char* fault = FaultOf(layout, at, file.values[k])) {
        Fail(at_ + 4 * k, std::string("the number ") + fault, "export the file again");
      }
    }
    return file;
  }

 private:
  [[noreturn]] void Fail(std::uint64_t byte, const std::string& what, const std::string& hint) {
    throw InputError(path_, "byte " + std::to_string(byte), what, hint);
  }

  template <class T>
  T Take() {
    T value;
    if (size_ - at_ < sizeof value || !in_.read(reinterpret_cast<char*>(&value), sizeof value)) {
      Fail(at_, "the file ends here", kDamaged);
    }
    at_ += sizeof value;
    return value;
  }

  float TakeDefault() {
    const float value = Take<float>();
    if (const char* fault = FaultOfDefault(value)) Fail(at_ - 4, fault, "export the file again");
    return value;
  }

  void ReadNames(ThesisFile* file) {
    const auto names = Take<std::uint32_t>();
    if (names > (size_ - at_) / 4) {
      Fail(at_ - 4, std::to_string(names) + " names do not fit the file", kDamaged);
    }
    file->names.resize(names);
    for (std::string& name : file->names) {
      const auto length = Take<std::uint32_t>();
      if (length > size_ - at_) {
        Fail(at_ - 4, "a name of " + std::to_string(length) + " bytes does not fit the file",
             kDamaged);
      }
      name.resize(length);
      if (!in_.read(name.data(), length)) Fail(at_, "reading failed", kDamaged);
      at_ += length;
    }
  }

  const std::string& path_;
  std::ifstream in_;
  std::uint64_t size_ = 0, at_ = 0;
};

class TextFileReader {
 public:
  explicit TextFileReader(const std::string& path)
      : path_(path), in_(path, std::ios::binary), size_(SizeOf(path, in_)) {}

  ThesisFile Read() {
    ThesisFile file;
    file.count = TakeWhole("the number of metaballs");
    const std::uint64_t count_line = line_number_;
    if (file.count > kMostMetaballs) Fail("a file holds at most 2147483647 metaballs", "");
    file.flags = TakeWhole("the feature flags");
    if (file.flags & ~kThesisFlags) {
      Fail("has feature flags beyond 63: " + std::to_string(file.flags), "see docs/thesis_file.md");
    }
    const std::uint32_t names = TakeWhole("the number of names");
    if (names > size_) Fail(std::to_string(names) + " names do not fit the file", kDamaged);
    for (std::uint32_t k = 0; k < names; ++k) {
      if (!NextLine()) Fail("the file ends before name " + std::to_string(k + 1), kDamaged);
      file.names.push_back(line_);
    }
    const ThesisLayout layout = LayoutOf(file, path_);
    if (layout.radius < 0) file.default_radius = TakeDefault("radius");
    if (layout.threshold < 0) file.default_threshold = TakeDefault("threshold");
    const std::uint64_t numbers = std::uint64_t{file.count} * static_cast<unsigned>(layout.width);
    // A number takes a digit and a blank or line end at least.
    if (numbers > (size_ + 1) / 2) {
      line_number_ = count_line;
      Fail(CountFault(file.count, layout.width, size_), kDamaged);
    }
    file.values.reserve(numbers);
    for (std::uint32_t i = 0; layout.width > 0 && i < file.count; ++i) {
      if (!NextLineWithContent()) {
        Fail("the file ends after " + std::to_string(i) + " of " + std::to_string(file.count) +
                 " metaballs",
             kDamaged);
      }
      ReadRecord(layout, &file.values);
    }
    if (NextLineWithContent()) Fail("there are more lines than metaballs", "correct the count");
    return file;
  }

 private:
  [[noreturn]] void Fail(const std::string& what, const std::string& hint) {
    throw InputError(path_, "line " + std::to_string(line_number_), what, hint);
  }

  bool NextLine() {
    ++line_number_;
    if (!std::getline(in_, line_)) return false;
    if (line_.ends_with('\r')) line_.pop_back();
    return true;
  }

  // Passes over blank lines and comments; the line's blanks at both ends are removed.
  bool NextLineWithContent() {
    while (NextLine()) {
      const std::size_t begin = line_.find_first_not_of(" \t");
      if (begin == std::string::npos || line_[begin] == '#') continue;
      line_ = line_.substr(begin, line_.find_last_not_of(" \t") + 1 - begin);
      return true;
    }
    return false;
  }

  std::uint32_t TakeWhole(const char* what) {
    std::uint32_t value = 0;
    if (!NextLineWithContent()) Fail(std::string("the file ends before ") + what, kDamaged);
    const char* const end = line_.data() + line_.size();
    const auto result = std::from_chars(line_.data(), end, value);
    if (result.ec != std::errc() || result.ptr != end) {
      Fail(Quoted(line_.data(), end) + " is not " + what, "one whole number is expected here");
    }
    return value;
  }

  float TakeDefault(const char* what) {
    float value = 0;
    if (!NextLineWithContent()) {
      Fail(std::string("the file ends before the default ") + what, kDamaged);
    }
    const char* const end = line_.data() + line_.size();
    const auto result = std::from_chars(line_.data(), end, value);
    if (result.ec != std::errc() || result.ptr != end || FaultOfDefault(value)) {
      Fail(Quoted(line_.data(), end) + " is no default " + what,
           "one positive number is expected here");
    }
    return value;
  }

  void ReadRecord(const ThesisLayout& layout, std::vector<float>* values) {
    const char* at = line_.data();
    const char* const end = at + line_.size();
    for (int k = 0; k < layout.width; ++k) {
      while (at != end && (*at == ' ' || *at == '\t')) ++at;
      if (at == end) {
        Fail("has " + std::to_string(k) + " numbers, " + std::to_string(layout.width) +
                 " are needed",
             "see docs/thesis_file.md");
      }
      float value = 0;
      const auto result = std::from_chars(at, end, value);
      const bool whole = result.ptr == end || *result.ptr == ' ' || *result.ptr == '\t';
      if (result.ec != std::errc() || !whole) {
        const char* stop = at;
        while (stop != end && *stop != ' ' && *stop != '\t') ++stop;
        Fail(Quoted(at, stop) + " is no number a float holds", "correct the line");
      }
      if (const char* fault = FaultOf(layout, k, value)) {
        Fail(Quoted(at, result.ptr) + " " + fault, "correct the line");
      }
      values->push_back(value);
      at = result.ptr;
    }
    if (at != end) {
      Fail("has more numbers than the " + std::to_string(layout.width) + " that are needed",
           "see docs/thesis_file.md");
    }
  }

  const std::string& path_;
  std::ifstream in_;
  std::string line_;
  std::uint64_t size_ = 0, line_number_ = 0;
};

void CheckForWriting(const std::string& path, const ThesisFile& file, const ThesisLayout& layout) {
  const std::uint64_t numbers = std::uint64_t{file.count} * static_cast<unsigned>(layout.width);
  if (file.count > kMostMetaballs || numbers != file.values.size()) {
    throw InputError(path, "",
                     std::to_string(file.values.size()) + " numbers are no " +
                         std::to_string(file.count) + " records of " +
                         std::to_string(layout.width));
  }
  if ((layout.radius < 0 && FaultOfDefault(file.default_radius)) ||
      (layout.threshold < 0 && FaultOfDefault(file.default_threshold))) {
    throw InputError(path, "", "default radius and threshold must be positive and finite");
  }
  for (std::uint64_t k = 0; k < numbers; ++k) {
    const auto width = static_cast<unsigned>(layout.width);
    if (const char* fault = FaultOf(layout, static_cast<int>(k % width), file.values[k])) {
      throw InputError(path, "metaball " + std::to_string(k / width),
                       "number " + std::to_string(k % width + 1) + " " + fault);
    }
  }
}

void WriteBinary(const std::string& path, const ThesisFile& file, const ThesisLayout& layout) {
  AtomicFile out(path);
  const auto put = [&](const auto& value) { out.Write(&value, sizeof value); };
  put(file.count);
  put(file.flags);
  put(static_cast<std::uint32_t>(file.names.size()));
  for (const std::string& name : file.names) {
    put(static_cast<std::uint32_t>(name.size()));
    out.Write(name.data(), name.size());
  }
  if (layout.radius < 0) put(file.default_radius);
  if (layout.threshold < 0) put(file.default_threshold);
  out.Write(file.values.data(), file.values.size() * sizeof(float));
  out.Commit();
}

void WriteText(const std::string& path, const ThesisFile& file, const ThesisLayout& layout) {
  AtomicFile out(path);
  std::string text = std::to_string(file.count) + "\n" + std::to_string(file.flags) + "\n" +
                     std::to_string(file.names.size()) + "\n";
  for (const std::string& name : file.names) text += name + "\n";
  for (const auto& [written, value] : {std::pair(layout.radius < 0, file.default_radius),
                                       std::pair(layout.threshold < 0, file.default_threshold)}) {
    if (!written) continue;
    AppendNumber(&text, value);
    text += '\n';
  }
  const auto width = static_cast<unsigned>(layout.width);
  for (std::size_t k = 0; k < file.values.size(); ++k) {
    AppendNumber(&text, file.values[k]);
    text += k % width + 1 == width ? '\n' : ' ';
    if (text.size() >= kBufferBytes) {
      out.Write(text.data(), text.size());
      text.clear();
    }
  }
  out.Write(text.data(), text.size());
  out.Commit();
}

}  // namespace

bool IsThesisFileName(const std::string& path) {
  return path.ends_with(kThesisTextExtension) || path.ends_with(kThesisBinaryExtension);
}

ThesisFile ReadThesisFile(const std::string& path) {
  if (IsBinaryName(path, "the format has no magic number: give the file its extension")) {
    return BinaryReader(path).Read();
  }
  return TextFileReader(path).Read();
}

void WriteThesisFile(const std::string& path, const ThesisFile& file) {
  const bool binary = IsBinaryName(path, "choose one of them");
  const ThesisLayout layout = LayoutOf(file, path);
  CheckForWriting(path, file, layout);
  binary ? WriteBinary(path, file, layout) : WriteText(path, file, layout);
}

}  // namespace sherd
