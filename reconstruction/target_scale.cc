#include "reconstruction/target_scale.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "metaball/error.h"
#include "reconstruction/camera_projector.h"
#include "reconstruction/photographs.h"

namespace sherd {
namespace {

// Farther off than this a corner was not the same one (or the photograph's pose is wrong).
constexpr double kLargestMissPx = 4.0;

struct NamedDictionary {
  const char* name;
  int id;
};

constexpr NamedDictionary kDictionaries[] = {
    {"4x4_50", cv::aruco::DICT_4X4_50},
    {"4x4_100", cv::aruco::DICT_4X4_100},
    {"4x4_250", cv::aruco::DICT_4X4_250},
    {"4x4_1000", cv::aruco::DICT_4X4_1000},
    {"5x5_50", cv::aruco::DICT_5X5_50},
    {"5x5_100", cv::aruco::DICT_5X5_100},
    {"5x5_250", cv::aruco::DICT_5X5_250},
    {"5x5_1000", cv::aruco::DICT_5X5_1000},
    {"6x6_50", cv::aruco::DICT_6X6_50},
    {"6x6_100", cv::aruco::DICT_6X6_100},
    {"6x6_250", cv::aruco::DICT_6X6_250},
    {"6x6_1000", cv::aruco::DICT_6X6_1000},
    {"7x7_50", cv::aruco::DICT_7X7_50},
    {"7x7_100", cv::aruco::DICT_7X7_100},
    {"7x7_250", cv::aruco::DICT_7X7_250},
    {"7x7_1000", cv::aruco::DICT_7X7_1000},
    {"original", cv::aruco::DICT_ARUCO_ORIGINAL},
    {"apriltag_16h5", cv::aruco::DICT_APRILTAG_16h5},
    {"apriltag_25h9", cv::aruco::DICT_APRILTAG_25h9},
    {"apriltag_36h10", cv::aruco::DICT_APRILTAG_36h10},
    {"apriltag_36h11", cv::aruco::DICT_APRILTAG_36h11},
};

// A corner's name is its target and its place on it.
struct CornerName {
  int target = 0, corner = 0;
  friend auto operator<=>(const CornerName&, const CornerName&) = default;
};

struct Sighting {
  std::size_t photo = 0;
  double x = 0, y = 0;  // image coordinates of the camera
};

using Corners = std::vector<std::pair<CornerName, cv::Point2f>>;

// A photograph as its file was looked at: the original's camera where there is an original.
struct Eye {
  Rigid3d cam_from_world;
  const SurveyCamera* camera = nullptr;
  CameraProjector projector;
};

class Targets {
 public:
  Targets(const TargetOptions& options, const Survey& survey) : options_(options) {
    for (const Photograph& photo : survey.photographs) {
      const bool original = !photo.original_path.empty();
      const SurveyCamera& camera =
          survey.cameras[original ? photo.original_camera_idx : photo.camera_idx];
      eyes_.push_back({photo.cam_from_world, &camera, CameraProjector(camera)});
    }
  }

  void Look(const Survey& survey, std::size_t i, TargetScale* out) {
    const Photograph& photo = survey.photographs[i];
    const std::string& path = photo.original_path.empty() ? photo.path : photo.original_path;
    if (path.empty()) return;
    PhotoImage image;
    try {
      image = ReadPhoto(path);
    } catch (const InputError& error) {
      out->warnings.push_back(error.what());
      return;
    }
    const cv::Mat rgb(image.height, image.width, CV_8UC3, image.pixels.data());
    cv::Mat grey;
    cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
    Corners corners = options_.markers.empty() ? Chessboard(grey) : Markers(grey);
    if (corners.empty()) return;
    const SurveyCamera& camera = *eyes_[i].camera;
    const double sx = static_cast<double>(camera.width) / image.width;
    const double sy = static_cast<double>(camera.height) / image.height;
    std::map<CornerName, Sighting> seen;
    for (const auto& [name, p] : corners) {
      // OpenCV's origin is the centre of the first pixel.
      seen[name] = {i, (p.x + 0.5) * sx, (p.y + 0.5) * sy};
    }
    if (options_.markers.empty()) seen = TurnedAsBefore(seen);
    for (const auto& [name, sighting] : seen) sightings_[name].push_back(sighting);
    ++out->photographs;
  }

