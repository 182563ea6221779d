#include "tests/fuzz/file_kinds.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "app/project/checked_file.h"
#include "app/project/project_json.h"
#include "app/project/survey_file.h"
#include "metaball/error.h"
#include "metaball/metaball_file.h"
#include "metaball/thesis_file.h"
#include "reconstruction/colmap_model.h"
#include "reconstruction/depth_map.h"
#include "reconstruction/ply.h"
#include "reconstruction/visibility.h"
#include "tests/reconstruction/test_files.h"

namespace sherd::fuzz {
namespace {

namespace fs = std::filesystem;
using test::Bytes;

std::string ReadAll(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// What `write` writes to a file of this name.
template <class Write>
std::string Written(const std::string& name, const Write& write) {
  const ScratchFolder folder;
  FileKind kind;
  kind.group = "seed";
  const std::string path = folder.For(kind) + "/" + name;
  write(path);
  return ReadAll(path);
}

std::string PoseBytes(const Rigid3d& p) {
  Bytes b;
  for (const double v :
       {p.qw, p.qx, p.qy, p.qz, p.translation.x, p.translation.y, p.translation.z}) {
    b.Add(v);
  }
  return b.str();
}

std::string RigsBin() {
  Bytes b;
  b.Add<std::uint64_t>(2);
  b.Add<std::uint32_t>(1).Add<std::uint32_t>(0);
  b.Add<std::uint32_t>(2).Add<std::uint32_t>(3).Add<std::int32_t>(0).Add<std::uint32_t>(7);
  b.Add<std::int32_t>(1).Add<std::uint32_t>(1).Add<std::uint8_t>(0);
  b.Add<std::int32_t>(0).Add<std::uint32_t>(4294967294u).Add<std::uint8_t>(1);
  return b.str() + PoseBytes(test::PoseAt({1, 0, 0}, 0.1));
}

std::string FramesBin() {
  Bytes head, data;
  head.Add<std::uint64_t>(1).Add<std::uint32_t>(1).Add<std::uint32_t>(2);
  data.Add<std::uint32_t>(2);
  data.Add<std::int32_t>(0).Add<std::uint32_t>(4294967294u).Add<std::uint64_t>(4294967294u);
  data.Add<std::int32_t>(0).Add<std::uint32_t>(7).Add<std::uint64_t>(30);
  return head.str() + PoseBytes(test::PoseAt({-1, 0, 0})) + data.str();
}

constexpr char kRigsTxt[] =
    "# rigs\n1 0\n2 3 CAMERA 7 IMU 1 0 CAMERA 4294967294 1 0.99875 0 0.04998 0 -1 0 0.1\n";
constexpr char kFramesTxt[] = "1 2 1 0 0 0 1 0 0 2 CAMERA 4294967294 4294967294 CAMERA 7 30\n";

constexpr char kAsciiPly[] =
    "ply\r\nformat ascii 1.0\r\ncomment c\r\nelement vertex 3\r\nproperty double x\r\nproperty "
    "float y\r\nproperty float z\r\nproperty list uchar int l\r\nproperty uchar red\r\nproperty "
    "uchar green\r\nproperty uchar blue\r\nelement face 1\r\nproperty list uchar int "
    "vertex_indices\r\nend_header\r\n0 0 0 1 5 1 2 3\r\n1 0 0 0 4 5 6\r\n0 1 0 2 8 9 7 8 9\r\n3 0 "
    "1 "
    "2\r\n";

std::string BinaryPly(bool big_endian) {
  std::string ply = std::string("ply\nformat binary_") + (big_endian ? "big" : "little") +
                    "_endian 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty "
                    "float z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty "
                    "uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
  for (int i = 0; i < 2; ++i) {
    for (int k = 0; k < 6; ++k) {
      const std::uint32_t one = big_endian ? 0x0000803fu : 0x3f800000u;
      ply += Bytes().Add(one).str();
    }
    ply += "rgb";
  }
  return ply;
}

std::string VisBytes() {
  Bytes b;
  b.Add<std::uint64_t>(3);
  b.Add<std::uint32_t>(2).Add<std::uint32_t>(0).Add<std::uint32_t>(7);
  b.Add<std::uint32_t>(0);
  b.Add<std::uint32_t>(1).Add<std::uint32_t>(4294967295u);
  return b.str();
}

std::string MapBytes(int channels) {
  std::string map = "3&2&" + std::to_string(channels) + "&";
  for (int i = 0; i < 6 * channels; ++i) map += Bytes().Add(0.5f * static_cast<float>(i)).str();
  return map;
}

CloudInput SmallCloud() {
  CloudInput input;
  for (int i = 0; i < 5; ++i) {
    input.center.push_back({0.1 * i, 0.2 * i, -0.3 * i});
    input.radius.push_back(0.2 + 0.01 * i);
    input.color.push_back({static_cast<std::uint8_t>(40 * i), 100, 7});
  }
  return input;
}

std::vector<std::string> MetaballSeeds() {
  Cloud cloud = BuildCloud(SmallCloud());
  std::vector<std::string> seeds{
      Written("a.metaballs", [&](const std::string& p) { WriteMetaballFile(p, cloud, 0.7); })};
  Channel channel("height", ChannelType::kFloat32, 1, cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) channel.Set(i, {{static_cast<float>(i), 0, 0, 0}});
  cloud.channels.push_back(channel);
  cloud.threshold.assign(cloud.size(), 0.5f);
  Surface surface;
  surface.mode = ThresholdMode::kBlended;
  seeds.push_back(
      Written("b.metaballs", [&](const std::string& p) { WriteMetaballFile(p, cloud, surface); }));
  return seeds;
}

std::vector<std::string> ThesisSeeds(const char* extension) {
  ThesisScene scene;
  scene.cloud = BuildCloud(SmallCloud());
  ThesisFile file = ThesisOf(scene);
  return {Written(std::string("a") + extension,
                  [&](const std::string& p) { WriteThesisFile(p, file); })};
}

Survey SmallSurvey() {
  Survey survey;
  survey.cameras.push_back({7, CameraModelId::kPinhole, 640, 480, {500, 510, 320, 240}});
  for (int i = 0; i < 2; ++i) {
    Photograph photo;
    photo.image_id = static_cast<std::uint32_t>(i);
    photo.name = "a/" + std::to_string(i) + ".jpg";
    survey.photographs.push_back(photo);
  }
  SurveyPoints& points = survey.points;
  points.position = {{0, 0, 1}, {1, 0, 2}};
  points.color = {{1, 2, 3}, {4, 5, 6}};
  points.normal = {{0, 0, 1}, {0, 1, 0}};
  points.error = {0.5f, -1};
  points.photo_begin = {0, 2, 3};
  points.photo_idx = {0, 1, 1};
  return survey;
}

Level SmallLevel() {
  Level level;
  level.name = "5";
  level.cloud = BuildCloud(SmallCloud());
  level.normal.assign(5, {0, 0, 1});
  level.photo_begin = {0, 1, 1, 2, 2, 3};
  level.photo_idx = {0, 1, 0};
  return level;
}

constexpr char kProject[] = R"({"format": "sherd project", "version": 1, "program": "sherd 0.1.0",
"revision": 2, "metres_per_unit": 0.5, "up": [0, 0, 1], "front": null,
"project_from_source": [2, 0.6, 0.8, 0, 0, 1, 2, 3],
"bounds": {"min": [0, 0, 0], "max": [1, 1, 1]},
"import": {"source": "a", "photo_folder": "", "survey": "p.sherd.d/survey.bin",
"outline": "p.sherd.d/outline.bin", "cameras": 1, "photographs": 2, "photographs_found": 1,
"points": 2, "dense": true, "has_normals": true, "has_visibility": true, "warnings": ["w"],
"seconds": 0.5},
"levels": [{"name": "5", "folder": "p.sherd.d/5", "program": "0.1.0",
"options": {"target_count": 5, "remove_outliers": true, "radius_factor": 2.5, "threshold": 0.7,
"photos_per_metaball": 8},
"stats": {"source_points": 5, "outliers": 0, "target_count": 5, "count": 5, "spacing": 0.1,
"radius_min": 0.2, "radius_median": 0.2, "radius_max": 0.3, "threshold": 0.7, "open_share": 0,
"seconds": 0.1, "cloud_bytes": 100}}]}
)";

// The sum at the end of the project's own files, so that what stands before it is looked at.
std::string WithSum(std::string bytes) {
  const std::uint32_t sum = Crc32(bytes.data(), bytes.size());
  return bytes + Bytes().Add(sum).str();
}

std::string WithoutSum(const std::string& bytes) { return bytes.substr(0, bytes.size() - 4); }

template <void (*ReadFile)(const std::string&, ColmapModel*)>
void ReadPart(const std::string& path) {
  ColmapModel model;
  ReadFile(path, &model);
}

void ReadBinaryImages(const std::string& folder) {
  ColmapModel model;
  ReadImagesBinary(folder + "/images.bin", &model, {});
}

void ReadTextImages(const std::string& folder) {
  ColmapModel model;
  ReadImagesText(folder + "/images.txt", &model, {});
}

template <bool kBinary>
void ReadPoints(const std::string& folder) {
  for (const std::uint64_t decimate_to : {0, 2}) {
    ColmapReadOptions options;
    options.decimate_to = decimate_to;
    ColmapModel model;
    if (kBinary) {
      ReadPointsBinary(folder + "/points3D.bin", options, &model, {});
    } else {
      ReadPointsText(folder + "/points3D.txt", options, &model, {});
    }
  }
}

template <bool kBinary>
void ReadRigs(const std::string& folder) {
  ColmapModel model;
  for (const test::TestImage& image : test::SmallModel().images) {
    model.images.push_back({image.image_id, image.camera_id, image.pose, image.name});
  }
  ReadFrames(folder, kBinary, &model);
}

void ReadVis(const std::string& folder) {
  const std::string path = folder + "/fused.ply.vis";
  const std::string bytes = ReadAll(path);
  std::uint64_t count = 0;
  std::memcpy(&count, bytes.data(), std::min<std::size_t>(8, bytes.size()));
  VisibilityReader reader(path, count);
  std::vector<std::uint32_t> photos;
  for (std::uint64_t i = 0; i < count; ++i) i % 5 == 4 ? reader.Skip() : reader.Read(&photos);
  reader.ExpectEnd();
}

void ReadThesis(const std::string& path) { SceneOfThesis(ReadThesisFile(path), path); }

std::vector<FileKind> MakeKinds() {
  const test::TestModel m = test::SmallModel();
  const auto cameras_bin = [](const std::string& f) {
    ReadPart<&ReadCamerasBinary>(f + "/cameras.bin");
  };
  const auto cameras_txt = [](const std::string& f) {
    ReadPart<&ReadCamerasText>(f + "/cameras.txt");
  };
  std::vector<FileKind> kinds{
      {"sparse_bin", "cameras.bin", cameras_bin, {}, {test::CamerasBin(m)}},
      {"sparse_bin", "images.bin", &ReadBinaryImages, {}, {test::ImagesBin(m)}},
      {"sparse_bin", "points3D.bin", &ReadPoints<true>, {}, {test::PointsBin(m)}},
      {"sparse_bin", "rigs.bin", &ReadRigs<true>, {{"frames.bin", FramesBin()}}, {RigsBin()}},
      {"sparse_bin", "frames.bin", &ReadRigs<true>, {{"rigs.bin", RigsBin()}}, {FramesBin()}},
      {"sparse_txt", "cameras.txt", cameras_txt, {}, {test::CamerasTxt(m)}},
      {"sparse_txt", "images.txt", &ReadTextImages, {}, {test::ImagesTxt(m)}},
      {"sparse_txt", "points3D.txt", &ReadPoints<false>, {}, {test::PointsTxt(m)}},
      {"sparse_txt", "rigs.txt", &ReadRigs<false>, {{"frames.txt", kFramesTxt}}, {kRigsTxt}},
      {"sparse_txt", "frames.txt", &ReadRigs<false>, {{"rigs.txt", kRigsTxt}}, {kFramesTxt}},
      {"ply",
       "a.ply",
       [](const std::string& f) { ReadPly(f + "/a.ply"); },
       {},
       {kAsciiPly, BinaryPly(false), BinaryPly(true)}},
      {"vis", "fused.ply.vis", &ReadVis, {}, {VisBytes()}},
      {"depth_map",
       "depth.bin",
       [](const std::string& f) { ReadFloatMap(f + "/depth.bin", 1); },
       {},
       {MapBytes(1)}},
      {"depth_map",
       "normal.bin",
       [](const std::string& f) { ReadFloatMap(f + "/normal.bin", 3); },
       {},
       {MapBytes(3)}},
      {"metaball_file",
       "a.metaballs",
       [](const std::string& f) { ReadMetaballFile(f + "/a.metaballs"); },
       {},
       MetaballSeeds()},
      {"thesis_file",
       "a.mbt",
       [](const std::string& f) { ReadThesis(f + "/a.mbt"); },
       {},
       ThesisSeeds(kThesisTextExtension)},
      {"thesis_file",
       "a.mbb",
       [](const std::string& f) { ReadThesis(f + "/a.mbb"); },
       {},
       ThesisSeeds(kThesisBinaryExtension)},
      {"project_file",
       "p.sherd",
       [](const std::string& f) { Project::Open(f + "/p.sherd"); },
       {},
       {kProject}},
  };
  const auto checked = [&](const char* name, void (*read)(const std::string&), auto write) {
    const std::string seed = WithoutSum(Written(name, write));
    kinds.push_back({"project_file", name, read, {}, {seed}, &WithSum});
  };
  checked(
      "survey.bin", [](const std::string& f) { ReadSurveyFile(f + "/survey.bin"); },
      [](const std::string& p) { WriteSurveyFile(p, SmallSurvey()); });
  checked(
      "outline.bin", [](const std::string& f) { ReadOutlineFile(f + "/outline.bin"); },
      [](const std::string& p) {
        WriteOutlineFile(p, {{1, 2, 3}, {4, 5, 6}});
      });
  checked(
      "attributes.bin",
      [](const std::string& f) {
        static const Cloud cloud = BuildCloud(SmallCloud());
        Level level;
        level.cloud = cloud;
        ReadLevelAttributes(f + "/attributes.bin", 2, &level);
      },
      [](const std::string& p) { WriteLevelAttributes(p, SmallLevel()); });
  return kinds;
}

}  // namespace

const std::vector<FileKind>& FileKinds() {
  static const std::vector<FileKind> kinds = MakeKinds();
  return kinds;
}

ScratchFolder::ScratchFolder() {
  std::error_code error;
  const fs::path in_memory = "/dev/shm";
  const fs::path base =
      ::access(in_memory.c_str(), W_OK) == 0 ? in_memory : fs::temp_directory_path();
  static int count = 0;
  path_ = (base / ("sherd_fuzz_" + std::to_string(::getpid()) + "_" + std::to_string(count++)))
              .string();
  fs::remove_all(path_, error);
  fs::create_directories(path_);
}

ScratchFolder::~ScratchFolder() {
  std::error_code error;
  fs::remove_all(path_, error);
}

std::string ScratchFolder::For(const FileKind& kind) const {
  const std::string folder = path_ + "/" + kind.group + "_" + kind.name;
  if (!fs::exists(folder)) {
    fs::create_directories(folder);
    for (const auto& [name, bytes] : kind.companions) WriteBytes(folder + "/" + name, bytes);
  }
  return folder;
}

void WriteBytes(const std::string& path, const std::string& bytes) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file.flush()) throw OutputError(path, "could not be written");
}

}  // namespace sherd::fuzz
