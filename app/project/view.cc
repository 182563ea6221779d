#include "app/project/view.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>

#include "app/project/format.h"
#include "app/project/settings.h"
#include "metaball/error.h"
#include "reconstruction/photographs.h"

namespace sherd {
namespace {

constexpr double kMargin = 0.9;  // the share of the picture that the subject fills

std::string Lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

std::string WithoutExtension(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  const std::size_t slash = name.rfind('/');
  return dot == std::string::npos || (slash != std::string::npos && dot < slash)
             ? name
             : name.substr(0, dot);
}

// `end` is the whole of `name` or what follows one of its slashes, with or without extension.
bool EndsAtSlash(const std::string& name, const std::string& end) {
  for (const std::string& candidate : {name, WithoutExtension(name)}) {
    if (candidate == end) return true;
    if (candidate.size() > end.size() && candidate.ends_with(end) &&
        candidate[candidate.size() - end.size() - 1] == '/') {
      return true;
    }
  }
  return false;
}

std::size_t EditDistance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row[b.size()];
}

// The three names nearest to `name`, as "a, b, c".
std::string NearNames(const Survey& survey, const std::string& name) {
  std::vector<std::pair<std::size_t, std::size_t>> ranked;
  const std::string wanted = Lower(name.substr(0, 200));
  for (std::size_t i = 0; i < survey.photographs.size(); ++i) {
    ranked.emplace_back(EditDistance(wanted, Lower(survey.photographs[i].name.substr(0, 200))), i);
  }
  const std::size_t n = std::min<std::size_t>(3, ranked.size());
  std::partial_sort(ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(n), ranked.end());
  std::string text;
  for (std::size_t i = 0; i < n; ++i) {
    text += (i ? ", " : "") + survey.photographs[ranked[i].second].name;
  }
  return text;
}

// What a fitted view has to show: the sample, or the corners of the box.
std::vector<Vec3d> SubjectOf(const ViewContext& context) {
  if (!context.points.empty()) return context.points;
  const Box3d& box = context.bounds;
  const Vec3d center = box.Center();
  Vec3d half = (box.max - box.min) * 0.5;
  if (!(Length(half) > 0)) half = {0.5, 0.5, 0.5};  // one point: a unit around it
  std::vector<Vec3d> corners;
  for (int i = 0; i < 8; ++i) {
    corners.push_back(center + Vec3d{i & 1 ? half.x : -half.x, i & 2 ? half.y : -half.y,
                                     i & 4 ? half.z : -half.z});
  }
  return corners;
}

// The extremes but for a few of a large sample, which may be strays: a share so small that a corner
// of the survey stays inside.
double Quantile(std::vector<double>* values, double share) {
  const std::size_t n = values->size();
  const std::size_t cut = n / 4000;
  const std::size_t k = share > 0.5 ? n - 1 - cut : cut;
  std::nth_element(values->begin(), values->begin() + static_cast<std::ptrdiff_t>(k),
                   values->end());
  return (*values)[k];
}

struct Range {
  double lo = 0, hi = 0;
  double middle() const { return 0.5 * (lo + hi); }
  double length() const { return hi - lo; }
};

// Extent of the subject along an axis.
Range ExtentAlong(const std::vector<Vec3d>& subject, const Vec3d& axis) {
  std::vector<double> values;
  values.reserve(subject.size());
  for (const Vec3d& p : subject) values.push_back(Dot(p, axis));
  Range range;
  range.lo = Quantile(&values, 0);
  range.hi = Quantile(&values, 1);
  return range;
}

// A camera that looks along `forward` and shows the subject.
Camera FitSubject(const ViewContext& context, const Vec3d& forward, const Vec3d& up,
                  const ViewRequest& request, int width, int height) {
  const std::vector<Vec3d> subject = SubjectOf(context);
  const Camera axes = Camera::LookAt({}, forward, up, 1.0, width, height);
  const Range x = ExtentAlong(subject, axes.right);
  const Range y = ExtentAlong(subject, axes.down);
  const Range z = ExtentAlong(subject, axes.forward);
  const Vec3d center = axes.right * x.middle() + axes.down * y.middle() + axes.forward * z.middle();
  // A subject without any extent (one point) is seen from one unit away.
  const double size = std::max({x.length(), y.length(), z.length()});
  const double reach = size > 0 ? size : 1.0;
  if (request.ortho_width || request.orthographic) {
    // Far enough away for stray points in front to be seen too.
    const Vec3d eye = center - axes.forward * (0.5 * z.length() + reach);
    double fitted = std::max(x.length(), y.length() * width / height) / kMargin;
    if (!(fitted > 0)) fitted = 2 * reach;
    return Camera::LookAtOrthographic(eye, center, up, request.ortho_width.value_or(fitted), width,
                                      height);
  }
  const double fov_deg = request.fov_x_deg.value_or(Setting("fov-x").fallback);
  const double fov = fov_deg * std::numbers::pi / 180;
  Camera camera = Camera::LookAt(center - axes.forward, center, up, fov, width, height);
  // For each point, how far before the centre the eye must be for the point to be in the picture.
  std::vector<double> needed;
  needed.reserve(subject.size());
  for (const Vec3d& p : subject) {
    const Vec3d v = p - center;
    const double px = std::abs(Dot(v, camera.right)) * camera.fx / (0.5 * width * kMargin);
    const double py = std::abs(Dot(v, camera.down)) * camera.fy / (0.5 * height * kMargin);
    needed.push_back(std::max(px, py) - Dot(v, camera.forward));
  }
  const double distance = std::max(Quantile(&needed, 1), 0.01 * reach);
  camera.eye = center - camera.forward * (size > 0 ? distance : reach);
  return camera;
}

struct Direction {
  Vec3d forward, up;
};

Direction DirectionOf(ViewPreset preset, const PresetAxes& axes) {
  switch (preset) {
    case ViewPreset::kFront:
      return {axes.north, axes.up};
    case ViewPreset::kBack:
      return {-axes.north, axes.up};
    case ViewPreset::kLeft:
      return {axes.east, axes.up};
    case ViewPreset::kRight:
      return {-axes.east, axes.up};
    case ViewPreset::kTop:
      return {-axes.up, axes.north};
    case ViewPreset::kBottom:
      return {axes.up, axes.north};
    case ViewPreset::kIso:
      break;
  }
  return {Normalized(axes.north - axes.east - axes.up), axes.up};
}

Camera PhotographCamera(const Survey& survey, const ViewRequest& request, int width, int height) {
  const std::size_t idx = FindPhotograph(survey, request.photo);
  if (!request.keep_photo_shape) return CameraOfPhotograph(survey, idx, width, height);
  Camera camera = CameraOfPhotograph(survey, idx);
  const double scale = std::min(static_cast<double>(width) / camera.width,
                                static_cast<double>(height) / camera.height);
  camera.fx *= scale;
  camera.fy *= scale;
  camera.cx = camera.cx * scale + 0.5 * (width - camera.width * scale);
  camera.cy = camera.cy * scale + 0.5 * (height - camera.height * scale);
  camera.width = width;
  camera.height = height;
  return camera;
}

}  // namespace

