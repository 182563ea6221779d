// Little-endian binary and text output; every failure (folder gone, disk full) is an OutputError.
#pragma once

#include <cstdio>
#include <string>
#include <string_view>
#include <type_traits>

namespace sherd::synthetic {

class OutputFile {
 public:
  explicit OutputFile(const std::string& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void Bytes(const void* data, std::size_t size);
  void Text(std::string_view text) { Bytes(text.data(), text.size()); }
  // printf; numbers in the C locale (no program of this house sets another for numbers).
  [[gnu::format(printf, 2, 3)]] void Format(const char* format, ...);
  template <class T>
  void Number(T value) {
    static_assert(std::is_arithmetic_v<T>);
    static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "COLMAP's files are little-endian");
    Bytes(&value, sizeof(value));
  }
  // To be called at the end: reports what buffering has hidden so far.
  void Close();

 private:
  [[noreturn]] void Fail();

  std::string path_;
  std::FILE* file_;
};

}  // namespace sherd::synthetic
