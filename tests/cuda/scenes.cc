#include "scenes.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

#include "datasets_synthetic/peer_scenes.h"
#include "datasets_synthetic/random.h"
#include "datasets_synthetic/stiff_cases.h"
#include "metaball/cloud.h"
#include "metaball/density/shapes.h"

namespace sherd {
CloudInput MakeBall(int count, double radius, double spread, int channels, std::uint64_t seed,
                    double threshold) {
  synthetic::Rng random(seed);
  CloudInput input;
  input.uniform_radius = radius;
  while (static_cast<int>(input.center.size()) < count) {
    const Vec3d p{random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1)};
    if (Dot(p, p) > 1) continue;
    input.center.push_back(p);
    if (channels & kOwnRadius) input.radius.push_back(radius * std::pow(spread, -random.Uniform()));
    if (channels & kOwnColor)
      input.color.push_back({static_cast<std::uint8_t>(random.Index(256)),
                             static_cast<std::uint8_t>(random.Index(256)),
                             static_cast<std::uint8_t>(random.Index(256))});
    if (channels & kOwnThreshold) input.threshold.push_back(threshold * random.Uniform(0.6, 1.4));
  }
  return input;
}

namespace {

constexpr double kDegree = std::numbers::pi / 180;

constexpr int kRadius = kOwnRadius, kColor = kOwnColor, kThreshold = kOwnThreshold;

class Builder {
 public:
  Builder(std::uint64_t count, int width, int height)
      : count_(count), width_(width), height_(height) {}

  std::vector<CheckScene> Make() {
    Peers();
    FewMetaballs();
    Radii();
    Cameras();
    Thresholds();
    Densities();
    Stiff();
    return std::move(scenes_);
  }

 private:
  CheckScene& Add(std::string name, Scene scene, const Camera& camera) {
    scenes_.push_back({std::move(name), std::move(scene), camera});
    return scenes_.back();
  }
  Camera Front(double distance = 4) const {
    return Camera::LookAt({0.3, 0.5, -distance}, {0, 0, 0}, {0, 1, 0}, 50 * kDegree, width_,
                          height_);
  }

  void Peers() {
    const PeerScene field = MakeHeightField(count_, width_, height_);
    const PeerScene shell = MakeShell(count_, width_, height_);
    Add("height_field", field.scene, field.camera);
    Add("shell", shell.scene, shell.camera);
    Add("height_field_supersampled", field.scene, field.camera.Resized(width_ / 3, height_ / 3))
        .supersample = 3;
    // Many more metaballs over each pixel than a ray's column holds.
    Scene thick = shell.scene;
    thick.surface.radius_scale = 3;
    Add("shell_three_times_the_radius", thick, shell.camera.Resized(width_ / 2, height_ / 2));
    // From far above, metaballs a fraction of a pixel wide: long lists in few tiles.
    const Camera far = Camera::LookAt({0.5, 20, 0.5}, {0.5, 0, 0.5}, {0, 0, 1}, 12 * kDegree,
                                      width_ / 4, height_ / 4);
    Add("height_field_metaballs_below_a_pixel", field.scene, far).depth_tolerance = 3e-4;
  }

  void FewMetaballs() {
    Add("empty", SceneOf({}), Front());
    CloudInput one;
    one.center = {{0, 0, 0}};
    one.uniform_radius = 1;
    Add("one", SceneOf(one), Front());
    Add("one_low_threshold", SceneOf(one, 1e-6), Front());
    Add("one_high_threshold", SceneOf(one, 0.999), Front());
    Add("threshold_above_the_field", SceneOf(one, 1.0001), Front());
    Add("behind_the_camera", SceneOf(one),
        Camera::LookAt({0, 0, 4}, {0, 0, 8}, {0, 1, 0}, 1, width_, height_));
    CloudInput two;
    two.center = {{-0.55, 0, 0}, {0.55, 0.1, 0.2}};
    two.radius = {1, 0.8};
    two.color = {{250, 20, 30}, {20, 40, 250}};
    Add("two", SceneOf(two, 0.3), Front());
    Scene unlit = SceneOf(two, 0.3);
    unlit.lighting.unlit = true;
    Add("two_unlit", unlit, Front());
    CloudInput row;
    for (int i = 0; i < 1000; ++i) row.center.push_back({0, 0, i * 0.01});
    row.uniform_radius = 0.02;
    Add("along_a_row", SceneOf(row), Camera::LookAt({0, 0, -1}, {0, 0, 0}, {0, 1, 0}, 0.1, 65, 65));
  }

