// What WriteExcavation writes, read back by a reader of its own and held against the truth.
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "datasets_synthetic/excavation.h"
#include "datasets_synthetic/random.h"
#include "metaball/error.h"
#include "tests/datasets_synthetic/colmap_reader.h"

namespace sherd {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kKeypointNoise = 0.4;

ExcavationOptions Options() {
  ExcavationOptions o;
  o.seed = 2;
  o.photographs = 7;
  o.photo_width = 360;
  o.photo_height = 240;
  o.dense_points = 20000;
  o.noise_m = 0;
  o.outlier_share = 0;
  o.sparse_points = 1500;
  o.keypoint_noise_px = kKeypointNoise;
  o.depth_map_max_side = 200;
  return o;
}

struct Bitmap {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
  double Green(double x, double y) const {  // bilinear, image coordinates
    const double fx = x - 0.5, fy = y - 0.5;
    const int ix = static_cast<int>(std::floor(fx)), iy = static_cast<int>(std::floor(fy));
    double sum = 0;
    for (int j = 0; j < 2; ++j) {
      for (int i = 0; i < 2; ++i) {
        const int px = std::clamp(ix + i, 0, width - 1), py = std::clamp(iy + j, 0, height - 1);
        sum += (i ? fx - ix : 1 - fx + ix) * (j ? fy - iy : 1 - fy + iy) *
               rgb[static_cast<std::size_t>(3 * (py * width + px) + 1)];
      }
    }
    return sum;
  }
};

class Workspace : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = testing::TempDir() + "sherd_excavation_workspace";
    fs::remove_all(folder_);
    WriteExcavation(folder_, Options());
    excavation_ = new Excavation(Options().seed);
  }
  static void TearDownTestSuite() {
    delete excavation_;
    fs::remove_all(folder_);
  }

  static Bitmap ReadPhoto(const std::string& path) {
    Bitmap b;
    auto file = OIIO::ImageInput::open(path);
    if (!file) throw std::runtime_error("cannot open " + path);
    b.width = file->spec().width;
    b.height = file->spec().height;
    b.rgb.resize(static_cast<std::size_t>(3 * b.width * b.height));
    file->read_image(0, 0, 0, 3, OIIO::TypeDesc::UINT8, b.rgb.data());
    return b;
  }
  // Whether the camera sees the point: the first thing on the way to it is itself.
  static bool Sees(const test::Image& image, const double* xyz) {
    double c[3];
    test::Center(image, c);
    const Vec3d eye{c[0], c[1], c[2]}, p{xyz[0], xyz[1], xyz[2]};
    TruthHit hit;
    return excavation_->Intersect({eye, Normalized(p - eye)}, &hit) &&
           std::abs(hit.distance - Length(p - eye)) < 1e-3;
  }

  static std::string folder_;
  static Excavation* excavation_;
};
std::string Workspace::folder_;
Excavation* Workspace::excavation_ = nullptr;

TEST_F(Workspace, BinaryAndTextHoldTheSame) {
  const test::Model binary = test::ReadBinary(folder_ + "/sparse/0");
  const test::Model text = test::ReadText(folder_ + "/sparse_txt/0");
  EXPECT_EQ(binary.cameras, text.cameras);
  EXPECT_EQ(binary.images, text.images);
  EXPECT_EQ(binary.points, text.points);
  EXPECT_EQ(binary.cameras.size(), 2u);
  EXPECT_EQ(binary.images.size(), 7u);
  EXPECT_EQ(binary.points.size(), 1500u);
  EXPECT_TRUE(fs::exists(folder_ + "/sparse/0/project.ini"));
}