const std::vector<std::string>& ViewPresetNames() {
  static const std::vector<std::string> names = {"front", "back",   "left", "right",
                                                 "top",   "bottom", "iso"};
  return names;
}

ViewPreset ParseViewPreset(const std::string& name) {
  const auto& names = ViewPresetNames();
  const auto it = std::find(names.begin(), names.end(), name);
  if (it == names.end()) {
    std::string all;
    for (const std::string& n : names) all += (all.empty() ? "" : ", ") + n;
    throw InputError("", "", "no view is called \"" + name + "\"", "the views are " + all);
  }
  return static_cast<ViewPreset>(it - names.begin());
}

std::size_t FindPhotograph(const Survey& survey, const std::string& name) {
  const auto& photographs = survey.photographs;
  for (std::size_t i = 0; i < photographs.size(); ++i) {
    if (photographs[i].name == name) return i;
  }
  // From the strictest reading to the loosest; the first that fits exactly one photograph wins.
  for (const bool ignore_case : {false, true}) {
    for (const bool at_slash : {true, false}) {
      std::vector<std::size_t> found;
      const std::string end = ignore_case ? Lower(name) : name;
      for (std::size_t i = 0; i < photographs.size() && !end.empty(); ++i) {
        const std::string full = ignore_case ? Lower(photographs[i].name) : photographs[i].name;
        if (at_slash ? EndsAtSlash(full, end)
                     : full.ends_with(end) || WithoutExtension(full).ends_with(end)) {
          found.push_back(i);
        }
      }
      if (found.size() == 1) return found[0];
      if (found.size() > 1) {
        std::string names;
        for (std::size_t i = 0; i < std::min<std::size_t>(3, found.size()); ++i) {
          names += (i ? ", " : "") + photographs[found[i]].name;
        }
        if (found.size() > 3) names += ", ...";
        throw InputError("", "",
                         std::to_string(found.size()) + " photographs are called \"" + name + "\"",
                         "give more of the name: " + names);
      }
    }
  }
  throw InputError("", "", "no photograph is called \"" + name + "\"",
                   photographs.empty() ? "there are no photographs here"
                                       : "near names: " + NearNames(survey, name));
}

