#include "reconstruction/similarity.h"

#include <Eigen/Geometry>
#include <algorithm>
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

// The rotation by b and then by a; no translation.
Rigid3d Product(const Rigid3d& a, const Rigid3d& b) {
  return {a.qw * b.qw - a.qx * b.qx - a.qy * b.qy - a.qz * b.qz,
          a.qw * b.qx + a.qx * b.qw + a.qy * b.qz - a.qz * b.qy,
          a.qw * b.qy - a.qx * b.qz + a.qy * b.qw + a.qz * b.qx,
          a.qw * b.qz + a.qx * b.qy - a.qy * b.qx + a.qz * b.qw,
          {}};
}

// False, and nothing done, where the quaternion has no length.
bool Normalize(Rigid3d* r) {
  const double norm = std::sqrt(r->qw * r->qw + r->qx * r->qx + r->qy * r->qy + r->qz * r->qz);
  if (!(norm > 1e-9)) return false;
  for (double* q : {&r->qw, &r->qx, &r->qy, &r->qz}) *q /= norm;
  return true;
}

}  // namespace

std::array<double, 8> NumbersOf(const Similarity3d& similarity) {
  const Rigid3d& r = similarity.rotation_and_translation;
  const Vec3d& t = r.translation;
  return {similarity.scale, r.qw, r.qx, r.qy, r.qz, t.x, t.y, t.z};
}

Similarity3d SimilarityOf(const std::array<double, 8>& v) {
  return {v[0], {v[1], v[2], v[3], v[4], {v[5], v[6], v[7]}}};
}

double TurnOf(const Rigid3d& r) {
  return 2 * std::atan2(std::hypot(r.qx, r.qy, r.qz), std::abs(r.qw));
}

Similarity3d Compose(const Similarity3d& c_from_b, const Similarity3d& b_from_a) {
  Rigid3d motion = Product(c_from_b.rotation_and_translation, b_from_a.rotation_and_translation);
  Normalize(&motion);
  motion.translation = c_from_b.Apply(b_from_a.rotation_and_translation.translation);
  return {c_from_b.scale * b_from_a.scale, motion};
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
    std::array<double, 8> eight;
    std::copy(numbers.begin(), numbers.end(), eight.begin());
    out = SimilarityOf(eight);
  } else {
    throw InputError(path, "",
                     "holds " + std::to_string(numbers.size()) +
                         " numbers, but a transform has 8 (scale, quaternion w x y z, "
                         "translation) or is a matrix of 3 or 4 rows",
                     "colmap model_aligner writes it with --transform_path");
  }
  if (!Normalize(&out.rotation_and_translation)) {
    throw InputError(path, "", "the rotation is no quaternion");
  }
  if (!(out.scale > 0)) throw InputError(path, "", "the scale is not positive");
  return out;
}

void TransformSurvey(const Similarity3d& target_from_source, Survey* survey) {
  const Rigid3d& motion = target_from_source.rotation_and_translation;
  const Rigid3d inverse{motion.qw, -motion.qx, -motion.qy, -motion.qz, {}};
  for (Vec3d& p : survey->points.position) p = target_from_source.Apply(p);
  for (Vec3f& n : survey->points.normal) n = motion.Rotate(n.cast<double>()).cast<float>();
  for (Photograph& photo : survey->photographs) {
    // The centre moves as a point does; the rotation is that of the camera after the inverse one.
    const Vec3d center = target_from_source.Apply(photo.cam_from_world.Center());
    Rigid3d moved = Product(photo.cam_from_world, inverse);
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
