#include "reconstruction/binary_reader.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>

#include "metaball/error.h"

namespace sherd {

std::FILE* OpenForReading(const std::string& path, std::uint64_t* size) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) {
    throw InputError(path, "", std::string("cannot be read: ") + std::strerror(errno));
  }
  if (!S_ISREG(info.st_mode)) throw InputError(path, "", "is no regular file");
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (!file) throw InputError(path, "", std::string("cannot be opened: ") + std::strerror(errno));
  std::setvbuf(file, nullptr, _IONBF, 0);  // the readers have their own buffer
  *size = static_cast<std::uint64_t>(info.st_size);
  return file;
}

BinaryReader::BinaryReader(const std::string& path) : path_(path) {
  file_.reset(OpenForReading(path, &size_));
  buffer_.resize(static_cast<std::size_t>(std::clamp<std::uint64_t>(size_, 16, 1 << 20)));
}

void BinaryReader::Fail(const std::string& message, const std::string& hint) const {
  FailAt(position_, message, hint);
}

void BinaryReader::FailAt(std::uint64_t byte, const std::string& message,
                          const std::string& hint) const {
  throw InputError(path_, "byte " + std::to_string(byte), message, hint);
}

void BinaryReader::ReadBytes(void* out, std::uint64_t count, const char* what) {
  if (count > remaining()) {
    Fail(std::string("the file ends inside ") + what + " (" + std::to_string(count) +
             " bytes needed, " + std::to_string(remaining()) + " left)",
         "the file is cut off or damaged: copy it again");
  }
  char* target = static_cast<char*>(out);
  while (count > 0) {
    if (next_ == filled_) {
      next_ = 0;
      filled_ = std::fread(buffer_.data(), 1, buffer_.size(), file_.get());
      if (filled_ == 0) Fail("the file could not be read to its end");
    }
    const std::size_t part =
        static_cast<std::size_t>(std::min<std::uint64_t>(count, filled_ - next_));
    std::memcpy(target, buffer_.data() + next_, part);
    target += part;
    next_ += part;
    position_ += part;
    count -= part;
  }
}

void BinaryReader::Skip(std::uint64_t count, const char* what) {
  if (count > remaining()) {
    Fail(std::string("the file ends inside ") + what + " (" + std::to_string(count) +
             " bytes needed, " + std::to_string(remaining()) + " left)",
         "the file is cut off or damaged: copy it again");
  }
  const std::uint64_t buffered = std::min<std::uint64_t>(count, filled_ - next_);
  next_ += static_cast<std::size_t>(buffered);
  position_ += count;
  if (buffered == count) return;
  next_ = filled_ = 0;
  if (::fseeko(file_.get(), static_cast<off_t>(position_), SEEK_SET) != 0) {
    Fail("the file could not be read to its end");
  }
}

std::string BinaryReader::ReadName(std::uint64_t max_length, const char* what) {
  const std::uint64_t start = position_;
  std::string name;
  for (;;) {
    const char c = Read<char>(what);
    if (c == '\0') return name;
    if (name.size() >= max_length) {
      FailAt(start, std::string("no end of ") + what + " within " + std::to_string(max_length) +
                        " bytes: this is not what is expected here");
    }
    name.push_back(c);
  }
}

void BinaryReader::CheckCount(std::uint64_t count, std::uint64_t min_record_bytes,
                              const char* what) const {
  if (min_record_bytes > 0 && count > remaining() / min_record_bytes) {
    Fail("the file declares " + std::to_string(count) + " " + what + ", but only " +
             std::to_string(remaining()) + " bytes follow",
         "the file is cut off or damaged: copy it again");
  }
}

void BinaryReader::ExpectEnd(const char* what) const {
  if (remaining() > 0) {
    Fail(std::to_string(remaining()) + " bytes follow the last of the declared " + what,
         "the file is damaged or of another kind");
  }
}

}  // namespace sherd
