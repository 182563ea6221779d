#include "reconstruction/photographs.h"

#include <algorithm>
#include <cmath>

#include "metaball/error.h"
#include "reconstruction/photo_file.h"
#include "reconstruction/photo_pyramid.h"

namespace sherd {

PhotoSize ReadPhotoSize(const std::string& path) {
  const PhotoFile file(path);
  return {file.width(), file.height()};
}

PhotoImage ReadPhoto(const std::string& path, int max_side) {
  PhotoFile file(path);
  PhotoImage out;
  const int side = std::max(file.width(), file.height());
  const double scale = max_side > 0 && side > max_side ? static_cast<double>(max_side) / side : 1.0;
  out.width = std::max(1, static_cast<int>(std::lround(file.width() * scale)));
  out.height = std::max(1, static_cast<int>(std::lround(file.height() * scale)));
  out.pixels.reserve(static_cast<std::size_t>(out.width) * out.height);

  // Exact area averages in linear light: every source pixel counts for the part of it that falls
  // into the target pixel. One target row is held.
  const double step_x = static_cast<double>(file.width()) / out.width;
  const double step_y = static_cast<double>(file.height()) / out.height;
  std::vector<Vec3f> narrowed(static_cast<std::size_t>(out.width)), sum(narrowed.size());
  int source_y = 0;
  const auto emit = [&](float weight) {
    for (Vec3f& c : sum) {
      c = c * (1.0f / weight);
      out.pixels.push_back({EncodeLinear(c.x), EncodeLinear(c.y), EncodeLinear(c.z)});
      c = Vec3f{};
    }
  };
  double covered = 0;
  file.ReadRows([&](const Vec3f* row, const std::uint8_t*) {
    if (scale == 1.0) {
      for (int x = 0; x < out.width; ++x) {
        out.pixels.push_back(
            {EncodeLinear(row[x].x), EncodeLinear(row[x].y), EncodeLinear(row[x].z)});
      }
      return;
    }
    for (int x = 0; x < out.width; ++x) {
      const double begin = x * step_x, end = std::min((x + 1) * step_x, double(file.width()));
      Vec3f c{};
      for (int sx = static_cast<int>(begin); sx < end; ++sx) {
        const double part = std::min(end, sx + 1.0) - std::max(begin, double(sx));
        c += row[sx] * static_cast<float>(part);
      }
      narrowed[static_cast<std::size_t>(x)] = c * static_cast<float>(1.0 / (end - begin));
    }
    // The part of this row that belongs to the current target row, then the rest to the next.
    double left = 1.0;
    while (left > 1e-9) {
      const double part = std::min(left, step_y - covered);
      for (std::size_t x = 0; x < sum.size(); ++x) {
        sum[x] += narrowed[x] * static_cast<float>(part);
      }
      covered += part;
      left -= part;
      if (covered >= step_y - 1e-9) {
        emit(static_cast<float>(covered));
        covered = 0;
      }
    }
    ++source_y;
  });
  if (covered > 1e-6 && out.pixels.size() < static_cast<std::size_t>(out.width) * out.height) {
    emit(static_cast<float>(covered));
  }
  out.pixels.resize(static_cast<std::size_t>(out.width) * out.height);
  return out;
}

Camera CameraOfPhotograph(const Survey& survey, std::size_t photo_idx, int width, int height) {
  if (photo_idx >= survey.photographs.size()) {
    throw Error("there is no photograph " + std::to_string(photo_idx) + "; there are " +
                std::to_string(survey.photographs.size()));
  }
  const Photograph& photo = survey.photographs[photo_idx];
  const SurveyCamera& own = survey.cameras[photo.camera_idx];
  const Rigid3d& pose = photo.cam_from_world;
  Camera camera;
  camera.width = static_cast<int>(own.width);
  camera.height = static_cast<int>(own.height);
  camera.eye = pose.Center();
  camera.right = pose.InverseRotate({1, 0, 0});
  camera.down = pose.InverseRotate({0, 1, 0});
  camera.forward = pose.InverseRotate({0, 0, 1});
  own.Pinhole(&camera.fx, &camera.fy, &camera.cx, &camera.cy);
  // So that dense points lie where the photograph shows them.
  camera.cx += survey.dense_pixel_offset;
  camera.cy += survey.dense_pixel_offset;
  if (width <= 0 && height <= 0) return camera;
  // A side that is left open follows the photograph's shape.
  const auto following = [](int side, double ratio) {
    return std::max(1, static_cast<int>(std::lround(side * ratio)));
  };
  if (width <= 0) width = following(height, static_cast<double>(own.width) / own.height);
  if (height <= 0) height = following(width, static_cast<double>(own.height) / own.width);
  return camera.Resized(width, height);
}

}  // namespace sherd