  void Radii() {
    Add("own_radii", SceneOf(MakeBall(2000, 0.3, 3, kRadius, 1)), Front());
    Add("own_radii_and_colours", SceneOf(MakeBall(2000, 0.3, 3, kRadius | kColor, 2)), Front());
    Add("own_colours", SceneOf(MakeBall(2000, 0.2, 1, kColor, 3)), Front());
    Add("neither", SceneOf(MakeBall(2000, 0.2, 1, 0, 4)), Front());
    Add("two_orders_of_radii", SceneOf(MakeBall(3000, 0.3, 90, kRadius, 6)), Front());
  }

  void Cameras() {
    const PeerScene field = MakeHeightField(count_, width_, height_);
    Add("orthographic", field.scene,
        Camera::LookAtOrthographic({0.5, 2, 0.5}, {0.5, 0, 0.5}, {0, 0, 1}, 1.2, width_, height_));
    Add("orthographic_oblique", field.scene,
        Camera::LookAtOrthographic({-2, 3, -1}, {0.5, 0, 0.5}, {0, 1, 0}, 1.4, width_, height_));
    Add("grazing_view", field.scene,
        Camera::LookAt({0.5, 0.09, -0.2}, {0.5, 0.05, 0.5}, {0, 1, 0}, 60 * kDegree, width_,
                       height_));
    CloudInput one;
    one.center = {{0, 0, 0}};
    one.uniform_radius = 1;
    Add("inside_the_surface", SceneOf(one),
        Camera::LookAt({0.01, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1.0, 40, 30));
    Add("inside_the_support", SceneOf(MakeBall(500, 0.5, 3, kRadius, 8)),
        Camera::LookAt({0, 0, -1.4}, {0, 0.2, 0}, {0, 1, 0}, 1.5, width_ / 2, height_ / 2));
    CloudInput hollow = MakeBall(4000, 0.12, 1, kColor, 9);
    for (Vec3d& p : hollow.center) p = Normalized(p);
    Add("inside_a_hollow", SceneOf(hollow),
        Camera::LookAt({0, 0, 0}, {0.3, 0.2, 1}, {0, 1, 0}, 2.0, width_ / 2, height_ / 2));
    Add("wide_angle", SceneOf(hollow),
        Camera::LookAt({0, 0, -1.11}, {0, 0, 1}, {0, 1, 0}, 160 * kDegree, width_ / 2,
                       height_ / 2));
    CheckScene& far =
        Add("camera_ten_thousand_radii_away", SceneOf(MakeBall(500, 0.3, 2, kRadius, 10)),
            Camera::LookAt({0, 0, -3e3}, {0, 0, 0}, {0, 1, 0}, 1e-3, width_ / 2, height_ / 2));
    far.depth_tolerance = 2e-3;  // the float depth plane's steps at 3000 are 2.4e-4, r is 0.15..0.3
    for (const auto& [w, h] : {std::pair{50, 1}, {1, 50}}) {
      Add("picture_of_" + std::to_string(w) + "x" + std::to_string(h),
          SceneOf(MakeBall(500, 0.3, 2, kRadius, 11)),
          Camera::LookAt({0, 0, -4}, {0, 0, 0}, {0, 1, 0}, 0.6, w, h));
    }
  }

  void Thresholds() {
    using enum ThresholdMode;
    const auto add = [&](const std::string& name, CloudInput input, ThresholdMode mode) {
      Scene scene = SceneOf(input);
      scene.surface.mode = mode;
      Add(name, std::move(scene), Front());
    };
    constexpr int kAll = kRadius | kColor | kThreshold;
    add("blended_thresholds", MakeBall(2000, 0.3, 3, kAll, 12), kBlended);
    add("blended_thresholds_one_radius_and_colour", MakeBall(2000, 0.2, 1, kThreshold, 13),
        kBlended);
    add("blended_without_own_thresholds", MakeBall(2000, 0.3, 3, kRadius | kColor, 14), kBlended);
    add("blended_thresholds_many_over_each_pixel", MakeBall(4000, 0.6, 2, kAll, 15), kBlended);
    // So many that a ray in floats sums them up in doubles.
    add("blended_thresholds_a_thousand_over_each_pixel", MakeBall(4000, 1.2, 1.5, kAll, 16),
        kBlended);
    add("blended_thresholds_two_orders_of_radii", MakeBall(2000, 0.3, 150, kAll, 17), kBlended);
    add("gated_thresholds", MakeBall(2000, 0.3, 3, kAll, 18), kGated);
    add("gated_without_own_thresholds", MakeBall(2000, 0.3, 3, kRadius | kColor, 19), kGated);
  }

  void Densities() {
    using enum ThresholdMode;
    for (const ThresholdMode mode : {kUniform, kBlended, kSummed, kGated}) {
      for (const DensityModel& density : AllDensities()) {
        if (mode == kBlended && !IsNonNegative(density)) continue;
        const double threshold = (mode == kSummed ? 0.02 : 0.5) * std::min(PeakOf(density), 5.0);
        Scene scene =
            SceneOf(MakeBall(400, 0.3, 4, kRadius | kColor | kThreshold, 20, threshold), threshold);
        scene.surface.density = density;
        scene.surface.mode = mode;
        const DensityShape shape = ResolveDensity(density).shape;
        CheckScene& added = Add(NameOf(mode) + "_" + TextOf(density), std::move(scene),
                                Front().Resized(width_ / 2, height_ / 2));
        added.creased = std::abs(ShapeSlope(shape, 1 - 1e-9)) >= 1e-3;
        added.jumps = mode == kSummed;
      }
    }
  }

  // The table of stiff cases, where it is the reference's picture that must come out.
  void Stiff() {
    for (StiffCase& stiff : MakeStiffCases()) {
      if (stiff.expect != StiffCase::Expect::kReference) continue;
      CheckScene& scene = Add(stiff.name, std::move(stiff.scene), stiff.camera);
      scene.depth_tolerance = stiff.depth_tolerance;
      scene.normal_tolerance_deg = stiff.normal_tolerance_deg;
    }
  }

  std::uint64_t count_;
  int width_, height_;
  std::vector<CheckScene> scenes_;
};

}  // namespace

std::string WhyOff(const CheckScene& scene, const Frame& frame, const FrameDifference& d) {
  const bool depths_jump = scene.jumps && (scene.creased || frame.stats.grazing > 0);
  if (frame.stats.unresolved != 0) return "rays were given up";
  if (d.missed != 0 || d.invented != 0) return "pixels are missed or invented";
  if ((depths_jump ? d.depth_p99 : d.depth_max) > scene.depth_tolerance) return "depths are off";
  const std::uint64_t rim_pixels = scene.creased ? d.pixels / 1000 : 0;
  if (!(scene.jumps && scene.creased) && d.color_off > rim_pixels) return "colours are off";
  if (!scene.creased && !scene.jumps && d.normal_max_deg > scene.normal_tolerance_deg) {
    return "normals are off";
  }
  return "";
}

std::vector<CheckScene> MakeCheckScenes(std::uint64_t count, int width, int height) {
  return Builder(count, width, height).Make();
}

}  // namespace sherd
