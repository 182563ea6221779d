#include "tests/app/test_workspace.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>
#include <system_error>
#include <vector>

#include "app/project/picture.h"
#include "metaball/color.h"

namespace sherd::testing {
namespace {

namespace fs = std::filesystem;

constexpr double kFocal = 150.0;

// The rotation whose rows are the camera's axes, as a quaternion (w, x, y, z). Shepperd's method.
Rigid3d PoseOf(const Camera& c) {
  const double m[3][3] = {{c.right.x, c.right.y, c.right.z},
                          {c.down.x, c.down.y, c.down.z},
                          {c.forward.x, c.forward.y, c.forward.z}};
  double q[4] = {1 + m[0][0] + m[1][1] + m[2][2], 1 + m[0][0] - m[1][1] - m[2][2],
                 1 - m[0][0] + m[1][1] - m[2][2], 1 - m[0][0] - m[1][1] + m[2][2]};
  for (double& v : q) v = 0.5 * std::sqrt(std::max(0.0, v));
  // Signs relative to the largest component.
  const auto k = std::max_element(q, q + 4) - q;
  const double wx = m[2][1] - m[1][2], wy = m[0][2] - m[2][0], wz = m[1][0] - m[0][1];
  const double xy = m[0][1] + m[1][0], xz = m[0][2] + m[2][0], yz = m[1][2] + m[2][1];
  const double sign[4][4] = {{1, wx, wy, wz}, {wx, 1, xy, xz}, {wy, xy, 1, yz}, {wz, xz, yz, 1}};
  for (int i = 0; i < 4; ++i) q[i] = std::copysign(q[i], i == k ? 1.0 : sign[k][i]);
  Rigid3d pose{q[0], q[1], q[2], q[3], {}};
  pose.translation = -Vec3d{Dot(c.right, c.eye), Dot(c.down, c.eye), Dot(c.forward, c.eye)};
  return pose;
}

double Height(const Vec3d& p) { return 0.1 * std::sin(4 * p.x) * std::cos(3 * p.y); }

void WriteImages(const std::string& folder) {
  const std::vector<Photograph> photographs = WavyPhotographs();
  fs::create_directories(fs::path(folder) / "images" / "late");
  for (int i = 0; i < 4; ++i) {
    const Camera camera = WavyCamera(i);
    Frame frame;
    frame.width = kPhotoWidth;
    frame.height = kPhotoHeight;
    for (int y = 0; y < kPhotoHeight; ++y) {
      for (int x = 0; x < kPhotoWidth; ++x) {
        const RayD ray = RayThrough(camera, x + 0.5, y + 0.5);
        double t = 1;
        while (t < 6 &&
               (ray.origin + ray.direction * t).z > Height(ray.origin + ray.direction * t)) {
          t += 0.005;
        }
        const Vec3f c = LinearFromRgb8(WavyColor(ray.origin + ray.direction * t));
        frame.color.push_back({c.x, c.y, c.z, 1});
      }
    }
    WritePicture(
        (fs::path(folder) / "images" / photographs[static_cast<std::size_t>(i)].name).string(),
        frame, {});
  }
}

}  // namespace

std::string FreshFolder(const std::string& name) {
  std::string folder = name;
  if (const auto* info = ::testing::UnitTest::GetInstance()->current_test_info()) {
    folder = std::string(info->test_suite_name()) + "_" + info->name() + "_" + name;
  }
  // Parametrized tests have slashes in their names.
  std::replace(folder.begin(), folder.end(), '/', '_');
  // ctest runs tests side by side, each in a process of its own.
  folder = ::testing::TempDir() + "sherd_app_" + std::to_string(getpid()) + "_" + folder;
  fs::remove_all(folder);
  fs::create_directories(folder);
  // Removed when the process ends, not when the test does: a suite's set-up makes folders too.
  static struct Folders {
    std::vector<std::string> made;
    ~Folders() {
      std::error_code error;
      for (const std::string& path : made) fs::remove_all(path, error);
    }
  } folders;
  folders.made.push_back(folder);
  return folder;
}

void WriteText(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

std::string ReadText(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<std::string> Listing(const std::string& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::vector<Vec3d> WavyPoints(int n) {
  const int side = std::max(2, static_cast<int>(std::sqrt(n)));
  std::vector<Vec3d> points;
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      const double x = -1 + 2 * (i + 0.5) / side, y = -1 + 2 * (j + 0.5) / side;
      points.push_back({x, y, Height({x, y, 0})});
    }
  }
  return points;
}

Rgb8 WavyColor(const Vec3d& p) {
  const bool odd =
      (static_cast<int>(std::floor(p.x * 4)) + static_cast<int>(std::floor(p.y * 4))) & 1;
  return odd ? Rgb8{190, 120, 70} : Rgb8{90, 110, 130};
}

Camera WavyCamera(int photograph) {
  const Vec3d eyes[] = {{0.3, -2.4, 2.1}, {2.2, 0.4, 2.3}, {-0.2, 2.3, 2.2}, {-2.3, -0.3, 2.0}};
  return Camera::LookAt(eyes[photograph], {0, 0, 0}, {0, 0, 1},
                        2 * std::atan(0.5 * kPhotoWidth / kFocal), kPhotoWidth, kPhotoHeight);
}

std::vector<Photograph> WavyPhotographs() {
  std::vector<Photograph> photographs;
  for (int i = 0; i < 4; ++i) {
    Photograph photograph;
    photograph.image_id = static_cast<std::uint32_t>(i + 1);
    photograph.name =
        std::string(i == 3 ? "late/" : "") + "photo_" + std::to_string(i + 1) + ".png";
    photograph.cam_from_world = PoseOf(WavyCamera(i));
    photographs.push_back(photograph);
  }
  return photographs;
}

void WriteWorkspace(const std::string& folder, int points, bool with_images, double hole) {
  const fs::path model = fs::path(folder) / "sparse" / "0";
  fs::create_directories(model);
  std::ostringstream cameras, images, points3d;
  cameras << "1 PINHOLE " << kPhotoWidth << ' ' << kPhotoHeight << ' ' << kFocal << ' ' << kFocal
          << ' ' << kPhotoWidth / 2 << ' ' << kPhotoHeight / 2 << '\n';
  std::vector<Vec3d> cloud = WavyPoints(points);
  std::erase_if(cloud, [&](const Vec3d& p) { return std::hypot(p.x, p.y) < hole; });
  images.precision(17);
  for (const Photograph& photograph : WavyPhotographs()) {
    const Rigid3d& pose = photograph.cam_from_world;
    images << photograph.image_id << ' ' << pose.qw << ' ' << pose.qx << ' ' << pose.qy << ' '
           << pose.qz << ' ' << pose.translation.x << ' ' << pose.translation.y << ' '
           << pose.translation.z << " 1 " << photograph.name << '\n';
    const Camera camera = WavyCamera(static_cast<int>(photograph.image_id) - 1);
    for (std::size_t k = 0; k < cloud.size(); ++k) {
      double x = 0, y = 0;
      camera.Project(cloud[k], &x, &y);
      images << (k ? " " : "") << x << ' ' << y << ' ' << k + 1;
    }
    images << '\n';
  }
  points3d.precision(17);
  for (std::size_t k = 0; k < cloud.size(); ++k) {
    const Rgb8 c = WavyColor(cloud[k]);
    points3d << k + 1 << ' ' << cloud[k].x << ' ' << cloud[k].y << ' ' << cloud[k].z << ' ' << +c.r
             << ' ' << +c.g << ' ' << +c.b << " 0.5";
    for (int i = 1; i <= 4; ++i) points3d << ' ' << i << ' ' << k;
    points3d << '\n';
  }
  WriteText((model / "cameras.txt").string(), cameras.str());
  WriteText((model / "images.txt").string(), images.str());
  WriteText((model / "points3D.txt").string(), points3d.str());
  if (with_images) WriteImages(folder);
}

void WritePly(const std::string& path, int points) {
  const std::vector<Vec3d> cloud = WavyPoints(points);
  const double radius = 5.0 / std::sqrt(static_cast<double>(cloud.size()));
  std::ostringstream text;
  text << "ply\nformat ascii 1.0\nelement vertex " << cloud.size()
       << "\nproperty double x\nproperty double y\nproperty double z\nproperty float radius\n"
          "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
  for (const Vec3d& p : cloud) {
    const Rgb8 c = WavyColor(p);
    text << p.x << ' ' << p.y << ' ' << p.z << ' ' << radius << ' ' << +c.r << ' ' << +c.g << ' '
         << +c.b << '\n';
  }
  WriteText(path, text.str());
}

Survey WavySurvey(int points) {
  Survey survey;
  SurveyCamera camera;
  camera.camera_id = 1;
  camera.model = CameraModelId::kPinhole;
  camera.width = kPhotoWidth;
  camera.height = kPhotoHeight;
  camera.parameters = {kFocal, kFocal, kPhotoWidth / 2, kPhotoHeight / 2};
  survey.cameras = {camera};
  survey.photographs = WavyPhotographs();
  SurveyPoints& p = survey.points;
  p.position = WavyPoints(points);
  p.photo_begin.push_back(0);
  for (std::size_t i = 0; i < p.position.size(); ++i) {
    p.color.push_back(WavyColor(p.position[i]));
    p.normal.push_back({0, 0, 1});
    p.error.push_back(0.25f * static_cast<float>(i % 5));
    for (std::uint32_t k = 0; k < 1 + i % 4; ++k) p.photo_idx.push_back(k);
    p.photo_begin.push_back(p.photo_idx.size());
  }
  return survey;
}

}  // namespace sherd::testing
