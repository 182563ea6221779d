// Between the thesis's file and a cloud (docs/thesis_file.md, "As a cloud").
#include <algorithm>
#include <charconv>
#include <cmath>

#include "metaball/error.h"
#include "metaball/thesis_file.h"

namespace sherd {
namespace {

// Channels of the cloud the flags stand for.
constexpr const char* kNormal = "normal";
constexpr const char* kUv = "uv";
constexpr const char* kNormalMap = "normal_map";
constexpr const char* kNormalMapUv = "normal_map_uv";
// A further channel of three numbers by this name is the cloud's colour beside a texture.
constexpr const char* kColorName = "color";

// World coordinates are written as floats where that moves no centre by more of its radius.
constexpr double kLargestMove = 1e-6;

Rgb8 ColorOf(const float* v) { return {Quantize8(v[0]), Quantize8(v[1]), Quantize8(v[2])}; }

Channel ChannelOf(const ThesisFile& file, int width, const std::string& name, ChannelType type,
                  int offset, int components) {
  Channel channel(name, type, components, file.count);
  for (std::size_t i = 0; i < file.count; ++i) {
    ChannelValue value;
    const float* from = file.values.data() + i * static_cast<std::size_t>(width) + offset;
    std::copy_n(from, components, value.v);
    channel.Set(i, value);
  }
  return channel;
}

// A name that is nobody's word or prefix.
std::string FileName(const std::string& name) {
  const bool taken = name == kThesisColorWord || name == kThesisNormalWord ||
                     name.starts_with("UV") || name.starts_with("Channel ") ||
                     name.starts_with("Origin ");
  return taken ? "./" + name : name;
}

std::string OriginName(const Vec3d& origin) {
  std::string text = "Origin";
  for (const double v : {origin.x, origin.y, origin.z}) {
    char buffer[32];
    text += ' ';
    text.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, v).ptr);
  }
  return text;
}

// Floats hold the world coordinates well enough.
bool FloatsHoldWorld(const Cloud& cloud) {
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3d world = cloud.frame.WorldFromLocal(cloud.center[i]);
    const Vec3d moved = world.cast<float>().cast<double>() - world;
    const double radius = cloud.RadiusOf(i) * cloud.frame.unit;
    if (!(Length(moved) <= kLargestMove * radius)) return false;
  }
  return true;
}

// Collects what a record is made of and then writes the records.
class RecordWriter {
 public:
  explicit RecordWriter(const Cloud& cloud) : cloud_(cloud) {}

  void AddChannel(const Channel& channel) {
    fields_.push_back({&channel, channel.components()});
    width_ += channel.components();
  }
  void AddColor() {
    fields_.push_back({nullptr, 3});
    width_ += 3;
  }

  std::vector<float> Values(const Vec3d& origin, std::uint32_t flags) const {
    std::vector<float> values;
    const int own = 3 + (flags & kThesisRadius ? 1 : 0) + (flags & kThesisThreshold ? 1 : 0);
    values.reserve(cloud_.size() * static_cast<std::size_t>(own + width_));
    const double unit = cloud_.frame.unit;
    for (std::size_t i = 0; i < cloud_.size(); ++i) {
      const Vec3d center = (cloud_.frame.origin - origin) + unit * cloud_.center[i].cast<double>();
      for (const double v : {center.x, center.y, center.z}) {
        values.push_back(static_cast<float>(v));
      }
      if (flags & kThesisRadius) values.push_back(static_cast<float>(cloud_.radius[i] * unit));
      if (flags & kThesisThreshold) values.push_back(cloud_.threshold[i]);
      for (const auto& [channel, components] : fields_) {
        ChannelValue value;
        if (channel) {
          value = channel->Get(i);
        } else {
          const Rgb8 c = cloud_.ColorOf(i);
          value = {{c.r / 255.0f, c.g / 255.0f, c.b / 255.0f}};
        }
        values.insert(values.end(), value.v, value.v + components);
      }
    }
    return values;
  }

 private:
  struct Field {
    const Channel* channel;  // null: the colour
    int components;
  };
  const Cloud& cloud_;
  std::vector<Field> fields_;
  int width_ = 0;
};

const Channel* Find(const Cloud& cloud, const char* name, int components) {
  const Channel* channel = cloud.FindChannel(name);
  return channel && channel->components() == components ? channel : nullptr;
}

}  // namespace

