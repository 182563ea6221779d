// A photograph's file, read row by row. Internal to reconstruction/: OpenImageIO stays in the .cc.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "metaball/vec.h"

namespace sherd {

class PhotoFile {
 public:
  // Opens the file and reads its header. Throws InputError. EXIF orientation is not applied.
  explicit PhotoFile(const std::string& path);
  // The same of a file in memory, `bytes`, which must outlive this; `name` is for messages.
  PhotoFile(const std::string& name, const std::vector<std::uint8_t>& bytes);
  ~PhotoFile();

  int width() const { return width_; }
  int height() const { return height_; }

  // Calls take(row, encoded) for every row from the top, `row` holding width() linear colours; one
  // channel is taken as grey, a fourth is left out. encoded: the same row as the file has it, three
  // bytes of sRGB for each pixel; null where it has no such. In strips, never the whole picture.
  // Throws InputError.
  void ReadRows(const std::function<void(const Vec3f* row, const std::uint8_t* encoded)>& take);

 private:
  struct Impl;
  void Open(const std::string& what);
  std::unique_ptr<Impl> impl_;
  std::string path_;
  int width_ = 0, height_ = 0;
};

}  // namespace sherd
