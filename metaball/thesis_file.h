// The file format of the thesis (figure 3.11), as text (.mbt) and binary (.mbb): metaballs with any
// of centre, radius, threshold, normal, colour and normal map, and further channels.
// docs/thesis_file.md is the specification.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "metaball/cloud.h"
#include "metaball/scene.h"
#include "metaball/vec.h"

namespace sherd {

inline constexpr const char* kThesisTextExtension = ".mbt";
inline constexpr const char* kThesisBinaryExtension = ".mbb";

enum ThesisFlag : std::uint32_t {
  kThesisCenter = 1,
  kThesisRadius = 2,
  kThesisThreshold = 4,
  kThesisNormal = 8,
  kThesisColor = 16,
  kThesisNormalMap = 32,
};
inline constexpr std::uint32_t kThesisFlags = 63;

// The words that stand where a file name could.
inline constexpr const char* kThesisColorWord = "Color";    // RGB is stored
inline constexpr const char* kThesisNormalWord = "Normal";  // the normal map's value is stored

// A file's content as it lies there: `count` records of `width` numbers each.
struct ThesisFile {
  std::uint32_t count = 0;
  std::uint32_t flags = 0;
  // In the order of the flags: colour, normal map; then further channels and the origin.
  std::vector<std::string> names;
  float default_radius = 0.015f;   // of every metaball without kThesisRadius; > 0
  float default_threshold = 0.7f;  // of every metaball without kThesisThreshold; > 0
  std::vector<float> values;       // count * width, record after record

  friend bool operator==(const ThesisFile&, const ThesisFile&) = default;
};

// A texture of a file, or a further channel.
struct ThesisExtra {
  enum class Kind { kValues, kColor, kOwnUv, kSharedUv };
  Kind kind = Kind::kValues;
  std::string name;    // the channel's or the image file's
  int offset = 0;      // of its first number in a record
  int components = 0;  // how many numbers it has there; 0 for kSharedUv
};

// Where in a record each field begins, -1 for a field that is not there.
struct ThesisLayout {
  int center = -1, radius = -1, threshold = -1, normal = -1;
  int color = -1;          // RGB, 0 to 1, sRGB-encoded
  int uv = -1;             // the colour texture's
  int normal_map = -1;     // X, Y in [-1, 1], Z in [0, 1]
  int normal_map_uv = -1;  // the normal map's own
  std::string color_texture, normal_map_texture;
  std::vector<ThesisExtra> extras;
  Vec3d origin{};  // is added to every centre
  int width = 0;   // numbers in a record

  // The texture coordinates that names without their own share; -1 where there are none.
  int main_uv() const { return uv >= 0 ? uv : normal_map_uv; }
};

// What flags and names say of a record. Throws InputError with `path`, its place "name 2" where a
// name makes no sense.
ThesisLayout LayoutOf(const ThesisFile& file, const std::string& path);

// Whether the name ends in one of the two extensions: the format has no magic number.
bool IsThesisFileName(const std::string& path);
// Text or binary by the extension. Throws InputError with the line or byte; every declared size is
// checked against the file's before anything is allocated.
ThesisFile ReadThesisFile(const std::string& path);
// Text or binary by the extension. Throws InputError for a content no reader would take (naming
// the metaball), OutputError; then no file of that name was made or changed.
void WriteThesisFile(const std::string& path, const ThesisFile& file);

// A cloud with what the thesis's file says beside it.
struct ThesisScene {
  Cloud cloud;
  Surface surface;  // threshold: the default one; kBlended where the metaballs have their own
  // Images by channel: channel "uv" belongs to color_texture, and to normal_map_texture where there
  // is no channel "normal_map_uv". Empty: none.
  std::string color_texture, normal_map_texture;
};

// Normals become channel "normal", texture coordinates "uv" and "normal_map_uv", normal-map values
// "normal_map", others channels of their names. Throws InputError for a file without centres.
// `path` is for messages.
ThesisScene SceneOfThesis(const ThesisFile& file, const std::string& path);
// The inverse. Texture coordinates without a texture and channels of other names become further
// channels. Centres are written as world coordinates where floats hold them to a millionth of the
// radius, otherwise relative to an origin.
ThesisFile ThesisOf(const ThesisScene& scene);

}  // namespace sherd
