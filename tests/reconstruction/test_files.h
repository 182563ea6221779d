// Small COLMAP workspaces for the tests, written byte by byte from the format's description.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "metaball/color.h"
#include "metaball/vec.h"
#include "reconstruction/camera_model.h"
#include "reconstruction/survey.h"

namespace sherd::test {

namespace fs = std::filesystem;

// A folder of the running test's own, emptied first.
inline std::string TestFolder() {
  const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
  std::string name =
      std::string("sherd_reconstruction_") + info->test_suite_name() + "_" + info->name();
  for (char& c : name) {
    if (c == '/') c = '_';
  }
  const fs::path path = fs::path(::testing::TempDir()) / name;
  fs::remove_all(path);
  fs::create_directories(path);
  return path.string();
}

inline void WriteFile(const std::string& path, const std::string& bytes) {
  fs::create_directories(fs::path(path).parent_path());
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  ASSERT_TRUE(file.good()) << path;
}

inline std::string ReadFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  return bytes.str();
}

class Bytes {
 public:
  template <class T>
  Bytes& Add(T value) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    bytes_.append(raw, sizeof(T));
    return *this;
  }
  Bytes& AddName(const std::string& name) {
    bytes_ += name;
    bytes_.push_back('\0');
    return *this;
  }
  const std::string& str() const { return bytes_; }

 private:
  std::string bytes_;
};

struct TestImage {
  std::uint32_t image_id, camera_id;
  Rigid3d pose;
  std::string name;
  int observations = 0;
};

struct TestPoint {
  std::uint64_t id;
  Vec3d position;
  Rgb8 color;
  double error;
  std::vector<std::uint32_t> images;
};

struct TestModel {
  std::vector<SurveyCamera> cameras;
  std::vector<TestImage> images;
  std::vector<TestPoint> points;
};

inline std::string Number(double v) {
  char text[40];
  std::snprintf(text, sizeof(text), "%.17g", v);
  return text;
}

inline std::string CamerasBin(const TestModel& m) {
  Bytes b;
  b.Add<std::uint64_t>(m.cameras.size());
  for (const SurveyCamera& c : m.cameras) {
    b.Add(c.camera_id).Add<std::int32_t>(static_cast<int>(c.model)).Add(c.width).Add(c.height);
    for (const double p : c.parameters) b.Add(p);
  }
  return b.str();
}

inline std::string ImagesBin(const TestModel& m) {
  Bytes b;
  b.Add<std::uint64_t>(m.images.size());
  for (const TestImage& i : m.images) {
    const Rigid3d& p = i.pose;
    b.Add(i.image_id).Add(p.qw).Add(p.qx).Add(p.qy).Add(p.qz);
    b.Add(p.translation.x).Add(p.translation.y).Add(p.translation.z);
    b.Add(i.camera_id).AddName(i.name).Add<std::uint64_t>(i.observations);
    for (int k = 0; k < i.observations; ++k) {
      b.Add(10.5 + k).Add(20.25).Add<std::uint64_t>(k % 2 ? UINT64_MAX : 7);
    }
  }
  return b.str();
}

inline std::string PointsBin(const TestModel& m) {
  Bytes b;
  b.Add<std::uint64_t>(m.points.size());
  for (const TestPoint& p : m.points) {
    b.Add(p.id).Add(p.position.x).Add(p.position.y).Add(p.position.z);
    b.Add(p.color.r).Add(p.color.g).Add(p.color.b).Add(p.error);
    b.Add<std::uint64_t>(p.images.size());
    for (const std::uint32_t i : p.images) b.Add(i).Add<std::uint32_t>(0);
  }
  return b.str();
}

inline std::string CamerasTxt(const TestModel& m) {
  std::string t = "# Camera list with one line of data per camera:\n";
  for (const SurveyCamera& c : m.cameras) {
    t += std::to_string(c.camera_id) + " " +
         std::string(CameraModelName(static_cast<int>(c.model))) + " " + std::to_string(c.width) +
         " " + std::to_string(c.height);
    for (const double p : c.parameters) t += " " + Number(p);
    t += "\n";
  }
  return t;
}

