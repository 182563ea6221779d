#include "datasets_synthetic/colmap_files.h"

#include "datasets_synthetic/output_file.h"

namespace sherd::synthetic {
namespace {

constexpr std::int32_t kPinhole = 1, kOpencv = 4;  // models.h

double MeanTrackLength(const SparseModel& model) {
  double sum = 0;
  for (const ModelPoint& p : model.points) sum += static_cast<double>(p.track.size());
  return model.points.empty() ? 0 : sum / static_cast<double>(model.points.size());
}

double MeanObservations(const SparseModel& model) {
  double sum = 0;
  for (const ModelPoint& p : model.points) sum += static_cast<double>(p.track.size());
  return model.images.empty() ? 0 : sum / static_cast<double>(model.images.size());
}

}  // namespace

void WriteModelBinary(const std::string& folder, const SparseModel& model) {
  OutputFile cameras(folder + "/cameras.bin");
  cameras.Number(static_cast<std::uint64_t>(model.cameras.size()));
  for (const Lens& c : model.cameras) {
    cameras.Number(c.camera_id);
    cameras.Number(c.distorted() ? kOpencv : kPinhole);
    cameras.Number(static_cast<std::uint64_t>(c.width));
    cameras.Number(static_cast<std::uint64_t>(c.height));
    for (const double p : c.Params()) cameras.Number(p);
  }
  cameras.Close();

  OutputFile images(folder + "/images.bin");
  images.Number(static_cast<std::uint64_t>(model.images.size()));
  for (const ModelImage& i : model.images) {
    images.Number(i.image_id);
    for (const double q : i.q) images.Number(q);
    images.Number(i.t.x);
    images.Number(i.t.y);
    images.Number(i.t.z);
    images.Number(i.camera_id);
    images.Bytes(i.name.c_str(), i.name.size() + 1);
    images.Number(static_cast<std::uint64_t>(i.keypoints.size()));
    for (const ModelKeypoint& k : i.keypoints) {
      images.Number(k.x);
      images.Number(k.y);
      images.Number(k.point3d_id);
    }
  }
  images.Close();

  OutputFile points(folder + "/points3D.bin");
  points.Number(static_cast<std::uint64_t>(model.points.size()));
  for (const ModelPoint& p : model.points) {
    points.Number(p.point3d_id);
    points.Number(p.position.x);
    points.Number(p.position.y);
    points.Number(p.position.z);
    points.Number(p.color.r);
    points.Number(p.color.g);
    points.Number(p.color.b);
    points.Number(p.error);
    points.Number(static_cast<std::uint64_t>(p.track.size()));
    for (const ModelObservation& o : p.track) {
      points.Number(o.image_id);
      points.Number(o.keypoint_idx);
    }
  }
  points.Close();
}

void WriteModelText(const std::string& folder, const SparseModel& model) {
  OutputFile cameras(folder + "/cameras.txt");
  cameras.Format(
      "# Camera list with one line of data per camera:\n"
      "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n# Number of cameras: %zu\n",
      model.cameras.size());
  for (const Lens& c : model.cameras) {
    cameras.Format("%u %s %d %d", c.camera_id, c.distorted() ? "OPENCV" : "PINHOLE", c.width,
                   c.height);
    for (const double p : c.Params()) cameras.Format(" %.17g", p);
    cameras.Text("\n");
  }
  cameras.Close();

  OutputFile images(folder + "/images.txt");
  images.Format(
      "# Image list with two lines of data per image:\n"
      "#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n"
      "#   POINTS2D[] as (X, Y, POINT3D_ID)\n"
      "# Number of images: %zu, mean observations per image: %.17g\n",
      model.images.size(), MeanObservations(model));
  for (const ModelImage& i : model.images) {
    images.Format("%u %.17g %.17g %.17g %.17g %.17g %.17g %.17g %u %s\n", i.image_id, i.q[0],
                  i.q[1], i.q[2], i.q[3], i.t.x, i.t.y, i.t.z, i.camera_id, i.name.c_str());
    const char* space = "";
    for (const ModelKeypoint& k : i.keypoints) {
      images.Format("%s%.17g %.17g ", space, k.x, k.y);
      if (k.point3d_id == kNoPoint) {
        images.Text("-1");
      } else {
        images.Format("%llu", static_cast<unsigned long long>(k.point3d_id));
      }
      space = " ";
    }
    images.Text("\n");
  }
  images.Close();

  OutputFile points(folder + "/points3D.txt");
  points.Format(
      "# 3D point list with one line of data per point:\n"
      "#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n"
      "# Number of points: %zu, mean track length: %.17g\n",
      model.points.size(), MeanTrackLength(model));
  for (const ModelPoint& p : model.points) {
    points.Format("%llu %.17g %.17g %.17g %d %d %d %.17g",
                  static_cast<unsigned long long>(p.point3d_id), p.position.x, p.position.y,
                  p.position.z, p.color.r, p.color.g, p.color.b, p.error);
    for (const ModelObservation& o : p.track) points.Format(" %u %u", o.image_id, o.keypoint_idx);
    points.Text("\n");
  }
  points.Close();
}

void WriteMap(const std::string& path, int width, int height, int channels,
              const std::vector<float>& values) {
  OutputFile file(path);
  file.Format("%d&%d&%d&", width, height, channels);
  file.Bytes(values.data(), values.size() * sizeof(float));
  file.Close();
}

void WriteFused(const std::string& ply_path, const std::vector<FusedPoint>& points) {
  OutputFile ply(ply_path);
  ply.Format(
      "ply\nformat binary_little_endian 1.0\nelement vertex %zu\n"
      "property float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
      points.size());
  for (const FusedPoint& p : points) {
    for (const float v : {p.position.x, p.position.y, p.position.z}) ply.Number(v);
    for (const float v : {p.normal.x, p.normal.y, p.normal.z}) ply.Number(v);
    ply.Number(p.color.r);
    ply.Number(p.color.g);
    ply.Number(p.color.b);
  }
  ply.Close();

  OutputFile vis(ply_path + ".vis");
  vis.Number(static_cast<std::uint64_t>(points.size()));
  for (const FusedPoint& p : points) {
    vis.Number(static_cast<std::uint32_t>(p.image_idx.size()));
    vis.Bytes(p.image_idx.data(), p.image_idx.size() * sizeof(std::uint32_t));
  }
  vis.Close();
}

}  // namespace sherd::synthetic
