#include "reconstruction/similarity.h"

#include <Eigen/Geometry>
#include <cmath>
#include <utility>
#include <vector>

#include "metaball/error.h"
#include "reconstruction/text_reader.h"

namespace sherd {
namespace {

constexpr std::uint64_t kLargestFile = 1 << 16;

Similarity3d FromMatrix(const std::string& path, const std::vector<double>& m) {
  Eigen::Matrix3d a;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) a(r, c) = m[static_cast<std::size_t>(4 * r + c)];
  }
  const double determinant = a.determinant();
  const double scale = std::cbrt(determinant);
  const Eigen::Matrix3d rotation = a / scale;
  const bool last_row = m.size() == 12 || (m[12] == 0 && m[13] == 0 && m[14] == 0 && m[15] == 1);
  if (!(determinant > 0) || !last_row ||
      !((rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-6)) {
    throw InputError(path, "", "the matrix is no rotation with one scale and a translation");
  }
  const Eigen::Quaterniond q(rotation);
  Similarity3d out;
  out.scale = scale;
  out.rotation_and_translation = {q.w(), q.x(), q.y(), q.z(), {m[3], m[7], m[11]}};
  return out;
}

}  // namespace

Similarity3d Compose(const Similarity3d& c_from_b, const Similarity3d& b_from_a) {
  const Rigid3d& c = c_from_b.rotation_and_translation;
  const Rigid3d& b = b_from_a.rotation_and_translation;
  const Eigen::Quaterniond q =
      (Eigen::Quaterniond(c.qw, c.qx, c.qy, c.qz) * Eigen::Quaterniond(b.qw, b.qx, b.qy, b.qz))
          .normalized();
  return {c_from_b.scale * b_from_a.scale,
          {q.w(), q.x(), q.y(), q.z(), c_from_b.Apply(b.translation)}};
}

Similarity3d ReadSimilarity(const std::string& path) {
  TextReader reader(path);
  if (reader.size() > kLargestFile) {
    throw InputError(path, "", "is no transform: it is far too large",
                     "colmap model_aligner writes it with --transform_path");
  }
  std::vector<double> numbers;
  std::string_view line;
  while (reader.ReadLine(&line)) {
    line = Trimmed(line);
    if (line.empty() || line.front() == '#') continue;
    TokenReader tokens(reader, line);
    while (!tokens.AtEnd()) numbers.push_back(tokens.Number<double>("a number of the transform"));
  }
  for (const double n : numbers) {
    if (!std::isfinite(n)) throw InputError(path, "", "holds a number that is not finite");
  }
  Similarity3d out;
  if (numbers.size() == 12 || numbers.size() == 16) {
    out = FromMatrix(path, numbers);
  } else if (numbers.size() == 8) {
    out.scale = numbers[0];
    out.rotation_and_translation = {
        numbers[1], numbers[2], numbers[3], numbers[4], {numbers[5], numbers[6], numbers[7]}};
  } else {
    throw InputError(path, "",
                     "holds " + std::to_string(numbers.size()) +
                         " numbers, but a transform has 8 (scale, quaternion w x y z, "
                         "translation) or is a matrix of 3 or 4 rows",
                     "colmap model_aligner writes it with --transform_path");
  }
  Rigid3d& r = out.rotation_and_translation;
  const double norm = std::sqrt(r.qw * r.qw + r.qx * r.qx + r.qy * r.qy + r.qz * r.qz);
  if (!(norm > 1e-9)) throw InputError(path, "", "the rotation is no quaternion");
  r.qw /= norm;
  r.qx /= norm;
  r.qy /= norm;
  r.qz /= norm;
  if (!(out.scale > 0)) throw InputError(path, "", "the scale is not positive");
  return out;
}

void TransformSurvey(const Similarity3d& target_from_source, Survey* survey) {
  const Rigid3d& motion = target_from_source.rotation_and_translation;
  for (Vec3d& p : survey->points.position) p = target_from_source.Apply(p);
  for (Vec3f& n : survey->points.normal) n = motion.Rotate(n.cast<double>()).cast<float>();
  for (Photograph& photo : survey->photographs) {
    // The centre moves as a point does; the rotation is that of the camera after the inverse one.
    const Vec3d center = target_from_source.Apply(photo.cam_from_world.Center());
    const Rigid3d& q = photo.cam_from_world;
    Rigid3d moved;
    moved.qw = q.qw * motion.qw + q.qx * motion.qx + q.qy * motion.qy + q.qz * motion.qz;
    moved.qx = -q.qw * motion.qx + q.qx * motion.qw - q.qy * motion.qz + q.qz * motion.qy;
    moved.qy = -q.qw * motion.qy + q.qx * motion.qz + q.qy * motion.qw - q.qz * motion.qx;
    moved.qz = -q.qw * motion.qz - q.qx * motion.qy + q.qy * motion.qx + q.qz * motion.qw;
    moved.translation = -moved.Rotate(center);
    photo.cam_from_world = moved;
  }
  if (survey->up) survey->up = motion.Rotate(*survey->up);
  if (survey->metres_per_unit) *survey->metres_per_unit /= target_from_source.scale;
}

void TransformLevel(const Rigid3d& target_from_source, Level* level) {
  const Cloud& cloud = level->cloud;
  const std::size_t n = cloud.size();
  CloudInput input;
  input.center.reserve(n);
  input.radius.reserve(n);
  for (std::size_t i = 0; i < n; ++i) {
    input.center.push_back(target_from_source.Apply(cloud.frame.WorldFromLocal(cloud.center[i])));
    input.radius.push_back(cloud.frame.unit * static_cast<double>(cloud.RadiusOf(i)));
  }
  input.color = cloud.color;
  input.threshold.assign(cloud.threshold.begin(), cloud.threshold.end());
  input.channels = cloud.channels;
  std::vector<std::uint32_t> order;
  Level moved;
  moved.name = level->name;
  moved.stats = level->stats;
  moved.cloud = BuildCloud(input, nullptr, &order);
  moved.cloud.uniform_color = cloud.uniform_color;
  const bool photos = !level->photo_begin.empty();
  if (photos) moved.photo_begin.push_back(0);
  for (const std::uint32_t i : order) {
    if (!level->normal.empty()) {
      const Vec3d normal = target_from_source.Rotate(level->normal[i].cast<double>());
      moved.normal.push_back(normal.cast<float>());
    }
    if (!level->depth.empty()) moved.depth.push_back(level->depth[i]);
    if (!photos) continue;
    const auto begin = level->photo_idx.begin();
    moved.photo_idx.insert(moved.photo_idx.end(), begin + level->photo_begin[i],
                           begin + level->photo_begin[i + 1]);
    moved.photo_begin.push_back(static_cast<std::uint32_t>(moved.photo_idx.size()));
  }
  *level = std::move(moved);
}

}  // namespace sherd
