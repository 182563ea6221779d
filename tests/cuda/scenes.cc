#include "scenes.h"

#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

#include "datasets_synthetic/peer_scenes.h"
#include "metaball/cloud.h"

namespace sherd {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// The same numbers with every standard library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  double Signed() { return 2 * Unit() - 1; }
  double Unit() {
    state_ = state_ * 6364136223846793005ull + 1442695040888963407ull;
    return static_cast<double>(state_ >> 11) * 0x1p-53;
  }
  std::uint8_t Byte() { return static_cast<std::uint8_t>(255 * Unit()); }

 private:
  std::uint64_t state_;
};

enum Channels { kRadius = 1, kColor = 2 };

// Metaballs in a ball of radius 1, their radii spread geometrically over [radius / spread, radius].
CloudInput Ball(int count, double radius, double spread, int channels, std::uint64_t seed) {
  Random random(seed);
  CloudInput input;
  input.uniform_radius = radius;
  while (static_cast<int>(input.center.size()) < count) {
    const Vec3d p{random.Signed(), random.Signed(), random.Signed()};
    if (Dot(p, p) > 1) continue;
    input.center.push_back(p);
    if (channels & kRadius) input.radius.push_back(radius * std::pow(spread, -random.Unit()));
    if (channels & kColor) input.color.push_back({random.Byte(), random.Byte(), random.Byte()});
  }
  return input;
}

Scene SceneOf(const CloudInput& input, double threshold = 0.7) {
  Scene scene;
  scene.cloud = std::make_shared<Cloud>(BuildCloud(input));
  scene.surface.threshold = threshold;
  return scene;
}

class Builder {
 public:
  Builder(std::uint64_t count, int width, int height)
      : count_(count), width_(width), height_(height) {}

  std::vector<CheckScene> Make() {
    Peers();
    FewMetaballs();
    Radii();
    Cameras();
    Extremes();
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

    // The same survey in coordinates of 1e7 metres.
    const Vec3d shift{5.0e5, 1.0e7, 300};
    Scene moved = field.scene;
    auto cloud = std::make_shared<Cloud>(*field.scene.cloud);
    cloud->frame.origin = cloud->frame.origin + shift;
    moved.cloud = cloud;
    Camera camera = field.camera;
    camera.eye = camera.eye + shift;
    Add("coordinates_of_1e7", moved, camera);
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
    Add("own_radii", SceneOf(Ball(2000, 0.3, 3, kRadius, 1)), Front());
    Add("own_radii_and_colours", SceneOf(Ball(2000, 0.3, 3, kRadius | kColor, 2)), Front());
    Add("own_colours", SceneOf(Ball(2000, 0.2, 1, kColor, 3)), Front());
    Add("neither", SceneOf(Ball(2000, 0.2, 1, 0, 4)), Front());
    Add("six_orders_of_radii", SceneOf(Ball(3000, 0.5, 1e6, kRadius | kColor, 5)), Front());
    Add("two_orders_of_radii", SceneOf(Ball(3000, 0.3, 90, kRadius, 6)), Front());

    // Metaballs a thousandth and a millionth as large on a large one's surface, seen from near: the
    // large one's field counts to the accuracy of the small ones.
    for (const double small : {1e-3, 1e-6}) {
      CloudInput input;
      Random random(7);
      const double surface = std::sqrt(1 - std::sqrt(0.7));  // where the large one alone crosses
      input.center.push_back({0, 0, 0});
      input.radius.push_back(1);
      for (int i = 0; i < 60; ++i) {
        input.center.push_back({8 * small * random.Signed(), 8 * small * random.Signed(),
                                -surface - 1.5 * small * random.Unit()});
        input.radius.push_back(small * (1 + random.Unit()));
      }
      const Camera camera = Camera::LookAt({0, 3 * small, -surface - 20 * small}, {0, 0, -surface},
                                           {0, 1, 0}, 50 * kDegree, width_ / 2, height_ / 2);
      // A cloud's centres are floats of its own frame, to which the camera is as near as to the
      // small metaballs: what is compared is the same field.
      Add(small == 1e-3 ? "small_on_large_1e-3" : "small_on_large_1e-6", SceneOf(input), camera)
          .beyond_floats = small < 1e-5;
    }
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
    Add("inside_the_support", SceneOf(Ball(500, 0.5, 3, kRadius, 8)),
        Camera::LookAt({0, 0, -1.4}, {0, 0.2, 0}, {0, 1, 0}, 1.5, width_ / 2, height_ / 2));
    CloudInput hollow = Ball(4000, 0.12, 1, kColor, 9);
    for (Vec3d& p : hollow.center) p = Normalized(p);
    Add("inside_a_hollow", SceneOf(hollow),
        Camera::LookAt({0, 0, 0}, {0.3, 0.2, 1}, {0, 1, 0}, 2.0, width_ / 2, height_ / 2));
    Add("wide_angle", SceneOf(hollow),
        Camera::LookAt({0, 0, -1.11}, {0, 0, 1}, {0, 1, 0}, 160 * kDegree, width_ / 2,
                       height_ / 2));
    CheckScene& far =
        Add("camera_ten_thousand_radii_away", SceneOf(Ball(500, 0.3, 2, kRadius, 10)),
            Camera::LookAt({0, 0, -3e3}, {0, 0, 0}, {0, 1, 0}, 1e-3, width_ / 2, height_ / 2));
    far.depth_tolerance = 2e-3;  // the float depth plane's steps at 3000 are 2.4e-4, r is 0.15..0.3
    for (const auto& [w, h] : {std::pair{1, 1}, {1, 50}, {17, 31}}) {
      Add("picture_of_" + std::to_string(w) + "x" + std::to_string(h),
          SceneOf(Ball(500, 0.3, 2, kRadius, 11)),
          Camera::LookAt({0, 0, -4}, {0, 0, 0}, {0, 1, 0}, 0.6, w, h));
    }
  }

  void Extremes() {
    CloudInput coincident;
    coincident.center.assign(1000, {0.1, 0.2, 0.3});
    coincident.uniform_radius = 1;
    Add("a_thousand_at_one_place", SceneOf(coincident), Front().Resized(48, 32));
    CloudInput cell;
    Random random(12);
    cell.center.push_back({1, 1, 1});  // gives the scene its extent
    for (int i = 0; i < 5000; ++i) {
      cell.center.push_back(
          {1e-4 * random.Signed(), 1e-4 * random.Signed(), 1e-4 * random.Signed()});
    }
    cell.uniform_radius = 0.3;
    Add("five_thousand_in_one_cell", SceneOf(cell, 100), Front().Resized(24, 16));
    // A rise of the field just above and just below the threshold between two metaballs.
    for (const double factor : {0.999, 1.001}) {
      CloudInput pair;
      pair.center = {{-0.7, 0, 0}, {0.7, 0, 0}};
      pair.uniform_radius = 1;
      const double q = 1 - 0.49;
      Add(factor < 1 ? "bridge_just_there" : "bridge_just_broken",
          SceneOf(pair, 2 * q * q * factor), Front());
    }
  }

  std::uint64_t count_;
  int width_, height_;
  std::vector<CheckScene> scenes_;
};

}  // namespace

std::vector<CheckScene> MakeCheckScenes(std::uint64_t count, int width, int height) {
  return Builder(count, width, height).Make();
}

}  // namespace sherd
