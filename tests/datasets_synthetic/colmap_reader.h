// A second, independent reader of COLMAP's files, as small as possible, to check what the generator
// writes (written from doc/format.rst, not from the writer).
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace sherd::test {

struct Camera {
  std::uint32_t id;
  int model;
  std::uint64_t width, height;
  std::vector<double> params;
  bool operator==(const Camera&) const = default;
};
struct Keypoint {
  double x, y;
  std::int64_t point;  // -1: none
  bool operator==(const Keypoint&) const = default;
};
struct Image {
  std::uint32_t id;
  double q[4], t[3];
  std::uint32_t camera_id;
  std::string name;
  std::vector<Keypoint> keypoints;
  bool operator==(const Image&) const = default;
};
struct Point {
  std::uint64_t id;
  double xyz[3];
  int rgb[3];
  double error;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> track;
  bool operator==(const Point&) const = default;
};
struct Model {
  std::vector<Camera> cameras;
  std::vector<Image> images;
  std::vector<Point> points;
};

inline std::string ReadAll(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot open " + path);
  std::ostringstream all;
  all << file.rdbuf();
  return all.str();
}

class Bytes {
 public:
  explicit Bytes(const std::string& path) : path_(path), data_(ReadAll(path)) {}
  template <class T>
  T Get() {
    T value;
    if (at_ + sizeof(T) > data_.size()) throw std::runtime_error(path_ + " is too short");
    std::memcpy(&value, data_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  std::string Until(char end) {
    const std::size_t stop = data_.find(end, at_);
    if (stop == std::string::npos) throw std::runtime_error(path_ + " is too short");
    std::string text = data_.substr(at_, stop - at_);
    at_ = stop + 1;
    return text;
  }
  std::size_t left() const { return data_.size() - at_; }
  void ExpectEnd() const {
    if (left() != 0) throw std::runtime_error(path_ + " has bytes after its end");
  }

 private:
  std::string path_, data_;
  std::size_t at_ = 0;
};

inline Model ReadBinary(const std::string& folder) {
  Model m;
  Bytes c(folder + "/cameras.bin");
  for (auto n = c.Get<std::uint64_t>(); n > 0; --n) {
    Camera camera;
    camera.id = c.Get<std::uint32_t>();
    camera.model = c.Get<std::int32_t>();
    camera.width = c.Get<std::uint64_t>();
    camera.height = c.Get<std::uint64_t>();
    const std::map<int, int> counts{{1, 4}, {4, 8}};  // PINHOLE, OPENCV
    for (int i = 0; i < counts.at(camera.model); ++i) camera.params.push_back(c.Get<double>());
    m.cameras.push_back(camera);
  }
  c.ExpectEnd();
  Bytes b(folder + "/images.bin");
  for (auto n = b.Get<std::uint64_t>(); n > 0; --n) {
    Image image;
    image.id = b.Get<std::uint32_t>();
    for (double& q : image.q) q = b.Get<double>();
    for (double& t : image.t) t = b.Get<double>();
    image.camera_id = b.Get<std::uint32_t>();
    image.name = b.Until('\0');
    for (auto k = b.Get<std::uint64_t>(); k > 0; --k) {
      const double x = b.Get<double>(), y = b.Get<double>();
      image.keypoints.push_back({x, y, b.Get<std::int64_t>()});
    }
    m.images.push_back(image);
  }
  b.ExpectEnd();
  Bytes p(folder + "/points3D.bin");
  for (auto n = p.Get<std::uint64_t>(); n > 0; --n) {
    Point point;
    point.id = p.Get<std::uint64_t>();
    for (double& v : point.xyz) v = p.Get<double>();
    for (int& v : point.rgb) v = p.Get<std::uint8_t>();
    point.error = p.Get<double>();
    for (auto k = p.Get<std::uint64_t>(); k > 0; --k) {
      const auto image = p.Get<std::uint32_t>();
      point.track.emplace_back(image, p.Get<std::uint32_t>());
    }
    m.points.push_back(point);
  }
  p.ExpectEnd();
  return m;
}

inline Model ReadText(const std::string& folder) {
  Model m;
  std::string line;
  std::ifstream cameras(folder + "/cameras.txt");
  while (std::getline(cameras, line)) {
    if (line[0] == '#') continue;
    std::istringstream s(line);
    Camera c;
    std::string model;
    s >> c.id >> model >> c.width >> c.height;
    c.model = model == "OPENCV" ? 4 : model == "PINHOLE" ? 1 : -1;
    for (double v; s >> v;) c.params.push_back(v);
    m.cameras.push_back(c);
  }
  std::ifstream images(folder + "/images.txt");
  while (std::getline(images, line)) {
    if (line[0] == '#') continue;
    std::istringstream s(line);
    Image i;
    s >> i.id >> i.q[0] >> i.q[1] >> i.q[2] >> i.q[3] >> i.t[0] >> i.t[1] >> i.t[2] >>
        i.camera_id >> i.name;
    std::getline(images, line);
    std::istringstream k(line);
    for (Keypoint p; k >> p.x >> p.y >> p.point;) i.keypoints.push_back(p);
    m.images.push_back(i);
  }
  std::ifstream points(folder + "/points3D.txt");
  while (std::getline(points, line)) {
    if (line[0] == '#') continue;
    std::istringstream s(line);
    Point p;
    s >> p.id >> p.xyz[0] >> p.xyz[1] >> p.xyz[2] >> p.rgb[0] >> p.rgb[1] >> p.rgb[2] >> p.error;
    for (std::uint32_t a, b; s >> a >> b;) p.track.emplace_back(a, b);
    m.points.push_back(p);
  }
  return m;
}

// Depth or normal map: value(channel, y, x).
struct Map {
  int width = 0, height = 0, channels = 0;
  std::vector<float> data;
  float At(int c, int y, int x) const {
    return data[static_cast<std::size_t>((c * height + y) * width + x)];
  }
};
inline Map ReadMap(const std::string& path) {
  Bytes b(path);
  Map m;
  m.width = std::stoi(b.Until('&'));
  m.height = std::stoi(b.Until('&'));
  m.channels = std::stoi(b.Until('&'));
  m.data.resize(static_cast<std::size_t>(m.width * m.height * m.channels));
  for (float& v : m.data) v = b.Get<float>();
  b.ExpectEnd();
  return m;
}

struct Fused {
  float xyz[3], normal[3];
  std::uint8_t rgb[3];
  std::vector<std::uint32_t> image_idx;
};
inline std::vector<Fused> ReadFused(const std::string& path) {
  Bytes b(path);
  std::string header;
  std::size_t count = 0;
  for (std::string line; line != "end_header"; header += line + "\n") {
    line = b.Until('\n');
    if (line.starts_with("element vertex ")) count = std::stoull(line.substr(15));
  }
  const std::string expected =
      "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(count) +
      "\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n"
      "property float ny\nproperty float nz\nproperty uchar red\nproperty uchar green\n"
      "property uchar blue\nend_header\n";
  if (header != expected) throw std::runtime_error("not the header COLMAP writes:\n" + header);
  if (b.left() != 27 * count) throw std::runtime_error("not 27 bytes a vertex");
  Bytes v(path + ".vis");
  if (v.Get<std::uint64_t>() != count) throw std::runtime_error("the counts of .vis differ");
  std::vector<Fused> points(count);
  for (Fused& p : points) {
    for (float& f : p.xyz) f = b.Get<float>();
    for (float& f : p.normal) f = b.Get<float>();
    for (std::uint8_t& c : p.rgb) c = b.Get<std::uint8_t>();
    for (auto n = v.Get<std::uint32_t>(); n > 0; --n) p.image_idx.push_back(v.Get<std::uint32_t>());
  }
  v.ExpectEnd();
  return points;
}

// COLMAP's projection (models.h): image coordinates of a world point, and its depth.
inline bool Project(const Model& m, const Image& image, const double* xyz, double* x, double* y,
                    double* depth) {
  const double *q = image.q, w = q[0], a = q[1], b = q[2], c = q[3];
  const double r[3][3] = {{1 - 2 * (b * b + c * c), 2 * (a * b - w * c), 2 * (a * c + w * b)},
                          {2 * (a * b + w * c), 1 - 2 * (a * a + c * c), 2 * (b * c - w * a)},
                          {2 * (a * c - w * b), 2 * (b * c + w * a), 1 - 2 * (a * a + b * b)}};
  double p[3];
  for (int i = 0; i < 3; ++i) {
    p[i] = r[i][0] * xyz[0] + r[i][1] * xyz[1] + r[i][2] * xyz[2] + image.t[i];
  }
  *depth = p[2];
  if (p[2] <= 0) return false;
  const double u = p[0] / p[2], v = p[1] / p[2];
  for (const Camera& camera : m.cameras) {
    if (camera.id != image.camera_id) continue;
    const std::vector<double>& k = camera.params;
    double du = 0, dv = 0;
    if (camera.model == 4) {
      const double r2 = u * u + v * v, radial = k[4] * r2 + k[5] * r2 * r2;
      du = u * radial + 2 * k[6] * u * v + k[7] * (r2 + 2 * u * u);
      dv = v * radial + 2 * k[7] * u * v + k[6] * (r2 + 2 * v * v);
    }
    *x = k[0] * (u + du) + k[2];
    *y = k[1] * (v + dv) + k[3];
    return true;
  }
  throw std::runtime_error("image with an unknown camera");
}

// The world position of a camera.
inline void Center(const Image& image, double* center) {
  const double *q = image.q, w = q[0], a = q[1], b = q[2], c = q[3];
  const double r[3][3] = {{1 - 2 * (b * b + c * c), 2 * (a * b - w * c), 2 * (a * c + w * b)},
                          {2 * (a * b + w * c), 1 - 2 * (a * a + c * c), 2 * (b * c - w * a)},
                          {2 * (a * c - w * b), 2 * (b * c + w * a), 1 - 2 * (a * a + b * b)}};
  for (int i = 0; i < 3; ++i) {
    center[i] = -(r[0][i] * image.t[0] + r[1][i] * image.t[1] + r[2][i] * image.t[2]);
  }
}

inline bool HaveColmap() { return std::system("colmap help >/dev/null 2>&1") == 0; }

}  // namespace sherd::test
