// The frame of the project's own binary files: magic, version, fields, and a CRC-32 of all before
// it at the very end. Little endian. Every declared count is checked against the bytes that are
// there before anything is allocated.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <type_traits>
#include <vector>

#include "metaball/atomic_file.h"
#include "metaball/control.h"

namespace sherd {

// CRC-32 (IEEE 802.3), continued from `crc` (0 to begin).
std::uint32_t Crc32(const void* data, std::size_t bytes, std::uint32_t crc = 0);

class CheckedWriter {
 public:
  // `magic` has 8 characters. Throws OutputError.
  CheckedWriter(const std::string& path, const char* magic, std::uint32_t version);

  void Bytes(const void* data, std::size_t bytes);
  template <class T>
  void Value(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    Bytes(&value, sizeof value);
  }
  template <class T>
  void Array(const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    Bytes(values.data(), values.size() * sizeof(T));
  }
  void Text(const std::string& text);  // length (uint32), then the bytes
  // Writes the sum, flushes and renames. Throws OutputError.
  void Commit();

 private:
  AtomicFile file_;
  std::uint32_t crc_ = 0;
};

class CheckedReader {
 public:
  // Throws InputError: cannot be opened, another magic, a version above `version`. `hint` says what
  // the user can do about a damaged file.
  CheckedReader(const std::string& path, const char* magic, std::uint32_t version,
                std::string hint);
  ~CheckedReader();
  CheckedReader(const CheckedReader&) = delete;
  CheckedReader& operator=(const CheckedReader&) = delete;

  void Bytes(void* data, std::size_t bytes);
  template <class T>
  T Value() {
    static_assert(std::is_trivially_copyable_v<T>);
    T value;
    Bytes(&value, sizeof value);
    return value;
  }
  // In blocks, asking `control` between them.
  template <class T>
  void Array(std::uint64_t count, std::vector<T>* values, const Control& control) {
    static_assert(std::is_trivially_copyable_v<T>);
    Expect(count, sizeof(T));
    values->resize(static_cast<std::size_t>(count));
    Blocks(values->data(), values->size() * sizeof(T), control);
  }
  std::string Text();
  // Fails unless `count` records of at least `bytes_each` fit into what is left of the file.
  void Expect(std::uint64_t count, std::uint64_t bytes_each);
  // Reads the sum and checks it and that nothing follows.
  void Finish();
  // Throws InputError with the byte reached.
  [[noreturn]] void Fail(const std::string& message) const;
  double fraction() const;                            // of the file read so far
  std::uint32_t version() const { return version_; }  // that was found

 private:
  void Blocks(void* data, std::size_t bytes, const Control& control);

  std::string path_, hint_;
  std::FILE* file_ = nullptr;
  std::uint64_t size_ = 0, offset_ = 0;
  std::uint32_t crc_ = 0, version_ = 0;
};

}  // namespace sherd