TEST_F(Workspace, PointsLieOnTheSurfaceAndReproject) {
  const test::Model m = test::ReadBinary(folder_ + "/sparse/0");
  std::map<std::uint32_t, const test::Image*> by_id;
  for (const test::Image& i : m.images) by_id[i.id] = &i;
  double squares = 0;
  int observations = 0;
  std::uint64_t last_id = 0;
  bool gaps = false;
  for (const test::Point& p : m.points) {
    EXPECT_LT(excavation_->SurfaceDistance({p.xyz[0], p.xyz[1], p.xyz[2]}), 1e-6);
    gaps |= p.id > last_id + 1;
    EXPECT_GT(p.id, last_id);
    last_id = p.id;
    EXPECT_GE(p.track.size(), 3u);
    std::set<std::uint32_t> images;
    double error = 0;
    for (const auto& [image_id, idx] : p.track) {
      images.insert(image_id);
      const test::Image& image = *by_id.at(image_id);
      const test::Keypoint& k = image.keypoints.at(idx);
      EXPECT_EQ(static_cast<std::uint64_t>(k.point), p.id);
      double x, y, depth;
      ASSERT_TRUE(test::Project(m, image, p.xyz, &x, &y, &depth));
      const double d = std::hypot(x - k.x, y - k.y);
      EXPECT_LT(d, 7 * kKeypointNoise);
      error += d;
      squares += d * d;
      ++observations;
      EXPECT_TRUE(Sees(image, p.xyz));
    }
    EXPECT_EQ(images.size(), p.track.size()) << "one photograph twice in a track";
    EXPECT_NEAR(p.error, error / static_cast<double>(p.track.size()), 1e-9);
  }
  EXPECT_TRUE(gaps);
  // Two axes of Gaussian noise.
  EXPECT_NEAR(std::sqrt(squares / observations), kKeypointNoise * std::sqrt(2.0), 0.02);
  // Every keypoint that names a point stands in its track; some name none.
  std::size_t matched = 0, all = 0;
  for (const test::Image& i : m.images) {
    all += i.keypoints.size();
    for (const test::Keypoint& k : i.keypoints) matched += k.point >= 0;
  }
  EXPECT_EQ(matched, static_cast<std::size_t>(observations));
  EXPECT_GT(all, matched * 5 / 4);
}

TEST_F(Workspace, IdsAreNamesNotPositions) {
  const test::Model sparse = test::ReadBinary(folder_ + "/sparse/0");
  const test::Model dense = test::ReadBinary(folder_ + "/dense/sparse");
  bool names_sorted = true, ids_sorted = true, contiguous = true;
  for (std::size_t i = 1; i < sparse.images.size(); ++i) {
    names_sorted &= sparse.images[i - 1].name < sparse.images[i].name;
    ids_sorted &= dense.images[i - 1].id < dense.images[i].id;
    contiguous &= sparse.images[i - 1].id + 1 == sparse.images[i].id;
  }
  EXPECT_FALSE(names_sorted);
  EXPECT_FALSE(ids_sorted);
  EXPECT_FALSE(contiguous);
}

TEST_F(Workspace, PhotographsShowWhatTheModelSays) {
  // The photographs' pixels, found through the distorted model, have the points' own colours; the
  // undistorted ones through the pinhole model.
  for (const std::string part : {"", "/dense"}) {
    const test::Model m =
        test::ReadBinary(folder_ + (part.empty() ? "/sparse/0" : "/dense/sparse"));
    double same = 0, shifted = 0;
    int count = 0;
    for (const test::Image& image : m.images) {
      const Bitmap photo = ReadPhoto(folder_ + part + "/images/" + image.name);
      for (const test::Camera& c : m.cameras) {
        if (c.id != image.camera_id) continue;
        EXPECT_EQ(photo.width, static_cast<int>(c.width));
        EXPECT_EQ(photo.height, static_cast<int>(c.height));
        EXPECT_EQ(c.model, part.empty() ? 4 : 1);
      }
      std::map<std::int64_t, const test::Point*> by_id;
      for (const test::Point& p : m.points) by_id[static_cast<std::int64_t>(p.id)] = &p;
      for (const test::Keypoint& k : image.keypoints) {
        if (k.point < 0) continue;
        const test::Point& p = *by_id.at(k.point);
        double x, y, depth;
        ASSERT_TRUE(test::Project(m, image, p.xyz, &x, &y, &depth));
        EXPECT_LT(std::hypot(x - k.x, y - k.y), 7 * kKeypointNoise);
        same += std::abs(photo.Green(x, y) - p.rgb[1]);
        shifted += std::abs(photo.Green(x + 6, y - 4) - p.rgb[1]);
        ++count;
      }
    }
    EXPECT_LT(same / count, 10.0) << part;
    EXPECT_GT(shifted / count, 1.6 * same / count) << part;
  }
}

