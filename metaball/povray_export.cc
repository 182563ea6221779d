#include "metaball/povray_export.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "metaball/atomic_file.h"
#include "metaball/error.h"

namespace sherd {
namespace {

constexpr std::size_t kBufferBytes = 1 << 20;
// Coordinates beyond this many times the cloud's own extent are written relative to its middle.
constexpr double kFar = 100.0;

// Collects text and passes it on in large pieces. Numbers never ask the locale.
class Writer {
 public:
  explicit Writer(const std::string& path) : file_(path) {}

  Writer& operator<<(std::string_view text) {
    text_ += text;
    if (text_.size() >= kBufferBytes) Flush();
    return *this;
  }
  Writer& operator<<(double value) {
    char buffer[32];
    const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
    return *this << std::string_view(buffer, static_cast<std::size_t>(end - buffer));
  }
  Writer& operator<<(float value) {
    char buffer[32];
    const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
    return *this << std::string_view(buffer, static_cast<std::size_t>(end - buffer));
  }
  template <class T>
  Writer& operator<<(const Vec3<T>& v) {
    return *this << "<" << v.x << "," << v.y << "," << v.z << ">";
  }
  void Commit() {
    Flush();
    file_.Commit();
  }

 private:
  void Flush() {
    file_.Write(text_.data(), text_.size());
    text_.clear();
  }
  AtomicFile file_;
  std::string text_;
};

// What the components of a blob are made of. Throws Error where the surface is no blob.
ResolvedDensity BlobDensity(const Surface& surface, const Cloud& cloud) {
  const ResolvedDensity density = ResolveDensity(surface.density);
  if (density.shape != DensityShape{ShapeKind::kPower, 2}) {
    throw Error("the density " + TextOf(surface.density) +
                " cannot be written for POV-Ray, whose blob has Murakami's alone; choose the "
                "density murakami, or export a mesh (.ply, .obj)");
  }
  const bool one_threshold =
      cloud.threshold.empty() || std::all_of(cloud.threshold.begin(), cloud.threshold.end(),
                                             [&](float t) { return t == cloud.threshold[0]; });
  const bool uniform = surface.mode == ThresholdMode::kUniform ||
                       (surface.mode == ThresholdMode::kBlended && one_threshold);
  if (!uniform) {
    throw Error(
        "thresholds of the metaballs' own cannot be written for POV-Ray, whose blob has one for "
        "all; choose the uniform threshold, or export a mesh (.ply, .obj)");
  }
  return density;
}

double ThresholdOf(const Surface& surface, const Cloud& cloud) {
  const bool own = surface.mode == ThresholdMode::kBlended && !cloud.threshold.empty();
  return own ? cloud.threshold[0] : surface.threshold;
}

// Direction, right and up span the picture from its middle, so any principal point and any ratio of
// the focal lengths can be said; their handedness is the camera's.
void WriteCamera(const Camera& camera, const Vec3d& origin, Writer* out) {
  const double x = (0.5 * camera.width - camera.cx) / camera.fx;
  const double y = (0.5 * camera.height - camera.cy) / camera.fy;
  const Vec3d middle = camera.right * x + camera.down * y;
  const bool orthographic = camera.projection == Projection::kOrthographic;
  Vec3d location = camera.eye - origin, direction = camera.forward;
  (orthographic ? location : direction) += middle;
  *out << "camera { " << (orthographic ? "orthographic" : "perspective") << "\n  location "
       << location << "\n  direction " << direction << "\n  right "
       << camera.right * (camera.width / camera.fx) << "\n  up "
       << camera.down * (-camera.height / camera.fy) << "\n}\n";
}

// `reach`: farther than anything from the eye.
void WriteLight(const Lighting& light, const Camera& camera, const Vec3d& origin, double reach,
                Writer* out) {
  const double ambient = light.unlit ? 1.0 : light.ambient;
  const double diffuse = light.unlit ? 0.0 : light.diffuse;
  *out << "#default { finish { ambient " << ambient << " diffuse " << diffuse << " } }\n";
  if (light.unlit) return;
  const Vec3d eye = camera.eye - origin;
  if (light.headlight && camera.projection == Projection::kPerspective) {
    *out << "light_source { " << eye << " rgb 1 shadowless }\n";
    return;
  }
  const Vec3d to_light = light.headlight ? -camera.forward : Normalized(light.to_light);
  *out << "light_source { " << eye + to_light * reach << " rgb 1 parallel point_at " << eye
       << " shadowless }\n";
}

}  // namespace

void WritePovRay(const std::string& path, const Scene& scene, const Camera& camera) {
  const Cloud& cloud = *scene.cloud;
  const Surface& surface = scene.surface;
  const ResolvedDensity density = BlobDensity(surface, cloud);
  const LocalFrame& frame = cloud.frame;
  const bool far = Length(frame.origin) > kFar * frame.unit;
  const Vec3d origin = far ? frame.origin : Vec3d{};
  double reach = Length(camera.eye - frame.origin) + 4 * frame.unit;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    reach = std::max(reach, 2 * frame.unit * cloud.RadiusOf(i) * surface.radius_scale);
  }

  Writer out(path);
  out << "// A metaball surface for POV-Ray 3.7. Linear light: povray File_Gamma=1.0 +W"
      << static_cast<double>(camera.width) << " +H" << static_cast<double>(camera.height) << "\n";
  if (far) out << "// Coordinates are relative to " << origin << ".\n";
  out << "#version 3.7;\nglobal_settings { assumed_gamma 1.0 ambient_light rgb 1 }\n"
      << "background { rgb 0 }\n";
  WriteCamera(camera, origin, &out);
  WriteLight(scene.lighting, camera, origin, reach, &out);
  if (cloud.empty()) {  // a blob without components is an error there
    out.Commit();
    return;
  }
  const double scale = density.support * surface.radius_scale * frame.unit;
  out << "blob { threshold " << ThresholdOf(surface, cloud) << "\n";
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    out << "sphere { " << (frame.origin - origin) + frame.unit * cloud.center[i].cast<double>()
        << "," << cloud.RadiusOf(i) * scale << "," << density.amplitude
        << " texture { pigment { color rgb " << LinearFromRgb8(cloud.ColorOf(i)) << " } } }\n";
  }
  out << "}\n";
  out.Commit();
}

}  // namespace sherd
