#include "reconstruction/mesh_textures.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <utility>

#include "metaball/appearance/image.h"
#include "metaball/error.h"
#include "reconstruction/folder_scan.h"
#include "reconstruction/memory.h"
#include "reconstruction/photo_file.h"
#include "reconstruction/photo_pyramid.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;

int HexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

// The text behind a URI (RFC 3986, 2.1).
std::string PercentDecoded(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size() && HexDigit(text[i + 1]) >= 0 &&
        HexDigit(text[i + 2]) >= 0) {
      out += static_cast<char>(16 * HexDigit(text[i + 1]) + HexDigit(text[i + 2]));
      i += 2;
    } else {
      out += text[i];
    }
  }
  return out;
}

// Pixels and halvings together: 3 bytes a pixel and a third of that.
constexpr std::uint64_t kBytesPerPixel = 4;

ImagePyramid Load(const ImportedMesh& mesh, const MeshTexture& texture,
                  std::uint64_t memory_limit_bytes) {
  PhotoFile file = texture.pixels.empty()
                       ? PhotoFile(texture.path)
                       : PhotoFile(mesh.path + ": texture " + texture.name, texture.pixels);
  Image image;
  image.width = file.width();
  image.height = file.height();
  CheckMemory("texture " + texture.name, image.pixels() * kBytesPerPixel, memory_limit_bytes);
  image.bytes.reserve(image.pixels());
  file.ReadRows([&](const Vec3f* row, const std::uint8_t*) {
    for (int x = 0; x < image.width; ++x) {
      image.bytes.push_back(
          {EncodeLinear(row[x].x), EncodeLinear(row[x].y), EncodeLinear(row[x].z)});
    }
  });
  return ImagePyramid(std::move(image));
}

// Mirrored images repeat with twice their size, every other one turned around.
float Wrapped(float t, MeshWrap wrap) {
  if (wrap != MeshWrap::kMirror || !std::isfinite(t)) return t;
  const float in_pair = t - 2.0f * std::floor(t / 2.0f);
  return in_pair <= 1.0f ? in_pair : 2.0f - in_pair;
}

}  // namespace

std::string FindTexture(const std::string& folder, const std::string& name) {
  std::error_code error;
  std::string slashed = name;
  std::replace(slashed.begin(), slashed.end(), '\\', '/');
  for (const std::string& relative : {name, slashed, PercentDecoded(slashed)}) {
    const fs::path path = fs::path(folder) / relative;
    if (!relative.empty() && fs::is_regular_file(path, error)) return path.string();
  }
  const std::string wanted = LowerCase(fs::path(PercentDecoded(slashed)).filename().string());
  std::string found;  // the first in the order of the alphabet, not of the disk
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    const std::string path = entry.path().string();
    if (LowerCase(entry.path().filename().string()) == wanted && entry.is_regular_file(error) &&
        (found.empty() || path < found)) {
      found = path;
    }
  }
  return found;
}

void ApplyTextures(const ImportedMesh& mesh, const std::vector<std::uint32_t>& texture,
                   const std::vector<std::array<float, 2>>& uv, std::uint64_t memory_limit_bytes,
                   const Control& control, std::vector<Vec3f>* color,
                   std::vector<std::string>* warnings) {
  for (std::size_t t = 0; t < mesh.textures.size(); ++t) {
    control.ThrowIfStopped();
    const MeshTexture& source = mesh.textures[t];
    const auto wanted = static_cast<std::uint32_t>(t);
    if (std::find(texture.begin(), texture.end(), wanted) == texture.end()) continue;
    std::string problem;
    if (source.path.empty() && source.pixels.empty()) {
      problem = "texture " + source.name + " is missing; put it beside the mesh";
    } else {
      try {
        const ImagePyramid image = Load(mesh, source, memory_limit_bytes);
        for (std::size_t i = 0; i < texture.size(); ++i) {
          if (texture[i] != wanted) continue;
          const Vec3f c =
              image.Sample(Wrapped(uv[i][0], source.wrap_u), Wrapped(uv[i][1], source.wrap_v), {},
                           source.wrap_u == MeshWrap::kRepeat, source.wrap_v == MeshWrap::kRepeat);
          Vec3f& out = (*color)[i];
          out = mesh.textures_multiply ? Vec3f{out.x * c.x, out.y * c.y, out.z * c.z} : c;
        }
        continue;
      } catch (const InputError& error) {
        problem = "texture " + source.name + " cannot be read: " + error.message();
      }
    }
    // Two materials may use one image in two ways.
    const std::string line =
        mesh.path + ": " + problem + " (without it the colours of the material are taken)";
    if (std::find(warnings->begin(), warnings->end(), line) == warnings->end()) {
      warnings->push_back(line);
    }
  }
}

}  // namespace sherd