TEST_F(Workspace, PhotographsCarryTheFocalLength) {
  const auto file = OIIO::ImageInput::open(folder_ + "/images/ring_01.jpg");
  ASSERT_TRUE(file);
  EXPECT_EQ(std::string(file->format_name()), "jpeg");
  EXPECT_FLOAT_EQ(file->spec().get_float_attribute("Exif:FocalLength"), 26.0f);
  EXPECT_EQ(file->spec().get_int_attribute("Exif:FocalLengthIn35mmFilm"), 26);
  EXPECT_EQ(file->spec().get_int_attribute("Orientation", 1), 1);
}

TEST_F(Workspace, DepthAndNormalMapsAreTheTruth) {
  const test::Model m = test::ReadBinary(folder_ + "/dense/sparse");
  std::ifstream fusion(folder_ + "/dense/stereo/fusion.cfg");
  std::ifstream patch_match(folder_ + "/dense/stereo/patch-match.cfg");
  std::set<std::string> names;
  for (std::string line; std::getline(fusion, line);) {
    names.insert(line);
    std::string name, sources;
    std::getline(patch_match, name);
    std::getline(patch_match, sources);
    EXPECT_EQ(name, line);
    EXPECT_EQ(sources, "__auto__, 20");
  }
  EXPECT_EQ(names.size(), m.images.size());
  synthetic::Rng rng(3);
  int hits = 0;
  for (const test::Image& image : m.images) {
    EXPECT_TRUE(names.contains(image.name));
    const std::string stereo = folder_ + "/dense/stereo/";
    const test::Map depth = test::ReadMap(stereo + "depth_maps/" + image.name + ".geometric.bin");
    const test::Map normal = test::ReadMap(stereo + "normal_maps/" + image.name + ".geometric.bin");
    ASSERT_EQ(depth.channels, 1);
    ASSERT_EQ(normal.channels, 3);
    ASSERT_EQ(normal.width, depth.width);
    EXPECT_EQ(std::max(depth.width, depth.height), 200);
    const test::Camera* camera = nullptr;
    for (const test::Camera& c : m.cameras) camera = c.id == image.camera_id ? &c : camera;
    // Rows of the rotation, from the quaternion's images of the axes.
    double center[3];
    test::Center(image, center);
    const Vec3d eye{center[0], center[1], center[2]};
    const auto axis = [&](int i) {
      Vec3d a;
      double* out[3] = {&a.x, &a.y, &a.z};
      for (int j = 0; j < 3; ++j) {
        test::Image moved = image;
        moved.t[0] = moved.t[1] = moved.t[2] = 0;
        moved.t[i] = -1;  // its centre is then row i of the rotation
        double row[3];
        test::Center(moved, row);
        *out[j] = row[j];
      }
      return a;
    };
    const Vec3d right = axis(0), down = axis(1), forward = axis(2);
    const double sx = depth.width / static_cast<double>(camera->width);
    const double sy = depth.height / static_cast<double>(camera->height);
    for (int i = 0; i < 300; ++i) {
      const int x = rng.Index(depth.width), y = rng.Index(depth.height);
      const double u = (x + 0.5 - camera->params[2] * sx) / (camera->params[0] * sx);
      const double v = (y + 0.5 - camera->params[3] * sy) / (camera->params[1] * sy);
      const Vec3d direction = Normalized(forward + right * u + down * v);
      TruthHit hit;
      if (!excavation_->Intersect({eye, direction}, &hit)) {
        EXPECT_EQ(depth.At(0, y, x), 0);
        continue;
      }
      ++hits;
      const double z = hit.distance * Dot(direction, forward);
      // The world's digits differ in the last place between the two ways: a ray on an edge may
      // slip to the other side.
      if (std::abs(depth.At(0, y, x) - z) > 1e-5 * z) {
        EXPECT_LT(excavation_->SurfaceDistance(
                      eye + direction * (depth.At(0, y, x) / Dot(direction, forward))),
                  1e-5);
        continue;
      }
      const Vec3d n{normal.At(0, y, x), normal.At(1, y, x), normal.At(2, y, x)};
      EXPECT_NEAR(Length(n), 1, 1e-5);
      EXPECT_LT(n.x * u + n.y * v + n.z, 1e-6);
      EXPECT_GT(Dot(right * n.x + down * n.y + forward * n.z, hit.normal), 1 - 1e-5);
    }
  }
  EXPECT_GT(hits, 1500);
}

