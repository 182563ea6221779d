// rigs.* and frames.* of COLMAP >= 3.12 (colmap_formats 2.4, 2.5).
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <tuple>

#include "metaball/error.h"
#include "reconstruction/binary_reader.h"
#include "reconstruction/colmap_model.h"
#include "reconstruction/text_reader.h"

namespace sherd {
namespace {

constexpr std::int32_t kCameraSensor = 0;

struct Sensor {
  std::int32_t type = -1;
  std::uint32_t id = 0;
  friend auto operator<=>(const Sensor&, const Sensor&) = default;
};

struct Rig {
  std::map<Sensor, std::optional<Rigid3d>> sensor_from_rig;  // none: unknown pose
};

struct FrameData {
  Sensor sensor;
  std::uint64_t data_id = 0;
};

struct RigFrame {
  std::uint32_t rig_id = 0;
  Rigid3d rig_from_world;
  std::vector<FrameData> data;
};

using Rigs = std::map<std::uint32_t, Rig>;

Rigid3d Composed(const Rigid3d& a, const Rigid3d& b) {  // a * b
  Rigid3d c;
  c.qw = a.qw * b.qw - a.qx * b.qx - a.qy * b.qy - a.qz * b.qz;
  c.qx = a.qw * b.qx + a.qx * b.qw + a.qy * b.qz - a.qz * b.qy;
  c.qy = a.qw * b.qy - a.qx * b.qz + a.qy * b.qw + a.qz * b.qx;
  c.qz = a.qw * b.qz + a.qx * b.qy - a.qy * b.qx + a.qz * b.qw;
  c.translation = a.Apply(b.translation);
  return c;
}

template <class Next>  // Next() gives the next number of the pose
Rigid3d ReadPose(const std::string& path, const std::string& place, const Next& next) {
  Rigid3d pose;
  pose.qw = next();
  pose.qx = next();
  pose.qy = next();
  pose.qz = next();
  pose.translation.x = next();
  pose.translation.y = next();
  pose.translation.z = next();
  CheckPose(path, place, &pose);
  return pose;
}

Rigs ReadRigsBinary(const std::string& path) {
  BinaryReader reader(path);
  Rigs rigs;
  const auto count = reader.Read<std::uint64_t>("the number of rigs");
  reader.CheckCount(count, 8, "rigs");
  for (std::uint64_t i = 0; i < count; ++i) {
    Rig& rig = rigs[reader.Read<std::uint32_t>("a rig")];
    const auto sensors = reader.Read<std::uint32_t>("a rig");
    if (sensors == 0) continue;
    reader.CheckCount(sensors, 8, "sensors");
    for (std::uint32_t j = 0; j < sensors; ++j) {
      Sensor sensor;
      sensor.type = reader.Read<std::int32_t>("a sensor");
      sensor.id = reader.Read<std::uint32_t>("a sensor");
      if (j == 0) {
        rig.sensor_from_rig[sensor] = Rigid3d{};  // the reference sensor
        continue;
      }
      auto& pose = rig.sensor_from_rig[sensor];
      if (reader.Read<std::uint8_t>("a sensor") != 0) {
        pose = ReadPose(path, "byte " + std::to_string(reader.position()),
                        [&] { return reader.Read<double>("a sensor's pose"); });
      }
    }
  }
  reader.ExpectEnd("rigs");
  return rigs;
}

std::vector<RigFrame> ReadFramesBinary(const std::string& path) {
  BinaryReader reader(path);
  std::vector<RigFrame> frames;
  const auto count = reader.Read<std::uint64_t>("the number of frames");
  reader.CheckCount(count, 4 + 4 + 7 * 8 + 4, "frames");
  frames.reserve(static_cast<std::size_t>(count));
  for (std::uint64_t i = 0; i < count; ++i) {
    RigFrame frame;
    reader.Read<std::uint32_t>("a frame");  // its id
    frame.rig_id = reader.Read<std::uint32_t>("a frame");
    frame.rig_from_world = ReadPose(path, "byte " + std::to_string(reader.position()),
                                    [&] { return reader.Read<double>("a frame's pose"); });
    const auto data = reader.Read<std::uint32_t>("a frame");
    reader.CheckCount(data, 16, "data of a frame");
    for (std::uint32_t j = 0; j < data; ++j) {
      FrameData d;
      d.sensor.type = reader.Read<std::int32_t>("a frame's data");
      d.sensor.id = reader.Read<std::uint32_t>("a frame's data");
      d.data_id = reader.Read<std::uint64_t>("a frame's data");
      frame.data.push_back(d);
    }
    frames.push_back(std::move(frame));
  }
  reader.ExpectEnd("frames");
  return frames;
}

bool ReadRecord(TextReader* reader, std::string_view* line) {
  while (reader->ReadLine(line)) {
    *line = Trimmed(*line);
    if (!line->empty() && line->front() != '#') return true;
  }
  return false;
}

Sensor ReadSensorText(TokenReader* tokens) {
  Sensor sensor;
  const std::string_view type = tokens->Token("SENSOR_TYPE");
  sensor.type = type == "CAMERA" ? kCameraSensor : type == "IMU" ? 1 : -1;
  sensor.id = tokens->Number<std::uint32_t>("SENSOR_ID");
  return sensor;
}

Rigs ReadRigsText(const std::string& path) {
  TextReader reader(path);
  Rigs rigs;
  std::string_view line;
  while (ReadRecord(&reader, &line)) {
    TokenReader tokens(reader, line);
    Rig& rig = rigs[tokens.Number<std::uint32_t>("RIG_ID")];
    const auto sensors = tokens.Number<std::uint32_t>("NUM_SENSORS");
    for (std::uint32_t j = 0; j < sensors; ++j) {
      const Sensor sensor = ReadSensorText(&tokens);
      auto& pose = rig.sensor_from_rig[sensor];
      if (j == 0) {
        pose = Rigid3d{};
      } else if (tokens.Number<int>("HAS_POSE") != 0) {
        pose = ReadPose(path, "line " + std::to_string(reader.line_number()),
                        [&] { return tokens.Number<double>("a sensor's pose"); });
      }
    }
  }
  return rigs;
}

std::vector<RigFrame> ReadFramesText(const std::string& path) {
  TextReader reader(path);
  std::vector<RigFrame> frames;
  std::string_view line;
  while (ReadRecord(&reader, &line)) {
    TokenReader tokens(reader, line);
    RigFrame frame;
    tokens.Number<std::uint32_t>("FRAME_ID");
    frame.rig_id = tokens.Number<std::uint32_t>("RIG_ID");
    frame.rig_from_world = ReadPose(path, "line " + std::to_string(reader.line_number()),
                                    [&] { return tokens.Number<double>("a frame's pose"); });
    const auto data = tokens.Number<std::uint32_t>("NUM_DATA_IDS");
    for (std::uint32_t j = 0; j < data; ++j) {
      FrameData d;
      d.sensor = ReadSensorText(&tokens);
      d.data_id = tokens.Number<std::uint64_t>("DATA_ID");
      frame.data.push_back(d);
    }
    frames.push_back(std::move(frame));
  }
  return frames;
}

// COLMAP >= 3.12 takes the poses from rigs and frames and ignores those of images.*; we take those
// of images.*. A tool that moved only one of them makes the two programs disagree.
void ComparePoses(const Rigs& rigs, const std::vector<RigFrame>& frames, ColmapModel* model) {
  std::unordered_map<std::uint64_t, const ColmapImage*> by_id;
  Vec3d min{INFINITY, INFINITY, INFINITY}, max{-INFINITY, -INFINITY, -INFINITY};
  for (const ColmapImage& image : model->images) {
    by_id[image.image_id] = &image;
    const Vec3d c = image.cam_from_world.Center();
    min = {std::min(min.x, c.x), std::min(min.y, c.y), std::min(min.z, c.z)};
    max = {std::max(max.x, c.x), std::max(max.y, c.y), std::max(max.z, c.z)};
  }
  const double size = model->images.size() > 1 ? Length(max - min) : 1.0;
  std::size_t differing = 0;
  for (const RigFrame& frame : frames) {
    const auto rig = rigs.find(frame.rig_id);
    if (rig == rigs.end()) continue;
    for (const FrameData& d : frame.data) {
      const auto image = by_id.find(d.data_id);
      const auto sensor = rig->second.sensor_from_rig.find(d.sensor);
      if (d.sensor.type != kCameraSensor || image == by_id.end() ||
          sensor == rig->second.sensor_from_rig.end() || !sensor->second) {
        continue;
      }
      const Rigid3d composed = Composed(*sensor->second, frame.rig_from_world);
      const Rigid3d& given = image->second->cam_from_world;
      const double cosine = std::abs(composed.qw * given.qw + composed.qx * given.qx +
                                     composed.qy * given.qy + composed.qz * given.qz);
      const double angle = 2 * std::acos(std::min(1.0, cosine));
      const double distance = Length(composed.Center() - given.Center());
      if (angle > 1e-3 || distance > 1e-3 * size) ++differing;
    }
  }
  if (differing > 0) {
    model->warnings.push_back(
        model->folder + ": " + std::to_string(differing) +
        " photographs have another pose in frames than in images; the one in images is used "
        "(COLMAP 3.12 and newer would use the other)");
  }
}

}  // namespace

void ReadFrames(const std::string& folder, bool binary, ColmapModel* model) {
  const std::string extension = binary ? ".bin" : ".txt";
  const std::string rigs_path = folder + "/rigs" + extension;
  const std::string frames_path = folder + "/frames" + extension;
  std::error_code ignored;
  if (!std::filesystem::exists(frames_path, ignored)) return;
  try {
    std::vector<RigFrame> frames =
        binary ? ReadFramesBinary(frames_path) : ReadFramesText(frames_path);
    Rigs rigs;
    if (std::filesystem::exists(rigs_path, ignored)) {
      rigs = binary ? ReadRigsBinary(rigs_path) : ReadRigsText(rigs_path);
    }
    for (RigFrame& frame : frames) {
      std::sort(frame.data.begin(), frame.data.end(), [](const FrameData& a, const FrameData& b) {
        return std::tie(a.sensor, a.data_id) < std::tie(b.sensor, b.data_id);
      });
      for (const FrameData& d : frame.data) {
        if (d.sensor.type == kCameraSensor && d.data_id <= UINT32_MAX) {
          model->frame_image_ids.push_back(static_cast<std::uint32_t>(d.data_id));
        }
      }
    }
    ComparePoses(rigs, frames, model);
  } catch (const InputError& error) {
    model->frame_image_ids.clear();
    model->warnings.push_back(std::string(error.what()) +
                              " (rigs and frames are left out; the photographs' poses are those "
                              "in images)");
  }
}

}  // namespace sherd