  void Measure(TargetScale* out) {
    double squares = 0;
    std::size_t count = 0;
    std::map<CornerName, Vec3d> placed;
    for (auto& [name, sightings] : sightings_) {
      Vec3d point;
      if (!Place(&sightings, &point)) continue;
      placed[name] = point;
      for (const Sighting& s : sightings) {
        const double miss = MissOf(s, point);
        squares += miss * miss;
        ++count;
      }
    }
    out->corners = placed.size();
    if (count > 0) out->reprojection_px = std::sqrt(squares / static_cast<double>(count));
    std::vector<double> ratios;
    for (const Length3& length : Lengths()) {
      const auto a = placed.find(length.a), b = placed.find(length.b);
      if (a == placed.end() || b == placed.end()) continue;
      const double measured = Length(a->second - b->second);
      if (measured > 0) ratios.push_back(length.metres / measured);
    }
    out->lengths = ratios.size();
    if (ratios.empty()) return;
    double mean = 0, variance = 0;
    for (const double r : ratios) mean += r / static_cast<double>(ratios.size());
    for (const double r : ratios) variance += (r - mean) * (r - mean);
    out->metres_per_unit = mean;
    if (ratios.size() > 1) {
      const auto n = static_cast<double>(ratios.size());
      out->relative_error = std::sqrt(variance / (n - 1) / n) / mean;
    }
  }

 private:
  struct Length3 {
    CornerName a, b;
    double metres = 0;
  };

  Corners Markers(const cv::Mat& grey) const {
    std::vector<std::vector<cv::Point2f>> found;
    std::vector<int> ids;
    const auto parameters = cv::aruco::DetectorParameters::create();
    parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
    int dictionary = 0;
    for (const NamedDictionary& d : kDictionaries) {
      if (options_.markers == d.name) dictionary = d.id;
    }
    cv::aruco::detectMarkers(grey, cv::aruco::getPredefinedDictionary(dictionary), found, ids,
                             parameters);
    Corners corners;
    for (std::size_t m = 0; m < ids.size(); ++m) {
      // A marker that is there twice is none: which of them is meant is not known.
      if (std::count(ids.begin(), ids.end(), ids[m]) != 1) continue;
      for (int k = 0; k < 4; ++k) {
        corners.push_back({{ids[m], k}, found[m][static_cast<std::size_t>(k)]});
      }
    }
    return corners;
  }

  Corners Chessboard(const cv::Mat& grey) const {
    std::vector<cv::Point2f> found;
    if (!cv::findChessboardCorners(grey, {options_.columns, options_.rows}, found,
                                   cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE |
                                       cv::CALIB_CB_FAST_CHECK)) {
      return {};
    }
    // Within a third of the way to the next corner.
    double nearest = INFINITY;
    for (std::size_t i = 1; i < found.size(); ++i) {
      if (i % static_cast<std::size_t>(options_.columns) == 0) continue;
      nearest = std::min(nearest, cv::norm(found[i] - found[i - 1]));
    }
    const int window = std::clamp(static_cast<int>(nearest / 3), 2, 15);
    cv::cornerSubPix(grey, found, {window, window}, {-1, -1},
                     {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 50, 1e-3});
    Corners corners;
    for (std::size_t i = 0; i < found.size(); ++i) {
      corners.push_back({{0, static_cast<int>(i)}, found[i]});
    }
    return corners;
  }

  // OpenCV begins at either end of a chessboard: in the order that agrees with the photographs
  // before.
  std::map<CornerName, Sighting> TurnedAsBefore(const std::map<CornerName, Sighting>& seen) const {
    const int last = options_.columns * options_.rows - 1;
    std::map<CornerName, Sighting> turned;
    for (const auto& [name, s] : seen) turned[{name.target, last - name.corner}] = s;
    const auto miss = [&](const std::map<CornerName, Sighting>& as) {
      double sum = 0;
      for (const auto& [name, s] : as) {
        const auto known = sightings_.find(name);
        if (known == sightings_.end()) continue;
        std::vector<Sighting> all = known->second;
        all.push_back(s);
        Vec3d point;
        if (!Nearest(all, &point)) continue;
        for (const Sighting& each : all) sum += std::min(MissOf(each, point), 1e3);
      }
      return sum;
    };
    return miss(turned) < miss(seen) ? turned : seen;
  }

  // The point nearest to the rays of the sightings; false where they are almost parallel.
  bool Nearest(const std::vector<Sighting>& sightings, Vec3d* point) const {
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    std::size_t rays = 0;
    // Relative to the first camera: georeferenced coordinates keep their digits.
    const Vec3d origin = eyes_[sightings.front().photo].cam_from_world.Center();
    for (const Sighting& s : sightings) {
      const Eye& eye = eyes_[s.photo];
      Vec3d ray;
      if (!eye.projector.Unproject(s.x, s.y, &ray)) continue;
      ray = eye.cam_from_world.InverseRotate(ray);
      const Vec3d c = eye.cam_from_world.Center() - origin;
      const Eigen::Vector3d d(ray.x, ray.y, ray.z);
      const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - d * d.transpose();
      a += across;
      b += across * Eigen::Vector3d(c.x, c.y, c.z);
      ++rays;
    }
    if (rays < 2) return false;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(a);
    // The square of the angle between two rays, halved: one degree at least.
    if (!(solver.eigenvalues()(0) > 1.5e-4)) return false;
    const Eigen::Vector3d x = solver.eigenvectors() *
                              solver.eigenvalues().cwiseInverse().asDiagonal() *
                              solver.eigenvectors().transpose() * b;
    *point = origin + Vec3d{x(0), x(1), x(2)};
    return true;
  }