TEST_F(Workspace, DenseCloudIsOnTheSurfaceAndSeen) {
  const test::Model m = test::ReadBinary(folder_ + "/dense/sparse");
  const std::vector<test::Fused> points = test::ReadFused(folder_ + "/dense/fused.ply");
  ASSERT_EQ(points.size(), 20000u);
  int seen = 0, sightings = 0, elsewhere = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const test::Fused& p = points[i];
    const double xyz[3] = {p.xyz[0], p.xyz[1], p.xyz[2]};
    // Single precision at 3 m: 2e-7 on each axis.
    EXPECT_LT(excavation_->SurfaceDistance({xyz[0], xyz[1], xyz[2]}), 5e-7);
    EXPECT_GE(p.image_idx.size(), 3u);
    if (i % 20 != 0) continue;
    for (const std::uint32_t idx : p.image_idx) {
      const test::Image& image = m.images.at(idx);
      double x, y, depth;
      ASSERT_TRUE(test::Project(m, image, xyz, &x, &y, &depth));
      for (const test::Camera& c : m.cameras) {
        if (c.id != image.camera_id) continue;
        EXPECT_TRUE(x > 0 && y > 0 && x < static_cast<double>(c.width) &&
                    y < static_cast<double>(c.height));
      }
      seen += Sees(image, xyz);
      ++sightings;
      // An index taken for an image id, or for a place in sparse/0, would be found out.
      elsewhere += Sees(m.images[(idx + 3) % m.images.size()], xyz);
    }
  }
  EXPECT_EQ(seen, sightings);
  EXPECT_LT(elsewhere, sightings * 95 / 100);
}

TEST_F(Workspace, TruthFilesSayTheSame) {
  const test::Model m = test::ReadBinary(folder_ + "/sparse/0");
  const json poses = json::parse(test::ReadAll(folder_ + "/truth/poses.json"));
  ASSERT_EQ(poses["photographs"].size(), m.images.size());
  for (const json& p : poses["photographs"]) {
    bool found = false;
    for (const test::Image& i : m.images) {
      if (i.name != p["name"]) continue;
      found = true;
      EXPECT_EQ(i.id, p["image_id"]);
      double center[3];
      test::Center(i, center);
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(i.t[k], p["t"][k]);
        EXPECT_NEAR(center[k], p["center"][k].get<double>(), 1e-12);
      }
      for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(i.q[k], p["q"][k]);
    }
    EXPECT_TRUE(found) << p["name"];
  }
  const json board = json::parse(test::ReadAll(folder_ + "/truth/board.json"));
  ASSERT_EQ(board["rows"].size(), excavation_->board_rows().size());
  for (std::size_t i = 0; i < board["rows"].size(); ++i) {
    EXPECT_EQ(board["rows"][i]["text"], excavation_->board_rows()[i].text);
  }
  const json scene = json::parse(test::ReadAll(folder_ + "/truth/scene.json"));
  EXPECT_EQ(scene["units"], "metres");
  EXPECT_EQ(scene["seed"], 2);
}

