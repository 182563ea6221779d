#include "tests/app/desktop/small_workspace.h"

#include <QColor>
#include <QDir>
#include <QFile>
#include <QImage>
#include <QTextStream>
#include <array>
#include <cmath>
#include <vector>

#include "metaball/camera.h"

namespace sherd {
namespace {

constexpr int kWidth = 320, kHeight = 240;
constexpr double kFocal = 300.0;

Vec3d surfacePoint(double x, double y, double relief) {
  return {x, y, relief * std::sin(4 * x) * std::cos(3 * y) + 0.1 * x};
}

QColor surfaceColor(double x, double y) {
  // A chequered cloth: edges that a photograph shows sharply.
  const bool odd = (static_cast<int>(std::floor(x * 4)) + static_cast<int>(std::floor(y * 4))) & 1;
  return odd ? QColor(176, 128, 84) : QColor(104, 120, 96);
}

std::vector<Vec3d> gridPoints(int points, double relief) {
  const int n = std::max(2, static_cast<int>(std::lround(std::sqrt(points))));
  std::vector<Vec3d> result;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      result.push_back(surfacePoint(-1 + 2.0 * (i + 0.5) / n, -1 + 2.0 * (j + 0.5) / n, relief));
    }
  }
  return result;
}

Camera photoCamera(int index) {
  const std::array<Vec3d, 4> eyes = {
      {{0.2, -2.6, 2.2}, {2.4, 0.3, 2.4}, {-0.3, 2.5, 2.3}, {-2.5, -0.2, 2.2}}};
  const double fov = 2 * std::atan(0.5 * kWidth / kFocal);
  return Camera::LookAt(eyes[static_cast<std::size_t>(index)], {0, 0, 0}, {0, 0, 1}, fov, kWidth,
                        kHeight);
}

// The quaternion (w, x, y, z) of the rotation whose rows are the camera's axes.
std::array<double, 4> quaternionOf(const Camera& c) {
  const double m[3][3] = {{c.right.x, c.right.y, c.right.z},
                          {c.down.x, c.down.y, c.down.z},
                          {c.forward.x, c.forward.y, c.forward.z}};
  // The largest of the four is taken first, so that none is divided by zero.
  const double trace = m[0][0] + m[1][1] + m[2][2];
  const std::array<double, 4> squares = {1 + trace, 1 + 2 * m[0][0] - trace,
                                         1 + 2 * m[1][1] - trace, 1 + 2 * m[2][2] - trace};
  std::size_t k = 0;
  for (std::size_t i = 1; i < 4; ++i) k = squares[i] > squares[k] ? i : k;
  const double s = std::sqrt(squares[k]), f = 0.5 / s;
  switch (k) {
    case 0:
      return {0.5 * s, (m[2][1] - m[1][2]) * f, (m[0][2] - m[2][0]) * f, (m[1][0] - m[0][1]) * f};
    case 1:
      return {(m[2][1] - m[1][2]) * f, 0.5 * s, (m[0][1] + m[1][0]) * f, (m[0][2] + m[2][0]) * f};
    case 2:
      return {(m[0][2] - m[2][0]) * f, (m[0][1] + m[1][0]) * f, 0.5 * s, (m[1][2] + m[2][1]) * f};
    default:
      return {(m[1][0] - m[0][1]) * f, (m[0][2] + m[2][0]) * f, (m[1][2] + m[2][1]) * f, 0.5 * s};
  }
}

QImage photograph(const Camera& camera, double relief) {
  QImage image(kWidth, kHeight, QImage::Format_RGB32);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const RayD ray = RayThrough(camera, x + 0.5, y + 0.5);
      // The surface is a height field: where the ray first falls below it.
      QColor color(40, 42, 46);
      for (double t = 1.0; t < 6.0; t += 0.01) {
        const Vec3d p = ray.origin + ray.direction * t;
        if (std::abs(p.x) > 1 || std::abs(p.y) > 1 || p.z > surfacePoint(p.x, p.y, relief).z) {
          continue;
        }
        color = surfaceColor(p.x, p.y);
        break;
      }
      image.setPixelColor(x, y, color);
    }
  }
  return image;
}

}  // namespace

void writeSmallWorkspace(const QString& folder, int points, double relief) {
  const QDir root(folder);
  root.mkpath(QStringLiteral("sparse/0"));
  root.mkpath(QStringLiteral("images"));
  const auto open = [&](QFile* file) {
    if (!file->open(QIODevice::WriteOnly)) qFatal("cannot write %s", qPrintable(file->fileName()));
  };
  QFile cameras(root.filePath(QStringLiteral("sparse/0/cameras.txt")));
  open(&cameras);
  QTextStream(&cameras) << "1 PINHOLE " << kWidth << ' ' << kHeight << ' ' << kFocal << ' '
                        << kFocal << ' ' << kWidth / 2 << ' ' << kHeight / 2 << '\n';
  const std::vector<Vec3d> cloud = gridPoints(points, relief);
  QFile images(root.filePath(QStringLiteral("sparse/0/images.txt")));
  open(&images);
  QTextStream image_text(&images);
  image_text.setRealNumberPrecision(17);
  for (int i = 0; i < 4; ++i) {
    const Camera camera = photoCamera(i);
    const std::array<double, 4> q = quaternionOf(camera);
    const QString name = QStringLiteral("photo_%1.png").arg(i + 1);
    image_text << i + 1 << ' ' << q[0] << ' ' << q[1] << ' ' << q[2] << ' ' << q[3] << ' '
               << -Dot(camera.right, camera.eye) << ' ' << -Dot(camera.down, camera.eye) << ' '
               << -Dot(camera.forward, camera.eye) << " 1 " << name << '\n';
    for (std::size_t k = 0; k < cloud.size(); ++k) {
      double x = 0, y = 0;
      camera.Project(cloud[k], &x, &y);
      image_text << (k ? " " : "") << x << ' ' << y << ' ' << k + 1;
    }
    image_text << '\n';
    photograph(camera, relief).save(root.filePath(QStringLiteral("images/") + name));
  }
  QFile points3d(root.filePath(QStringLiteral("sparse/0/points3D.txt")));
  open(&points3d);
  QTextStream point_text(&points3d);
  for (std::size_t k = 0; k < cloud.size(); ++k) {
    const QColor c = surfaceColor(cloud[k].x, cloud[k].y);
    point_text << k + 1 << ' ' << cloud[k].x << ' ' << cloud[k].y << ' ' << cloud[k].z << ' '
               << c.red() << ' ' << c.green() << ' ' << c.blue() << " 0.5";
    for (int i = 0; i < 4; ++i) point_text << ' ' << i + 1 << ' ' << k;
    point_text << '\n';
  }
}

void writeSmallPly(const QString& path, int points, bool radii) {
  QFile file(path);
  if (!file.open(QIODevice::WriteOnly)) qFatal("cannot write %s", qPrintable(path));
  const std::vector<Vec3d> cloud = gridPoints(points, kRelief);
  const double radius = 2.5 * 2.0 / std::sqrt(static_cast<double>(cloud.size()));
  QTextStream text(&file);
  text << "ply\nformat ascii 1.0\nelement vertex " << cloud.size()
       << "\nproperty float x\nproperty float y\nproperty float z\n"
       << (radii ? "property float radius\n" : "")
       << "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
  for (const Vec3d& p : cloud) {
    const QColor c = surfaceColor(p.x, p.y);
    text << p.x << ' ' << p.y << ' ' << p.z << ' ';
    if (radii) text << radius << ' ';
    text << c.red() << ' ' << c.green() << ' ' << c.blue() << '\n';
  }
}

}  // namespace sherd
