#include "app/project/picture_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "metaball/error.h"

namespace sherd {
namespace {

std::string OneLine(std::string text) {
  for (char& c : text) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

}  // namespace

CheckedProxy::CheckedProxy(const std::string& path) : IOProxy(path, Write) {
  fd_ = open(path.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (fd_ < 0) error_code_ = errno;
}

CheckedProxy::~CheckedProxy() {
  if (fd_ >= 0) ::close(fd_);
}

bool CheckedProxy::seek(std::int64_t offset) {
  m_pos = offset;
  return true;
}

// Formats that patch their own header read it back.
std::size_t CheckedProxy::read(void* buffer, std::size_t size) {
  const std::size_t n = pread(buffer, size, m_pos);
  m_pos += static_cast<std::int64_t>(n);
  return n;
}

std::size_t CheckedProxy::pread(void* buffer, std::size_t size, std::int64_t offset) {
  const ssize_t n = ::pread(fd_, buffer, size, offset);
  return n > 0 ? static_cast<std::size_t>(n) : 0;
}

std::size_t CheckedProxy::write(const void* buffer, std::size_t size) {
  const std::size_t written = pwrite(buffer, size, m_pos);
  m_pos += static_cast<std::int64_t>(written);
  return written;
}

std::size_t CheckedProxy::pwrite(const void* buffer, std::size_t size, std::int64_t offset) {
  std::size_t done = 0;
  while (done < size) {
    const ssize_t n = ::pwrite(fd_, static_cast<const char*>(buffer) + done, size - done,
                               offset + static_cast<std::int64_t>(done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      if (error_code_ == 0) error_code_ = n < 0 ? errno : ENOSPC;
      break;
    }
    done += static_cast<std::size_t>(n);
  }
  return done;
}

std::size_t CheckedProxy::size() const {
  struct stat info;
  return fstat(fd_, &info) == 0 ? static_cast<std::size_t>(info.st_size) : 0;
}

bool CheckedProxy::Sync() {
  if (fd_ >= 0 && fsync(fd_) != 0 && error_code_ == 0) error_code_ = errno;
  if (fd_ >= 0 && ::close(fd_) != 0 && error_code_ == 0) error_code_ = errno;
  fd_ = -1;
  return error_code_ == 0;
}

PictureFile::PictureFile(const std::string& path, const std::string& format,
                         const OIIO::ImageSpec& spec)
    : path_(path), format_(format), spec_(spec), file_(path) {
  file_.CloseForExternalWriter();
}

void PictureFile::Open() {
  output_ = OIIO::ImageOutput::create(format_);
  if (!output_) {
    throw OutputError(path_, "OpenImageIO cannot write " + format_ +
                                 " on this machine: " + OneLine(OIIO::geterror()));
  }
  // Not for TIFF: libtiff writes without a buffer and reports every failure itself, and through a
  // proxy OpenImageIO 2.4 makes the Exif directory the file's first.
  if (format_ != "tiff" && output_->supports("ioproxy")) {
    proxy_ = std::make_unique<CheckedProxy>(file_.temporary_path());
    if (!proxy_->opened()) Fail("cannot be written");
    void* pointer = proxy_.get();
    spec_.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &pointer);
  }
  if (!output_->open(file_.temporary_path(), spec_)) Fail("cannot be written");
}

PictureFile::~PictureFile() {
  // A half-written file is closed before AtomicFile removes it; what the format says about the
  // missing rows is of no interest.
  if (output_) {
    output_->close();
    output_->geterror();
  }
}

void PictureFile::WriteRows(const void* pixels, OIIO::TypeDesc type, int rows) {
  if (!output_) Open();
  if (!output_->write_scanlines(next_row_, next_row_ + rows, 0, type, pixels)) {
    Fail("writing failed");
  }
  next_row_ += rows;
}

void PictureFile::Finish() {
  if (!output_->close()) Fail("writing failed");
  output_.reset();
  if (proxy_) {
    if (!proxy_->Sync()) Fail("writing failed");
  } else {
    const int fd = open(file_.temporary_path().c_str(), O_RDONLY | O_CLOEXEC);
    const bool synced = fd >= 0 && fsync(fd) == 0;
    const int code = errno;
    if (fd >= 0) ::close(fd);
    if (!synced) throw OutputError(path_, std::string("writing failed: ") + std::strerror(code));
  }
  file_.Commit();
}

void PictureFile::Fail(const std::string& what) {
  if (proxy_ && proxy_->error_code() != 0) {
    throw OutputError(path_, what + ": " + std::strerror(proxy_->error_code()));
  }
  const std::string reason = output_ ? OneLine(output_->geterror()) : "";
  throw OutputError(path_, what + (reason.empty() ? "" : ": " + reason));
}

}  // namespace sherd
