// What a thesis file's flags and names say of its records (docs/thesis_file.md).
#include <charconv>
#include <cmath>
#include <string_view>

#include "metaball/error.h"
#include "metaball/thesis_file.h"

namespace sherd {
namespace {

constexpr std::string_view kChannelPrefix = "Channel ";
constexpr std::string_view kOriginPrefix = "Origin ";
constexpr std::string_view kUvPrefix = "UV";

// Reads names one after another and gives every field its place.
class LayoutBuilder {
 public:
  LayoutBuilder(const ThesisFile& file, const std::string& path) : file_(file), path_(path) {}

  ThesisLayout Build() {
    if (file_.flags & ~kThesisFlags) {
      throw InputError(path_, "", "has feature flags beyond 63: " + std::to_string(file_.flags),
                       "see docs/thesis_file.md");
    }
    if (file_.flags & kThesisCenter) layout_.center = Take(3);
    if (file_.flags & kThesisRadius) layout_.radius = Take(1);
    if (file_.flags & kThesisThreshold) layout_.threshold = Take(1);
    if (file_.flags & kThesisNormal) layout_.normal = Take(3);
    if (file_.flags & kThesisColor) AddColor(NextName("colour"));
    if (file_.flags & kThesisNormalMap) AddNormalMap(NextName("normal map"));
    while (next_ < file_.names.size()) AddFurther(NextName("channel"));
    return std::move(layout_);
  }

 private:
  [[noreturn]] void Fail(const std::string& what, const std::string& hint) const {
    throw InputError(path_, "name " + std::to_string(next_), what, hint);
  }

  int Take(int numbers) {
    const int offset = layout_.width;
    layout_.width += numbers;
    return offset;
  }

  const std::string& NextName(const char* what) {
    if (next_ == file_.names.size()) {
      throw InputError(path_, "name " + std::to_string(next_ + 1),
                       std::string("the flags promise a ") + what + ", but its name is missing",
                       "give an image's name, or Color or Normal where values are stored");
    }
    const std::string& name = file_.names[next_++];
    if (name.empty()) Fail("is empty", "give an image's name, or Color or Normal");
    for (const char c : name) {
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
        Fail("holds a control character", "file names here are printable text");
      }
    }
    return name;
  }

  void AddColor(const std::string& name) {
    if (name == kThesisColorWord) {
      layout_.color = Take(3);
    } else {
      layout_.color_texture = name;
      layout_.uv = Take(2);
    }
  }

  void AddNormalMap(const std::string& name) {
    if (name == kThesisNormalWord) {
      layout_.normal_map = Take(3);
    } else if (name.starts_with(kUvPrefix)) {
      layout_.normal_map_texture = FileAfterUv(name);
      layout_.normal_map_uv = Take(2);
    } else {
      layout_.normal_map_texture = name;
      ExpectMainUv();
    }
  }

  void AddFurther(const std::string& name) {
    ThesisExtra extra;
    if (name.starts_with(kOriginPrefix)) {
      AddOrigin(name);
      return;
    }
    if (name.starts_with(kChannelPrefix)) {
      const std::string rest = name.substr(kChannelPrefix.size());  // "3 color"
      if (rest.size() < 3 || rest[0] < '1' || rest[0] > '4' || rest[1] != ' ') {
        Fail("'" + name + "' does not describe a channel",
             "write Channel, the number of its components (1 to 4) and its name");
      }
      extra.components = rest[0] - '0';
      extra.name = rest.substr(2);
    } else if (name == kThesisColorWord) {
      extra.kind = ThesisExtra::Kind::kColor;
      extra.name = "color" + std::to_string(next_);
      extra.components = 3;
    } else if (name.starts_with(kUvPrefix)) {
      extra.kind = ThesisExtra::Kind::kOwnUv;
      extra.name = FileAfterUv(name);
      extra.components = 2;
    } else {
      extra.kind = ThesisExtra::Kind::kSharedUv;
      extra.name = name;
      ExpectMainUv();
    }
    extra.offset = Take(extra.components);
    layout_.extras.push_back(std::move(extra));
  }

  void AddOrigin(const std::string& name) {
    const char* at = name.data() + kOriginPrefix.size();
    const char* const end = name.data() + name.size();
    double* const axes[] = {&layout_.origin.x, &layout_.origin.y, &layout_.origin.z};
    bool good = !has_origin_;
    for (int k = 0; k < 3 && good; ++k) {
      if (k > 0) good = at != end && *at++ == ' ';
      if (!good) break;
      const auto result = std::from_chars(at, end, *axes[k]);
      good = result.ec == std::errc() && std::isfinite(*axes[k]);
      at = result.ptr;
    }
    if (!good || at != end) {
      Fail("'" + name + "' is no origin, or the second one",
           "write Origin and three numbers with one blank between them, once");
    }
    has_origin_ = true;
  }

  std::string FileAfterUv(const std::string& name) const {
    if (name.size() == kUvPrefix.size()) Fail("has no file name after UV", "add the image's name");
    return name.substr(kUvPrefix.size());
  }

  void ExpectMainUv() const {
    if (layout_.main_uv() < 0) {
      Fail("shares texture coordinates, but the colour has none",
           "put UV before the name to store its own");
    }
  }

  const ThesisFile& file_;
  const std::string& path_;
  ThesisLayout layout_;
  std::size_t next_ = 0;
  bool has_origin_ = false;
};

}  // namespace

ThesisLayout LayoutOf(const ThesisFile& file, const std::string& path) {
  return LayoutBuilder(file, path).Build();
}

}  // namespace sherd
