// One picture file being written through OpenImageIO under a temporary name. Private to the
// picture code: keeps OpenImageIO's types out of picture.h.
#pragma once

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <memory>
#include <string>

#include "metaball/atomic_file.h"

namespace sherd {

// A file that remembers its first failed write: OpenImageIO's own files lose the error that a full
// disk gives when the last buffer is flushed.
class CheckedProxy final : public OIIO::Filesystem::IOProxy {
 public:
  explicit CheckedProxy(const std::string& path);
  ~CheckedProxy() override;
  const char* proxytype() const override { return "checked"; }
  void close() override {}
  bool opened() const override { return fd_ >= 0; }
  bool seek(std::int64_t offset) override;
  std::size_t read(void* buffer, std::size_t size) override;
  std::size_t pread(void* buffer, std::size_t size, std::int64_t offset) override;
  std::size_t write(const void* buffer, std::size_t size) override;
  std::size_t pwrite(const void* buffer, std::size_t size, std::int64_t offset) override;
  std::size_t size() const override;
  // Flushes to the disk; false when that or any write before it failed (see error_code).
  bool Sync();
  int error_code() const { return error_code_; }

 private:
  int fd_ = -1;
  int error_code_ = 0;
};

class PictureFile {
 public:
  // `format` is OpenImageIO's name of it ("png"). Makes the temporary file; the format's own writer
  // begins with the first row (libpng complains on stderr about a file that ends without any).
  // Throws OutputError.
  PictureFile(const std::string& path, const std::string& format, const OIIO::ImageSpec& spec);
  ~PictureFile();

  // `rows` full rows, interleaved, of `type` (converted to the spec's). Throws OutputError.
  void WriteRows(const void* pixels, OIIO::TypeDesc type, int rows);
  // Throws OutputError; the file is then as it was before.
  void Finish();

 private:
  void Open();
  [[noreturn]] void Fail(const std::string& what);

  std::string path_, format_;
  OIIO::ImageSpec spec_;
  AtomicFile file_;
  std::unique_ptr<CheckedProxy> proxy_;
  std::unique_ptr<OIIO::ImageOutput> output_;
  int next_row_ = 0;
};

}  // namespace sherd