inline std::string ImagesTxt(const TestModel& m) {
  std::string t = "# Image list with two lines of data per image:\n";
  for (const TestImage& i : m.images) {
    const Rigid3d& p = i.pose;
    t += std::to_string(i.image_id);
    for (const double v :
         {p.qw, p.qx, p.qy, p.qz, p.translation.x, p.translation.y, p.translation.z}) {
      t += " " + Number(v);
    }
    t += " " + std::to_string(i.camera_id) + " " + i.name + "\n";
    for (int k = 0; k < i.observations; ++k) {
      t += (k ? " " : "") + Number(10.5 + k) + " 20.25 " + (k % 2 ? "-1" : "7");
    }
    t += "\n";
  }
  return t;
}

inline std::string PointsTxt(const TestModel& m) {
  std::string t = "# 3D point list with one line of data per point:\n";
  for (const TestPoint& p : m.points) {
    t += std::to_string(p.id) + " " + Number(p.position.x) + " " + Number(p.position.y) + " " +
         Number(p.position.z) + " " + std::to_string(p.color.r) + " " + std::to_string(p.color.g) +
         " " + std::to_string(p.color.b) + " " + Number(p.error);
    for (const std::uint32_t i : p.images) t += " " + std::to_string(i) + " 0";
    t += "\n";
  }
  return t;
}

inline void WriteBinary(const std::string& folder, const TestModel& m) {
  WriteFile(folder + "/cameras.bin", CamerasBin(m));
  WriteFile(folder + "/images.bin", ImagesBin(m));
  WriteFile(folder + "/points3D.bin", PointsBin(m));
}

inline void WriteText(const std::string& folder, const TestModel& m) {
  WriteFile(folder + "/cameras.txt", CamerasTxt(m));
  WriteFile(folder + "/images.txt", ImagesTxt(m));
  WriteFile(folder + "/points3D.txt", PointsTxt(m));
}

// A camera at `center` that looks along +z, turned by `angle` about y.
inline Rigid3d PoseAt(const Vec3d& center, double angle = 0) {
  Rigid3d pose;
  pose.qw = std::cos(angle / 2);
  pose.qy = std::sin(angle / 2);
  pose.translation = -pose.Rotate(center);
  return pose;
}

// Three cameras of a row in front of points on the plane z = 4; ids with gaps and at the ends of
// their types.
inline TestModel SmallModel() {
  TestModel m;
  m.cameras.push_back({7, CameraModelId::kPinhole, 640, 480, {500, 510, 320, 240}});
  m.cameras.push_back({4294967294u,
                       CameraModelId::kOpenCv,
                       800,
                       600,
                       {600, 601, 400, 300, 0.01, 0.02, 1e-3, 2e-3}});
  m.images.push_back({30, 7, PoseAt({-1, 0, 0}), "left one.jpg", 3});
  m.images.push_back({4294967294u, 4294967294u, PoseAt({0, 0, 0}, 0.1), "sub/middle.png", 0});
  m.images.push_back({2, 7, PoseAt({1, 0, 0}), "right.jpg", 2});
  for (int i = 0; i < 12; ++i) {
    TestPoint p;
    p.id = i == 11 ? 18446744073709551614ull : (1ull << 53) + 1 + static_cast<std::uint64_t>(i);
    p.position = {-0.3 + 0.05 * i, 0.1 * (i % 3) - 0.1, 4.0 + 1e-9 * i};
    p.color = {static_cast<std::uint8_t>(20 * i), 100, static_cast<std::uint8_t>(255 - i)};
    p.error = i == 3 ? -1.0 : 0.5 + 0.25 * i;
    if (i != 4) p.images = {30, 2};
    if (i % 2) p.images.push_back(4294967294u);
    m.points.push_back(p);
  }
  return m;
}

}  // namespace sherd::test