ThesisScene SceneOfThesis(const ThesisFile& file, const std::string& path) {
  const ThesisLayout layout = LayoutOf(file, path);
  if (layout.center < 0) {
    throw InputError(path, "", "holds no centres (flag 1): there is nothing to draw",
                     "export it with its centres");
  }
  const auto width = static_cast<std::size_t>(layout.width);
  CloudInput input;
  const std::size_t n = file.count;
  const auto record = [&](std::size_t i, int offset) {
    return file.values.data() + i * width + offset;
  };
  for (std::size_t i = 0; i < n; ++i) {
    const float* c = record(i, layout.center);
    input.center.push_back(layout.origin + Vec3f{c[0], c[1], c[2]}.cast<double>());
    if (layout.radius >= 0) input.radius.push_back(*record(i, layout.radius));
    if (layout.threshold >= 0) input.threshold.push_back(*record(i, layout.threshold));
    if (layout.color >= 0) input.color.push_back(ColorOf(record(i, layout.color)));
  }
  if (layout.radius < 0) input.uniform_radius = file.default_radius;

  const auto add = [&](const std::string& name, ChannelType type, int offset, int components) {
    if (offset < 0) return;
    for (const Channel& channel : input.channels) {
      if (channel.name() == name) {
        throw InputError(path, "", "has two channels named '" + name + "'", "rename one of them");
      }
    }
    input.channels.push_back(ChannelOf(file, layout.width, name, type, offset, components));
  };
  add(kNormal, ChannelType::kOctahedral, layout.normal, 3);
  // The normal map's own texture coordinates become the main ones where there are no others.
  const bool other_uv =
      layout.uv >= 0 || std::any_of(layout.extras.begin(), layout.extras.end(),
                                    [](const ThesisExtra& extra) { return extra.name == kUv; });
  add(kUv, ChannelType::kFloat32, layout.uv, 2);
  add(kNormalMap, ChannelType::kFloat32, layout.normal_map, 3);
  add(other_uv ? kNormalMapUv : kUv, ChannelType::kFloat32, layout.normal_map_uv, 2);
  for (const ThesisExtra& extra : layout.extras) {
    const bool stored_color = extra.kind == ThesisExtra::Kind::kColor ||
                              (extra.kind == ThesisExtra::Kind::kValues &&
                               extra.name == kColorName && extra.components == 3);
    if (stored_color && input.color.empty()) {
      for (std::size_t i = 0; i < n; ++i) input.color.push_back(ColorOf(record(i, extra.offset)));
    } else if (extra.kind == ThesisExtra::Kind::kOwnUv) {
      add("uv:" + extra.name, ChannelType::kFloat32, extra.offset, 2);
    } else if (extra.kind != ThesisExtra::Kind::kSharedUv) {
      add(extra.name, ChannelType::kFloat32, extra.offset, extra.components);
    }
  }

  ThesisScene scene;
  scene.cloud = BuildCloud(input);
  scene.surface.threshold = file.default_threshold;
  if (layout.threshold >= 0) scene.surface.mode = ThresholdMode::kBlended;
  scene.color_texture = layout.color_texture;
  scene.normal_map_texture = layout.normal_map_texture;
  return scene;
}

ThesisFile ThesisOf(const ThesisScene& scene) {
  const Cloud& cloud = scene.cloud;
  ThesisFile file;
  file.count = static_cast<std::uint32_t>(cloud.size());
  file.default_threshold = static_cast<float>(scene.surface.threshold);
  const float radius = static_cast<float>(cloud.uniform_radius * cloud.frame.unit);
  if (radius > 0) file.default_radius = radius;
  file.flags = kThesisCenter;
  if (!cloud.radius.empty()) file.flags |= kThesisRadius;
  if (!cloud.threshold.empty()) file.flags |= kThesisThreshold;

  RecordWriter records(cloud);
  std::vector<const Channel*> written;
  const auto add = [&](const Channel* channel) {
    records.AddChannel(*channel);
    written.push_back(channel);
  };
  const auto flag = [&](std::uint32_t bit, const std::string& name, const Channel* channel) {
    file.flags |= bit;
    file.names.push_back(name);
    if (channel) add(channel);
  };
  if (const Channel* normal = Find(cloud, kNormal, 3)) {
    file.flags |= kThesisNormal;
    add(normal);
  }
  const Channel* const uv = Find(cloud, kUv, 2);
  const Channel* const map_uv = Find(cloud, kNormalMapUv, 2);
  const Channel* const map = Find(cloud, kNormalMap, 3);
  const bool has_color = !cloud.color.empty() || !(cloud.uniform_color == Cloud{}.uniform_color);
  const bool textured = uv && !scene.color_texture.empty();
  if (textured) {
    // The word stands for itself only where it is the whole name; here no prefix has a meaning.
    const bool word = scene.color_texture == kThesisColorWord;
    flag(kThesisColor, (word ? "./" : "") + scene.color_texture, uv);
  } else if (has_color) {
    flag(kThesisColor, kThesisColorWord, nullptr);
    records.AddColor();
  }
  if (!scene.normal_map_texture.empty() && (map_uv || uv)) {
    const Channel* const own = map_uv ? map_uv : textured ? nullptr : uv;
    flag(kThesisNormalMap,
         own ? "UV" + scene.normal_map_texture : FileName(scene.normal_map_texture), own);
  } else if (map) {
    flag(kThesisNormalMap, kThesisNormalWord, map);
  }
  if (textured && has_color) {
    file.names.push_back("Channel 3 " + std::string(kColorName));
    records.AddColor();
  }
  for (const Channel& channel : cloud.channels) {
    if (std::find(written.begin(), written.end(), &channel) != written.end()) continue;
    file.names.push_back("Channel " + std::to_string(channel.components()) + " " + channel.name());
    add(&channel);
  }
  Vec3d origin{};
  if (!FloatsHoldWorld(cloud)) {
    origin = cloud.frame.origin;
    file.names.push_back(OriginName(origin));
  }
  file.values = records.Values(origin, file.flags);
  return file;
}

}  // namespace sherd
