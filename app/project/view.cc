#include "app/project/view.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>

#include "app/project/format.h"
#include "app/project/settings.h"
#include "metaball/error.h"
#include "reconstruction/photographs.h"

namespace sherd {
namespace {

constexpr double kMargin = 0.94;  // the share of the picture that the bounds fill

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

std::array<Vec3d, 8> CornersFromCenter(const Box3d& box) {
  Vec3d half = (box.max - box.min) * 0.5;
  if (!(Length(half) > 0)) half = {0.5, 0.5, 0.5};  // one point: a unit around it
  std::array<Vec3d, 8> corners;
  for (int i = 0; i < 8; ++i) {
    corners[static_cast<std::size_t>(i)] = {i & 1 ? half.x : -half.x, i & 2 ? half.y : -half.y,
                                            i & 4 ? half.z : -half.z};
  }
  return corners;
}

// A camera that looks along `forward` and shows all of `box`.
Camera FitBox(const Box3d& box, const Vec3d& forward, const Vec3d& up, const ViewRequest& request,
              int width, int height) {
  const Vec3d center = box.Center();
  const std::array<Vec3d, 8> corners = CornersFromCenter(box);
  const double radius = Length(corners[7]);
  if (request.ortho_width || request.orthographic) {
    const Vec3d eye = center - forward * (1.5 * radius);
    if (request.ortho_width) {
      return Camera::LookAtOrthographic(eye, center, up, *request.ortho_width, width, height);
    }
    const Camera axes = Camera::LookAtOrthographic(eye, center, up, 1.0, width, height);
    double half_x = 0, half_y = 0;
    for (const Vec3d& c : corners) {
      half_x = std::max(half_x, std::abs(Dot(c, axes.right)));
      half_y = std::max(half_y, std::abs(Dot(c, axes.down)));
    }
    const double ortho_width = 2 * std::max(half_x, half_y * width / height) / kMargin;
    return Camera::LookAtOrthographic(eye, center, up, ortho_width, width, height);
  }
  const double fov_deg = request.fov_x_deg.value_or(Setting("fov-x").fallback);
  const double fov = fov_deg * std::numbers::pi / 180;
  Camera camera = Camera::LookAt(center - forward, center, up, fov, width, height);
  double distance = 0.01 * radius;
  for (const Vec3d& c : corners) {
    const double behind = Dot(c, camera.forward);
    const double x = std::abs(Dot(c, camera.right)) * camera.fx / (0.5 * width * kMargin);
    const double y = std::abs(Dot(c, camera.down)) * camera.fy / (0.5 * height * kMargin);
    distance = std::max(distance, std::max(x, y) - behind);
  }
  camera.eye = center - camera.forward * distance;
  return camera;
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

PresetAxes AxesFor(const std::optional<Vec3d>& up, const std::optional<Vec3d>& front) {
  PresetAxes axes;
  if (up) axes.up = Normalized(*up);
  const Vec3d u = axes.up;
  Vec3d north{0, 1, 0};
  if (u.z > -1 + 1e-12) {
    // Rodrigues' turn about z x u = (-u.y, u.x, 0), applied to +y.
    const double k = 1 / (1 + u.z);
    north = {-u.x * u.y * k, 1 - u.y * u.y * k, -u.y};
  } else {
    north = {0, -1, 0};
  }
  if (front) {
    const Vec3d level = *front - u * Dot(*front, u);
    if (Length(level) > 1e-6 * Length(*front)) north = level;
  }
  axes.north = Normalized(north - u * Dot(north, u));
  axes.east = Cross(axes.north, u);
  return axes;
}

std::optional<Vec3d> EstimateFront(const std::vector<Photograph>& photographs,
                                   const std::optional<Vec3d>& up) {
  if (photographs.empty() || !up) return std::nullopt;
  const Vec3d u = Normalized(*up);
  constexpr double kOrientedCosine = 0.9994;  // within 2 degrees of +z
  if (u.z > kOrientedCosine) return std::nullopt;
  Vec3d sum{};
  for (const Photograph& photograph : photographs) {
    const Vec3d forward = photograph.cam_from_world.InverseRotate({0, 0, 1});
    sum += forward - u * Dot(forward, u);
  }
  const double agreement = Length(sum) / static_cast<double>(photographs.size());
  if (!(agreement > 0.3)) return std::nullopt;
  return Normalized(sum);
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
      Camera camera = FitBox(context.bounds, Normalized(look_at - *request.eye), axes.up, request,
                             width, height);
      return Camera::LookAtOrthographic(*request.eye, look_at, axes.up, width / camera.fx, width,
                                        height);
    }
    const double fov_deg = request.fov_x_deg.value_or(Setting("fov-x").fallback);
    return Camera::LookAt(*request.eye, look_at, axes.up, fov_deg * std::numbers::pi / 180, width,
                          height);
  }
  Vec3d forward = axes.north, up = axes.up;
  switch (request.preset) {
    case ViewPreset::kFront:
      break;
    case ViewPreset::kBack:
      forward = -axes.north;
      break;
    case ViewPreset::kLeft:
      forward = axes.east;
      break;
    case ViewPreset::kRight:
      forward = -axes.east;
      break;
    case ViewPreset::kTop:
      forward = -axes.up;
      up = axes.north;
      break;
    case ViewPreset::kBottom:
      forward = axes.up;
      up = axes.north;
      break;
    case ViewPreset::kIso:
      forward = Normalized(axes.north - axes.east - axes.up);
      break;
  }
  return FitBox(context.bounds, forward, up, request, width, height);
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