Camera MakeCamera(const ViewContext& context, const ViewRequest& request, int width, int height) {
  if (!request.photo.empty()) {
    if (!context.survey) {
      throw InputError("", "", "a bare cloud has no photographs",
                       "give a view or an eye, or use a project");
    }
    return PhotographCamera(*context.survey, request, width, height);
  }
  const PresetAxes axes = AxesFor(request.up ? request.up : context.up, context.front);
  if (request.eye) {
    const Vec3d look_at = request.look_at.value_or(context.bounds.Center());
    if (request.ortho_width) {
      return Camera::LookAtOrthographic(*request.eye, look_at, axes.up, *request.ortho_width, width,
                                        height);
    }
    if (request.orthographic) {
      const Camera fitted =
          FitSubject(context, Normalized(look_at - *request.eye), axes.up, request, width, height);
      return Camera::LookAtOrthographic(*request.eye, look_at, axes.up, width / fitted.fx, width,
                                        height);
    }
    const double fov_deg = request.fov_x_deg.value_or(Setting("fov-x").fallback);
    return Camera::LookAt(*request.eye, look_at, axes.up, fov_deg * std::numbers::pi / 180, width,
                          height);
  }
  const Direction direction = DirectionOf(request.preset, axes);
  return FitSubject(context, direction.forward, direction.up, request, width, height);
}

std::vector<Vec3d> SamplePoints(const std::vector<Vec3d>& points, const Box3d& bounds,
                                std::size_t count) {
  const auto inside = [&bounds](const Vec3d& p) {
    return p.x >= bounds.min.x && p.x <= bounds.max.x && p.y >= bounds.min.y &&
           p.y <= bounds.max.y && p.z >= bounds.min.z && p.z <= bounds.max.z;
  };
  const auto n = static_cast<std::size_t>(std::count_if(points.begin(), points.end(), inside));
  std::vector<Vec3d> sample;
  sample.reserve(std::min(n, count));
  std::size_t seen = 0;
  for (const Vec3d& p : points) {
    if (!inside(p)) continue;
    // The k-th of `count` is the one at which k n / count is passed.
    if (n <= count || (seen * count) / n != ((seen + 1) * count) / n) sample.push_back(p);
    ++seen;
  }
  return sample;
}

double SubjectAspect(const ViewContext& context, const ViewRequest& request) {
  if (!request.photo.empty()) {
    if (!context.survey) return 1;
    const Camera camera =
        CameraOfPhotograph(*context.survey, FindPhotograph(*context.survey, request.photo));
    return static_cast<double>(camera.width) / camera.height;
  }
  if (request.eye) return 1;
  const PresetAxes axes = AxesFor(request.up ? request.up : context.up, context.front);
  const Direction direction = DirectionOf(request.preset, axes);
  const Camera camera = Camera::LookAt({}, direction.forward, direction.up, 1.0, 1, 1);
  const std::vector<Vec3d> subject = SubjectOf(context);
  const double width = ExtentAlong(subject, camera.right).length();
  const double height = ExtentAlong(subject, camera.down).length();
  return width > 0 && height > 0 ? width / height : 1;
}

std::string DescribeView(const ViewRequest& request) {
  if (!request.photo.empty()) return "photograph " + request.photo;
  const bool orthographic = request.orthographic || request.ortho_width;
  const std::string projection = orthographic ? "orthographic" : "perspective";
  if (request.eye) {
    const Vec3d& e = *request.eye;
    return "from (" + FormatNumber(e.x) + ", " + FormatNumber(e.y) + ", " + FormatNumber(e.z) +
           "), " + projection;
  }
  return ViewPresetNames()[static_cast<std::size_t>(request.preset)] + " view, " + projection;
}

}  // namespace sherd
