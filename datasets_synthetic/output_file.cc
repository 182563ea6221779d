#include "datasets_synthetic/output_file.h"

#include <cerrno>
#include <cstdarg>
#include <cstring>

#include "metaball/error.h"

namespace sherd::synthetic {

OutputFile::OutputFile(const std::string& path)
    : path_(path), file_(std::fopen(path.c_str(), "wb")) {
  if (file_ == nullptr) Fail();
}

OutputFile::~OutputFile() {
  if (file_ != nullptr) std::fclose(file_);
}

void OutputFile::Fail() {
  throw OutputError(path_, std::string("cannot be written: ") + std::strerror(errno));
}

void OutputFile::Bytes(const void* data, std::size_t size) {
  if (size != 0 && std::fwrite(data, 1, size, file_) != size) Fail();
}

void OutputFile::Format(const char* format, ...) {
  std::va_list arguments;
  va_start(arguments, format);
  const int written = std::vfprintf(file_, format, arguments);
  va_end(arguments);
  if (written < 0) Fail();
}

void OutputFile::Close() {
  std::FILE* file = file_;
  file_ = nullptr;
  if (std::fclose(file) != 0) Fail();
}

}  // namespace sherd::synthetic
