// Meshes as PLY and OBJ files.
#include <bit>
#include <charconv>
#include <cstring>
#include <filesystem>

#include "metaball/atomic_file.h"
#include "metaball/mesh/mesh.h"

namespace sherd {
namespace {

static_assert(std::endian::native == std::endian::little, "the file is little endian");

constexpr std::size_t kBufferBytes = 1 << 20;

// Collects bytes or text and passes them on in large pieces. Numbers never ask the locale.
class Writer {
 public:
  explicit Writer(const std::string& path) : file_(path) {}

  void Text(std::string_view text) {
    buffer_ += text;
    if (buffer_.size() >= kBufferBytes) Flush();
  }
  template <class T>
  void Number(T value) {
    char digits[32];
    const auto end = std::to_chars(digits, digits + sizeof digits, value).ptr;
    Text({digits, static_cast<std::size_t>(end - digits)});
  }
  template <class T>
  void Raw(const T& value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    Text({bytes, sizeof value});
  }
  void Commit() {
    Flush();
    file_.Commit();
  }

 private:
  void Flush() {
    file_.Write(buffer_.data(), buffer_.size());
    buffer_.clear();
  }
  AtomicFile file_;
  std::string buffer_;
};

// Names go into one line of text.
std::string OneLine(std::string text) {
  for (char& c : text) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  return text;
}

}  // namespace

void WritePlyMesh(const std::string& path, const SurfaceMesh& mesh, const std::string& texture) {
  Writer out(path);
  out.Text("ply\nformat binary_little_endian 1.0\n");
  if (!mesh.uv.empty() && !texture.empty()) {
    out.Text("comment TextureFile " + OneLine(texture) + "\n");
  }
  out.Text("element vertex " + std::to_string(mesh.position.size()) + "\n");
  out.Text(
      "property double x\nproperty double y\nproperty double z\n"
      "property float nx\nproperty float ny\nproperty float nz\n");
  if (!mesh.uv.empty()) out.Text("property float s\nproperty float t\n");
  out.Text("property uchar red\nproperty uchar green\nproperty uchar blue\n");
  out.Text("element face " + std::to_string(mesh.triangle.size()) +
           "\nproperty list uchar int vertex_indices\nend_header\n");
  for (std::size_t i = 0; i < mesh.position.size(); ++i) {
    out.Raw(mesh.position[i]);
    out.Raw(mesh.normal[i]);
    if (!mesh.uv.empty()) out.Raw(mesh.uv[i]);
    out.Raw(mesh.color[i]);
  }
  for (const auto& triangle : mesh.triangle) {
    out.Raw(std::uint8_t{3});
    out.Raw(triangle);
  }
  out.Commit();
}

void WriteObjMesh(const std::string& path, const SurfaceMesh& mesh, const std::string& texture) {
  const bool textured = !mesh.uv.empty() && !texture.empty();
  Writer out(path);
  const auto floats = [&](const char* word, const float* v, int count) {
    out.Text(word);
    for (int k = 0; k < count; ++k) {
      out.Text(" ");
      out.Number(v[k]);
    }
    out.Text("\n");
  };
  const std::filesystem::path material = std::filesystem::path(path).replace_extension(".mtl");
  if (textured) {
    out.Text("mtllib " + OneLine(material.filename().string()) + "\nusemtl surface\n");
  }
  for (std::size_t i = 0; i < mesh.position.size(); ++i) {
    const Vec3d& p = mesh.position[i];
    const Rgb8 c = mesh.color[i];
    const auto share = [](std::uint8_t v) { return static_cast<float>(v) / 255.0f; };
    out.Text("v ");
    out.Number(p.x);
    out.Text(" ");
    out.Number(p.y);
    out.Text(" ");
    out.Number(p.z);
    const float rgb[3] = {share(c.r), share(c.g), share(c.b)};
    floats("", rgb, 3);
  }
  for (const auto& uv : mesh.uv) floats("vt", uv.data(), 2);
  for (const Vec3f& n : mesh.normal) floats("vn", &n.x, 3);
  for (const auto& triangle : mesh.triangle) {
    out.Text("f");
    for (const std::uint32_t corner : triangle) {
      out.Text(" ");
      out.Number(corner + 1);
      out.Text("/");
      if (!mesh.uv.empty()) out.Number(corner + 1);
      out.Text("/");
      out.Number(corner + 1);
    }
    out.Text("\n");
  }
  if (textured) {
    Writer mtl(material.string());
    mtl.Text("newmtl surface\nKa 1 1 1\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd " + OneLine(texture) +
             "\n");
    mtl.Commit();
  }
  out.Commit();
}

}  // namespace sherd