TEST_F(Workspace, ColmapAcceptsIt) {
  if (!test::HaveColmap()) GTEST_SKIP() << "colmap is not installed";
  const std::string quiet = " > " + folder_ + "/colmap.log 2>&1";
  for (const std::string model : {"sparse/0", "sparse_txt/0", "dense/sparse"}) {
    const std::string path = folder_ + "/" + model;
    ASSERT_EQ(std::system(("colmap model_analyzer --path " + path + quiet).c_str()), 0) << model;
    const std::string log = test::ReadAll(folder_ + "/colmap.log");
    EXPECT_NE(log.find("Registered images: 7"), std::string::npos) << log;
    EXPECT_NE(log.find("Points: 1500"), std::string::npos) << log;
    for (const std::string type : {"BIN", "TXT", "PLY"}) {
      std::string out = folder_ + "/converted_" + type;
      fs::remove_all(out);
      fs::create_directories(out);
      if (type == "PLY") out += "/points.ply";
      ASSERT_EQ(std::system(("colmap model_converter --input_path " + path + " --output_path " +
                             out + " --output_type " + type + quiet)
                                .c_str()),
                0)
          << model << test::ReadAll(folder_ + "/colmap.log");
      if (type != "BIN") continue;
      // COLMAP keeps every point and observation.
      test::Model kept = test::ReadBinary(out),
                  ours = model == "sparse_txt/0" ? test::ReadText(path) : test::ReadBinary(path);
      const auto by_id = [](const auto& a, const auto& b) { return a.id < b.id; };
      std::sort(kept.points.begin(), kept.points.end(), by_id);
      std::sort(kept.images.begin(), kept.images.end(), by_id);
      std::sort(ours.images.begin(), ours.images.end(), by_id);
      ASSERT_EQ(kept.points.size(), ours.points.size());
      for (std::size_t i = 0; i < kept.points.size(); ++i) {
        EXPECT_EQ(kept.points[i].id, ours.points[i].id);
        EXPECT_EQ(kept.points[i].track, ours.points[i].track);
      }
      ASSERT_EQ(kept.images.size(), ours.images.size());
      for (std::size_t i = 0; i < kept.images.size(); ++i) {
        EXPECT_EQ(kept.images[i].name, ours.images[i].name);
        EXPECT_EQ(kept.images[i].keypoints, ours.images[i].keypoints);
      }
    }
  }
}

TEST_F(Workspace, ColmapUndistortsToTheSameCameras) {
  if (!test::HaveColmap()) GTEST_SKIP() << "colmap is not installed";
  const std::string out = folder_ + "/undistorted";
  ASSERT_EQ(std::system(("colmap image_undistorter --image_path " + folder_ +
                         "/images --input_path " + folder_ + "/sparse/0 --output_path " + out +
                         " > " + folder_ + "/colmap.log 2>&1")
                            .c_str()),
            0)
      << test::ReadAll(folder_ + "/colmap.log");
  const test::Model theirs = test::ReadBinary(out + "/sparse");
  const test::Model ours = test::ReadBinary(folder_ + "/dense/sparse");
  ASSERT_EQ(theirs.cameras.size(), ours.cameras.size());
  for (const test::Camera& a : ours.cameras) {
    for (const test::Camera& b : theirs.cameras) {
      if (a.id != b.id) continue;
      EXPECT_EQ(a.model, b.model);
      EXPECT_EQ(a.width, b.width);
      EXPECT_EQ(a.height, b.height);
      for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(a.params[i], b.params[i], 1e-6);
    }
  }
  // And the pictures agree but for interpolation and JPEG.
  for (const std::string name : {"ring_02.jpg", "overhead_01.jpg"}) {
    const Bitmap a = ReadPhoto(folder_ + "/dense/images/" + name);
    const Bitmap b = ReadPhoto(out + "/images/" + name);
    ASSERT_EQ(a.rgb.size(), b.rgb.size());
    double difference = 0;
    for (std::size_t i = 0; i < a.rgb.size(); ++i) difference += std::abs(a.rgb[i] - b.rgb[i]);
    EXPECT_LT(difference / static_cast<double>(a.rgb.size()), 6.0) << name;
  }
}

}  // namespace
}  // namespace sherd
