#include "app/project/checked_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <utility>

#include "metaball/error.h"

namespace sherd {
namespace {

static_assert(std::endian::native == std::endian::little, "the files are little endian");

constexpr std::uint64_t kSumBytes = 4;

using CrcTables = std::array<std::array<std::uint32_t, 256>, 8>;

CrcTables MakeCrcTables() {
  CrcTables tables;
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t c = i;
    for (int k = 0; k < 8; ++k) c = (c >> 1) ^ (c & 1 ? 0xedb88320u : 0u);
    tables[0][i] = c;
  }
  for (std::size_t t = 1; t < 8; ++t) {
    for (std::size_t i = 0; i < 256; ++i) {
      tables[t][i] = (tables[t - 1][i] >> 8) ^ tables[0][tables[t - 1][i] & 0xff];
    }
  }
  return tables;
}

}  // namespace

std::uint32_t Crc32(const void* data, std::size_t bytes, std::uint32_t crc) {
  static const CrcTables t = MakeCrcTables();
  const auto* p = static_cast<const unsigned char*>(data);
  crc = ~crc;
  // Eight bytes at a time ("slicing by 8"): a survey has hundreds of megabytes.
  for (; bytes >= 8; bytes -= 8, p += 8) {
    std::uint32_t low, high;
    std::memcpy(&low, p, 4);
    std::memcpy(&high, p + 4, 4);
    low ^= crc;
    crc = t[7][low & 0xff] ^ t[6][low >> 8 & 0xff] ^ t[5][low >> 16 & 0xff] ^ t[4][low >> 24] ^
          t[3][high & 0xff] ^ t[2][high >> 8 & 0xff] ^ t[1][high >> 16 & 0xff] ^ t[0][high >> 24];
  }
  for (; bytes > 0; --bytes, ++p) crc = (crc >> 8) ^ t[0][(crc ^ *p) & 0xff];
  return ~crc;
}

CheckedWriter::CheckedWriter(const std::string& path, const char* magic, std::uint32_t version)
    : file_(path) {
  Bytes(magic, 8);
  Value(version);
}

void CheckedWriter::Bytes(const void* data, std::size_t bytes) {
  crc_ = Crc32(data, bytes, crc_);
  file_.Write(data, bytes);
}

void CheckedWriter::Text(const std::string& text) {
  Value(static_cast<std::uint32_t>(text.size()));
  Bytes(text.data(), text.size());
}

void CheckedWriter::Commit() {
  file_.Write(&crc_, sizeof crc_);
  file_.Commit();
}

CheckedReader::CheckedReader(const std::string& path, const char* magic, std::uint32_t version,
                             std::string hint)
    : path_(path), hint_(std::move(hint)) {
  file_ = std::fopen(path.c_str(), "rb");
  if (!file_) {
    throw InputError(path_, "", std::string("cannot be opened (") + std::strerror(errno) + ")",
                     hint_);
  }
  try {
    if (std::fseek(file_, 0, SEEK_END) != 0) Fail("cannot be read");
    const long end = std::ftell(file_);
    if (end < 0 || std::fseek(file_, 0, SEEK_SET) != 0) Fail("cannot be read");
    size_ = static_cast<std::uint64_t>(end);
    char found[8];
    Bytes(found, 8);
    if (std::memcmp(found, magic, 8) != 0) {
      offset_ = 0;
      Fail("is not the file it should be");
    }
    const auto found_version = Value<std::uint32_t>();
    version_ = found_version;
    if (found_version == 0 || found_version > version) {
      throw InputError(path_, "byte 8",
                       "has version " + std::to_string(found_version) + ", this program reads " +
                           std::to_string(version),
                       "use a newer Sherd, or import the survey again");
    }
  } catch (...) {
    std::fclose(file_);  // the destructor does not run
    throw;
  }
}

CheckedReader::~CheckedReader() { std::fclose(file_); }

void CheckedReader::Bytes(void* data, std::size_t bytes) {
  Expect(bytes, 1);
  if (bytes > 0 && std::fread(data, 1, bytes, file_) != bytes) Fail("reading failed");
  crc_ = Crc32(data, bytes, crc_);
  offset_ += bytes;
}

void CheckedReader::Blocks(void* data, std::size_t bytes, const Control& control) {
  constexpr std::size_t kBlock = 8 << 20;
  auto* p = static_cast<char*>(data);
  while (bytes > 0) {
    control.ThrowIfStopped();
    const std::size_t n = std::min(bytes, kBlock);
    Bytes(p, n);
    p += n;
    bytes -= n;
    control.Report("reading", fraction());
  }
}

std::string CheckedReader::Text() {
  const auto length = Value<std::uint32_t>();
  Expect(length, 1);
  std::string text(length, '\0');
  Bytes(text.data(), length);
  return text;
}

void CheckedReader::Expect(std::uint64_t count, std::uint64_t bytes_each) {
  const std::uint64_t end = size_ >= kSumBytes ? size_ - kSumBytes : 0;
  const std::uint64_t left = end > offset_ ? end - offset_ : 0;
  if (count > left / bytes_each) {
    Fail("ends too early: " + std::to_string(count) + " x " + std::to_string(bytes_each) +
         " bytes should follow, " + std::to_string(left) + " are there");
  }
}

void CheckedReader::Finish() {
  if (offset_ + kSumBytes != size_) Fail("has bytes that belong to nothing");
  std::uint32_t sum = 0;
  if (std::fread(&sum, 1, sizeof sum, file_) != sizeof sum) Fail("reading failed");
  if (sum != crc_) Fail("is damaged: its check sum does not fit");
}

void CheckedReader::Fail(const std::string& message) const {
  throw InputError(path_, "byte " + std::to_string(offset_), message, hint_);
}

double CheckedReader::fraction() const {
  return size_ ? static_cast<double>(offset_) / static_cast<double>(size_) : 1.0;
}

}  // namespace sherd
