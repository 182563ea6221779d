// Little-endian binary files, read forward through a buffer, never past what the file holds.
#pragma once

#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

namespace sherd {

static_assert(std::endian::native == std::endian::little,
              "the readers copy little-endian bytes as they are");

class BinaryReader {
 public:
  // Throws InputError when the file is missing, no regular file, or not readable.
  explicit BinaryReader(const std::string& path);

  const std::string& path() const { return path_; }
  std::uint64_t size() const { return size_; }
  std::uint64_t position() const { return position_; }
  std::uint64_t remaining() const { return size_ - position_; }

  // Throws InputError naming the byte where the file ends too early. `what` is what was being read.
  void ReadBytes(void* out, std::uint64_t count, const char* what);
  template <class T>
  T Read(const char* what) {
    T value;
    if (sizeof(T) <= filled_ - next_) {  // the common case without a call
      std::memcpy(&value, buffer_.data() + next_, sizeof(T));
      next_ += sizeof(T);
      position_ += sizeof(T);
    } else {
      ReadBytes(&value, sizeof(T), what);
    }
    return value;
  }
  void Skip(std::uint64_t count, const char* what);
  // A text that a zero byte ends.
  std::string ReadName(std::uint64_t max_length, const char* what);
  // Throws InputError when `count` records of at least `min_record_bytes` cannot fit in what
  // remains of the file. Call before allocating for them.
  void CheckCount(std::uint64_t count, std::uint64_t min_record_bytes, const char* what) const;
  // Throws InputError when bytes are left over.
  void ExpectEnd(const char* what) const;

  // InputError at the current byte.
  [[noreturn]] void Fail(const std::string& message, const std::string& hint = "") const;
  [[noreturn]] void FailAt(std::uint64_t byte, const std::string& message,
                           const std::string& hint = "") const;

 private:
  struct Closer {
    void operator()(std::FILE* f) const { std::fclose(f); }
  };
  std::string path_;
  std::unique_ptr<std::FILE, Closer> file_;
  std::uint64_t size_ = 0, position_ = 0;
  std::vector<char> buffer_;
  std::size_t next_ = 0, filled_ = 0;
};

// Opens a regular file for reading and gives its size. Throws InputError.
std::FILE* OpenForReading(const std::string& path, std::uint64_t* size);

}  // namespace sherd
