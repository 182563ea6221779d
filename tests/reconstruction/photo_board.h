// Photographs of a painted board, written by the tests that look them up.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "metaball/renderer.h"
#include "reconstruction/level.h"
#include "reconstruction/survey.h"
#include "tests/reconstruction/test_files.h"

namespace sherd::test {

inline bool SameColors(const Frame& a, const Frame& b) {
  return std::equal(a.color.begin(), a.color.end(), b.color.begin(), b.color.end(),
                    [](const Pixel& p, const Pixel& q) {
                      return p.r == q.r && p.g == q.g && p.b == q.b && p.a == q.a;
                    });
}

using Painter = std::function<Rgb8(int x, int y)>;

inline void WritePpm(const std::string& path, int width, int height, const Painter& paint) {
  std::string bytes = "P6\n" + std::to_string(width) + " " + std::to_string(height) + "\n255\n";
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Rgb8 c = paint(x, y);
      bytes.push_back(static_cast<char>(c.r));
      bytes.push_back(static_cast<char>(c.g));
      bytes.push_back(static_cast<char>(c.b));
    }
  }
  WriteFile(path, bytes);
}

// A board at z = 4 painted with stripes far finer than the metaballs, photographed by lenses with
// distortion.
inline Vec3f BoardColor(const Vec3d& p) {
  const double stripes =
      0.5 + 0.4 * std::sin(2 * M_PI * p.x / 0.03) * std::sin(2 * M_PI * p.y / 0.04);
  return Vec3d{stripes, 0.5 + 0.3 * std::sin(3 * p.x), 0.2 + 0.1 * p.y}.cast<float>();
}

struct Board {
  std::string folder = TestFolder();
  Survey survey;
  Level level;

  // The linear colour a photograph shows of a place of the board.
  static constexpr double kDistortion = -0.15;
  using Paint = std::function<Vec3f(int photo, const Vec3d& p)>;
  static Vec3d EyeOf(int photo) { return {-0.5 + 0.5 * photo, 0, 0}; }

  // scale: file pixels per camera pixel. shift: pixels by which the pictures lie right and down of
  // where the camera says.
  explicit Board(
      double scale = 1, double shift = 0, int photos = 3,
      const Paint& paint = [](int, const Vec3d& p) { return BoardColor(p); }) {
    survey.cameras.push_back(
        {1, CameraModelId::kSimpleRadial, 800, 600, {700, 400, 300, kDistortion}});
    for (int i = 0; i < photos; ++i) {
      Photograph photo;
      photo.name = std::to_string(i) + ".ppm";
      photo.path = folder + "/" + photo.name;
      photo.cam_from_world = PoseAt(EyeOf(i), 0.1 * (1 - i));
      survey.photographs.push_back(photo);
      WritePpm(photo.path, static_cast<int>(800 * scale), static_cast<int>(600 * scale),
               [&](int x, int y) {
                 return Rgb8FromLinear(paint(i, PlaceAt(i, kDistortion, (x + 0.5) / scale - shift,
                                                        (y + 0.5) / scale - shift)));
               });
    }
    survey.points.photo_begin.push_back(0);
    for (int i = 0; i < 60; ++i) {
      for (int j = 0; j < 45; ++j) {
        survey.points.position.push_back({-1.5 + 0.05 * i, -1.1 + 0.05 * j, 4});
        survey.points.normal.push_back({0, 0, -1});
        survey.points.color.push_back({10, 200, 30});
        for (int k = 0; k < photos; ++k) survey.points.photo_idx.push_back(k);
        survey.points.photo_begin.push_back(survey.points.photo_idx.size());
      }
    }
    Build();
  }

  // The place that a photograph shows at (x, y), taken with this much radial distortion: Newton by
  // fixed point.
  Vec3d PlaceAt(int photo, double distortion, double x, double y) const {
    const double u0 = (x - 400) / 700, v0 = (y - 300) / 700;
    double u = u0, v = v0;
    for (int k = 0; k < 30; ++k) {
      const double f = 1 + distortion * (u * u + v * v);
      u = u0 / f;
      v = v0 / f;
    }
    const Rigid3d& pose = survey.photographs[photo].cam_from_world;
    const Vec3d direction = pose.InverseRotate({u, v, 1}), eye = pose.Center();
    return eye + direction * ((4 - eye.z) / direction.z);
  }

  // Masks a photograph, pixel by pixel of the original, where `masked` says so of the place.
  void Mask(int photo, const std::function<bool(const Vec3d& p)>& masked) {
    Photograph& masked_photo = survey.photographs[photo];
    masked_photo.mask_path = folder + "/masks/" + masked_photo.name + ".png";
    std::string bytes = "P5\n800 600\n255\n";
    for (int y = 0; y < 600; ++y) {
      for (int x = 0; x < 800; ++x) {
        bytes += masked(PlaceAt(photo, kDistortion, x + 0.5, y + 0.5)) ? '\0' : '\xff';
      }
    }
    WriteFile(masked_photo.mask_path, bytes);
  }

  void Build() {
    LevelOptions options;
    options.target_count = survey.points.size();
    level = BuildLevel(PreparePoints(survey, false), survey, options);
  }

  static Camera View() {
    return Camera::LookAt({0.2, 0.1, 1.2}, {0.05, 0, 4}, {0, -1, 0}, 0.5, 400, 300);
  }

  Frame Render(const Camera& camera) const {
    Scene scene;
    scene.cloud = std::make_shared<Cloud>(level.cloud);
    scene.lighting.unlit = true;
    RenderSettings settings;
    settings.planes = {true, true, true};
    return MakeCpuRenderer()->Render(scene, camera, settings);
  }

  // Root mean square difference of the middle of the picture to the painted board, linear light.
  static double Difference(const Frame& frame, const Camera& camera) {
    double sum = 0;
    int n = 0;
    for (int y = 40; y < frame.height - 40; ++y) {
      for (int x = 40; x < frame.width - 40; ++x) {
        const RayD ray = RayThrough(camera, x + 0.5, y + 0.5);
        const Vec3f truth =
            BoardColor(ray.origin + ray.direction * ((4 - ray.origin.z) / ray.direction.z));
        const Pixel& c = frame.color[static_cast<std::size_t>(y) * frame.width + x];
        const Vec3f d{c.r - truth.x, c.g - truth.y, c.b - truth.z};
        sum += Dot(d, d) / 3;
        ++n;
      }
    }
    return std::sqrt(sum / n);
  }
};

}  // namespace sherd::test