  double MissOf(const Sighting& s, const Vec3d& point) const {
    const Eye& eye = eyes_[s.photo];
    double x, y;
    if (!eye.projector.Project(eye.cam_from_world.Apply(point), &x, &y)) return INFINITY;
    return std::hypot(x - s.x, y - s.y);
  }

  // Leaves out the sighting that fits worst while it does not fit.
  bool Place(std::vector<Sighting>* sightings, Vec3d* point) const {
    while (sightings->size() >= 2 && Nearest(*sightings, point)) {
      const auto worst = std::max_element(sightings->begin(), sightings->end(),
                                          [&](const Sighting& a, const Sighting& b) {
                                            return MissOf(a, *point) < MissOf(b, *point);
                                          });
      if (MissOf(*worst, *point) <= kLargestMissPx) return true;
      sightings->erase(worst);
    }
    return false;
  }

  // Lengths that are known: sides and diagonals of markers, whole rows and columns of a chessboard.
  std::vector<Length3> Lengths() const {
    std::vector<Length3> lengths;
    if (!options_.markers.empty()) {
      int last = -1;
      for (const auto& [name, sightings] : sightings_) {
        if (name.target == last) continue;
        last = name.target;
        for (int k = 0; k < 4; ++k) {
          lengths.push_back({{last, k}, {last, (k + 1) % 4}, options_.size_m});
        }
        for (int k = 0; k < 2; ++k) {
          lengths.push_back({{last, k}, {last, k + 2}, options_.size_m * std::sqrt(2.0)});
        }
      }
      return lengths;
    }
    for (int r = 0; r < options_.rows; ++r) {
      lengths.push_back({{0, r * options_.columns},
                         {0, (r + 1) * options_.columns - 1},
                         (options_.columns - 1) * options_.size_m});
    }
    for (int c = 0; c < options_.columns; ++c) {
      lengths.push_back({{0, c},
                         {0, (options_.rows - 1) * options_.columns + c},
                         (options_.rows - 1) * options_.size_m});
    }
    return lengths;
  }

  const TargetOptions& options_;
  std::vector<Eye> eyes_;
  std::map<CornerName, std::vector<Sighting>> sightings_;
};

void Check(const TargetOptions& options) {
  if (!(options.size_m > 0) || !std::isfinite(options.size_m)) {
    throw InputError("", "", "the size of a target must be a length above 0 metres");
  }
  if (options.markers.empty()) {
    if (options.columns < 3 || options.rows < 3 || options.columns == options.rows ||
        options.columns > 1000 || options.rows > 1000) {
      throw InputError("", "",
                       "a chessboard needs at least 3 x 3 inner corners, and two different numbers "
                       "of them, so that it shows which side is which");
    }
    return;
  }
  const std::vector<std::string> names = MarkerDictionaries();
  if (std::find(names.begin(), names.end(), options.markers) == names.end()) {
    std::string all;
    for (const std::string& name : names) all += (all.empty() ? "" : ", ") + name;
    throw InputError("", "", "there is no dictionary of markers '" + options.markers + "'",
                     "the dictionaries are " + all);
  }
}

}  // namespace

std::vector<std::string> MarkerDictionaries() {
  std::vector<std::string> names;
  for (const NamedDictionary& d : kDictionaries) names.emplace_back(d.name);
  return names;
}

TargetScale ScaleFromTargets(const TargetOptions& options, const Survey& survey,
                             const Control& control) {
  Check(options);
  TargetScale out;
  Targets targets(options, survey);
  const std::size_t n = survey.photographs.size();
  for (std::size_t i = 0; i < n; ++i) {
    control.ThrowIfStopped();
    control.Report("looking for targets", static_cast<double>(i) / static_cast<double>(n));
    targets.Look(survey, i, &out);
  }
  targets.Measure(&out);
  if (out.lengths == 0) {
    throw InputError("", "",
                     out.photographs == 0
                         ? "no photograph shows such a target"
                         : std::to_string(out.photographs) +
                               " photographs show targets, but no two of them the same one from "
                               "different places",
                     "check kind and size, or give two points: --distance P1 P2 METRES");
  }
  control.Report("targets measured", 1);
  return out;
}

}  // namespace sherd
