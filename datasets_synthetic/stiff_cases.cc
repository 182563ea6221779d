#include "datasets_synthetic/stiff_cases.h"

#include <cmath>
#include <memory>
#include <numbers>
#include <utility>

#include "datasets_synthetic/peer_scenes.h"
#include "datasets_synthetic/random.h"
#include "metaball/cloud.h"
#include "metaball/error.h"

namespace sherd {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
// Where a lone Murakami metaball of radius 1 crosses 0.7.
const double kSurfaceRadius = std::sqrt(1 - std::sqrt(0.7));

// Where densities end with a slope the normal has a step at every rim, and rounding says on which
// side of it a hit lies.
constexpr double kAtARim = 45;

// Metaballs in a ball of radius 1, their radii spread geometrically over [radius / spread, radius].
CloudInput Ball(int count, double radius, double spread, std::uint64_t seed) {
  synthetic::Rng random(seed);
  CloudInput input;
  while (static_cast<int>(input.center.size()) < count) {
    const Vec3d p{random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1)};
    if (Dot(p, p) > 1) continue;
    input.center.push_back(p);
    input.radius.push_back(radius * std::pow(spread, -random.Uniform()));
    const std::uint8_t r = static_cast<std::uint8_t>(random.Index(256)),
                       g = static_cast<std::uint8_t>(random.Index(256)),
                       b = static_cast<std::uint8_t>(random.Index(256));
    input.color.push_back({r, g, b});
  }
  return input;
}

CloudInput One(double radius = 1) {
  CloudInput input;
  input.center = {{0, 0, 0}};
  input.uniform_radius = radius;
  return input;
}

Scene With(Scene scene, const char* density) {
  scene.surface.density = ParseDensity(density);
  return scene;
}

Camera Front(int width = 96, int height = 64, double distance = 4) {
  return Camera::LookAt({0.3, 0.5, -distance}, {0, 0, 0}, {0, 1, 0}, 50 * kDegree, width, height);
}

class Table {
 public:
  std::vector<StiffCase> Make() {
    Densities();
    Thresholds();
    Radii();
    Crowds();
    Coordinates();
    Rays();
    Counts();
    BadValues();
    Pictures();
    for (StiffCase& stiff : cases_) {
      if (stiff.metaballs == 0 && stiff.scene.cloud) stiff.metaballs = stiff.scene.cloud->size();
    }
    return std::move(cases_);
  }

 private:
  StiffCase& Add(std::string name, std::string expects, Scene scene, const Camera& camera) {
    StiffCase stiff;
    stiff.name = std::move(name);
    stiff.expects = std::move(expects);
    stiff.scene = std::move(scene);
    stiff.camera = camera;
    cases_.push_back(std::move(stiff));
    return cases_.back();
  }

  void Densities() {
    Add("exponent_16", "the reference's picture",
        With(SceneOf(Ball(1500, 0.4, 3, 1), 0.5), "power:16"), Front());
    Add("blinn_1e4", "the reference's picture: supports of 0.037 radii",
        With(SceneOf(Ball(1500, 6, 3, 2), 0.5), "blinn:10000,1"), Front());
    Add("negative_lobes", "the reference's picture: the field falls below 0 and rises again",
        With(SceneOf(Ball(1500, 0.3, 3, 3), 0.6), "trigonometric:7.853981633974483,1"), Front())
        .normal_tolerance_deg = kAtARim;
    Add("negative_at_the_rim", "the reference's picture: every support ends in a negative lobe",
        With(SceneOf(Ball(800, 0.3, 3, 4), 0.6), "trigonometric:5,1"), Front())
        .normal_tolerance_deg = kAtARim;
    Add("singular_centre", "the reference's picture: spheres of a thirtieth of the radius",
        With(SceneOf(Ball(60, 0.3, 1, 5), 30), "reciprocal"), Front())
        .normal_tolerance_deg = kAtARim;
  }

  void Thresholds() {
    Add("threshold_1e-6", "the reference's picture: the surface of the supports",
        SceneOf(Ball(300, 0.3, 3, 6), 1e-6), Front());
    Add("threshold_just_under_the_highest", "the reference's picture: a sphere of 7e-4 radii",
        SceneOf(One(), 1 - 1e-6), Camera::LookAt({0, 0, -0.01}, {0, 0, 0}, {0, 1, 0}, 0.25, 64, 48))
        .normal_tolerance_deg = 2.0;  // 2^-24 of the field against the 1e-6 that are left of it
    Add("threshold_above_the_highest", "nothing", SceneOf(One(), 1.0001), Front()).expect =
        StiffCase::Expect::kNothing;
    CloudInput input = Ball(800, 0.3, 3, 7);
    synthetic::Rng random(8);
    for (std::size_t i = 0; i < input.center.size(); ++i) {
      input.threshold.push_back(std::pow(10, -6 * random.Uniform()));
    }
    Scene blended = SceneOf(input);
    blended.surface.mode = ThresholdMode::kBlended;
    Add("thresholds_1e-6_to_1_blended", "the reference's picture", blended, Front());
  }

  void Radii() {
    Add("radii_over_six_orders", "the reference's picture", SceneOf(Ball(3000, 0.5, 1e6, 9)),
        Front());
    for (const double small : {1e-3, 1e-6}) {
      // On a large one's surface, seen from near: its field counts to the accuracy of the small
      // ones.
      CloudInput input = One();
      input.radius = {1};
      synthetic::Rng random(10);
      for (int i = 0; i < 60; ++i) {
        input.center.push_back({8 * small * random.Uniform(-1, 1),
                                8 * small * random.Uniform(-1, 1),
                                -kSurfaceRadius - 1.5 * small * random.Uniform()});
        input.radius.push_back(small * (1 + random.Uniform()));
      }
      Add(small == 1e-3 ? "small_on_large_1e-3" : "small_on_large_1e-6", "the reference's picture",
          SceneOf(input),
          Camera::LookAt({0, 3 * small, -kSurfaceRadius - 20 * small}, {0, 0, -kSurfaceRadius},
                         {0, 1, 0}, 50 * kDegree, 64, 48));
    }
    for (const double scale : {1e-310, 1e-300, 1e150, 1e300}) {
      StiffCase& stiff =
          Add(scale < 1e-305  ? "denormal_radius"
              : scale < 1     ? "radius_1e-300"
              : scale < 1e200 ? "radius_1e150"
                              : "radius_1e300",
              "the reference's picture: the same as at radius 1", SceneOf(One(scale)),
              Camera::LookAt({0, 0, -3 * scale}, {0, 0, 0}, {0, 1, 0}, 1.0, 33, 33));
      stiff.depth_tolerance = kInfinity;  // a float cannot hold it; the normals tell
    }
  }

  void Crowds() {
    CloudInput same = One();
    same.center.assign(10000, {0.1, 0.2, 0.3});
    Add("1e4_at_one_place", "the reference's picture: a field 1e4 times as strong", SceneOf(same),
        Front(15, 10));
    CloudInput cell;
    synthetic::Rng random(11);
    cell.center.push_back({1, 1, 1});  // gives the scene its extent
    for (int i = 0; i < 100000; ++i) {
      cell.center.push_back({1e-4 * random.Uniform(-1, 1), 1e-4 * random.Uniform(-1, 1),
                             1e-4 * random.Uniform(-1, 1)});
    }
    cell.uniform_radius = 1.0;
    Add("1e5_in_one_cell", "the reference's picture", SceneOf(cell, 2e4), Front(4, 3));
    // Near the top of the sum, where it is flat: what rounding takes from the sum moves the surface
    // ten times as far.
    const auto near = [](const Vec3d& at, int width, int height) {
      return Camera::LookAt(at + Vec3d{0.01, 0.02, -0.1}, at, {0, 1, 0}, 0.6, width, height);
    };
    Add("1e4_at_one_place_near_the_top", "the reference's picture", SceneOf(same, 0.999e4),
        near({0.1, 0.2, 0.3}, 9, 6));
    Add("1e5_in_one_cell_near_the_top", "the reference's picture", SceneOf(cell, 0.999e5),
        near({0, 0, 0}, 4, 3));
    for (int i = 0; i < 10000; ++i) same.threshold.push_back(0.999e4 * (1 + 1e-4 * (i % 7 - 3)));
    Scene blended = SceneOf(same);
    blended.surface.mode = ThresholdMode::kBlended;
    Add("1e4_at_one_place_blended", "the reference's picture", blended,
        near({0.1, 0.2, 0.3}, 9, 6));
  }

  void Coordinates() {
    const PeerScene field = MakeHeightField(4000, 96, 54);
    const Vec3d shift{5.0e5, 1.0e7, 300};
    Scene moved = field.scene;
    auto cloud = std::make_shared<Cloud>(*field.scene.cloud);
    cloud->frame.origin = cloud->frame.origin + shift;
    moved.cloud = cloud;
    Camera camera = field.camera;
    camera.eye = camera.eye + shift;
    Add("coordinates_of_1e7", "the reference's picture", moved, camera);
    Add("camera_a_million_radii_away", "the reference's picture", SceneOf(Ball(500, 0.3, 2, 12)),
        Camera::LookAt({0, 0, -3e5}, {0, 0, 0}, {0, 1, 0}, 1e-5, 64, 48))
        .depth_tolerance = 0.2;  // the steps of the float depth plane at 3e5 are 0.03
  }

  void Rays() {
    CloudInput row;
    for (int i = 0; i < 1000; ++i) row.center.push_back({0, 0, i * 0.01});
    row.uniform_radius = 0.02;
    Add("along_a_row_of_centres", "the reference's picture", SceneOf(row),
        Camera::LookAt({0, 0, -1}, {0, 0, 0}, {0, 1, 0}, 0.1, 65, 65));
    // Pixel centres stand at multiples of R / 16: those of the 16th column touch the sphere.
    Add("tangent_rays", "the reference's picture but for the rays that touch", SceneOf(One()),
        Camera::LookAtOrthographic({0, 0, -3}, {0, 0, 0}, {0, 1, 0}, 41 * kSurfaceRadius / 16, 41,
                                   41));
    Add("starting_inside_the_surface", "every ray a hit at depth 0, counted", SceneOf(One()),
        Camera::LookAt({0.01, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1.0, 40, 30))
        .expect = StiffCase::Expect::kAllInside;
    Add("starting_inside_the_support", "the reference's picture", SceneOf(Ball(500, 0.5, 3, 13)),
        Camera::LookAt({0, 0, -1.4}, {0, 0.2, 0}, {0, 1, 0}, 1.5, 64, 48));
    CloudInput hollow = Ball(4000, 0.12, 1, 14);
    for (Vec3d& p : hollow.center) p = Normalized(p);
    Add("starting_in_a_hollow", "the reference's picture", SceneOf(hollow),
        Camera::LookAt({0, 0, 0}, {0.3, 0.2, 1}, {0, 1, 0}, 2.0, 64, 48));
    // Two equal ones whose field at the middle is the threshold: the gradient vanishes there.
    CloudInput pair;
    pair.center = {{-0.5, 0, 0}, {0.5, 0, 0}};
    pair.uniform_radius = 1;
    Add("cancelling_normals", "the reference's picture, every normal finite",
        SceneOf(pair, 2 * std::pow(1 - 0.25, 2)),
        Camera::LookAt({0, 0, -3}, {0, 0, 0}, {0, 1, 0}, 0.5, 65, 65))
        .normal_tolerance_deg = 180;  // where it vanishes, any is right
    for (const double factor : {0.999, 1.001}) {
      CloudInput bridge;
      bridge.center = {{-0.7, 0, 0}, {0.7, 0, 0}};
      bridge.uniform_radius = 1;
      Add(factor < 1 ? "bridge_just_there" : "bridge_just_broken", "the reference's picture",
          SceneOf(bridge, 2 * std::pow(1 - 0.49, 2) * factor), Front());
    }
  }

  void Counts() {
    Add("no_metaballs", "nothing", SceneOf({}), Front()).expect = StiffCase::Expect::kNothing;
    Add("one_metaball", "the reference's picture", SceneOf(One()), Front());
    CloudInput two;
    two.center = {{-0.55, 0, 0}, {0.55, 0.1, 0.2}};
    two.radius = {1, 0.8};
    two.color = {{250, 20, 30}, {20, 40, 250}};
    Add("two_metaballs", "the reference's picture", SceneOf(two, 0.3), Front());
  }

  void BadValues() {
    // One value of every field spoilt in one metaball each, the others as they should be.
    const CloudInput good = Ball(200, 0.3, 2, 15);
    for (const double bad : {kNan, kInfinity, -kInfinity}) {
      CloudInput input = good;
      input.threshold.assign(input.center.size(), 0.7);
      input.center[3].x = bad;
      input.center[40].y = bad;
      input.center[77].z = bad;
      input.radius[100] = bad;
      input.threshold[150] = bad;
      StiffCase& stiff =
          Add(std::isnan(bad) ? "nan_in_every_field"
              : bad > 0       ? "infinity_in_every_field"
                              : "minus_infinity_in_every_field",
              "the five spoilt metaballs dropped, the others' picture", SceneOf(input), Front());
      stiff.metaballs = good.center.size() - 5;
    }
    CloudInput radii = good;
    radii.radius[5] = 0;
    radii.radius[6] = -1;
    Add("radii_of_zero_and_below", "both dropped, the others' picture", SceneOf(radii), Front())
        .metaballs = good.center.size() - 2;
    Add("threshold_nan", "refused", SceneOf(One(), kNan), Front()).expect =
        StiffCase::Expect::kRefused;
    Add("threshold_infinite", "refused", SceneOf(One(), kInfinity), Front()).expect =
        StiffCase::Expect::kRefused;
    Camera camera = Front();
    camera.eye.y = kNan;
    Add("camera_nan", "refused", SceneOf(One()), camera).expect = StiffCase::Expect::kRefused;
    const auto refused = [&](const char* name, const auto& spoil) {
      Scene scene = SceneOf(One());
      spoil(&scene);
      Add(name, "refused", scene, Front()).expect = StiffCase::Expect::kRefused;
    };
    refused("radius_factor_nan", [](Scene* scene) { scene->surface.radius_scale = kNan; });
    refused("radius_factor_infinite",
            [](Scene* scene) { scene->surface.radius_scale = kInfinity; });
    refused("density_rate_nan", [](Scene* scene) {
      scene->surface.density = {.kind = DensityKind::kBlinn, .rate = kNan};
    });
    refused("density_amplitude_infinite", [](Scene* scene) {
      scene->surface.density = {.kind = DensityKind::kTrigonometric, .amplitude = kInfinity};
    });
    refused("light_direction_nan", [](Scene* scene) {
      scene->lighting.headlight = false;
      scene->lighting.to_light.x = kNan;
    });
    refused("ambient_light_nan", [](Scene* scene) { scene->lighting.ambient = kNan; });
  }

  void Pictures() {
    const Scene scene = SceneOf(Ball(500, 0.3, 2, 16));
    const auto view = [](int width, int height) {
      return Camera::LookAt({0, 0, -4}, {0, 0, 0}, {0, 1, 0}, 0.6, width, height);
    };
    Add("picture_of_1_pixel", "the reference's picture", scene, view(1, 1));
    Add("picture_of_17x31", "the reference's picture", scene, view(17, 31));
    Add("picture_of_32768x2", "the reference's picture", scene, view(32768, 2));
    Camera tall = view(2, 2);
    tall.height = 32768;
    tall.cy = 16384;
    tall.fx = tall.fy = 30000;
    Add("picture_of_2x32768", "the reference's picture", scene, tall);
    CloudInput tiny = One(1e-3);
    tiny.center.push_back({0.7, 0.4, 0});
    Add("near_empty_frame", "the reference's picture: a pixel or none", SceneOf(tiny), Front());
    const PeerScene field = MakeHeightField(10000, 96, 54);
    Add("fully_covered_frame", "the reference's picture: no background", field.scene,
        Camera::LookAt({0.5, 0.5, 0.5}, {0.5, 0, 0.52}, {0, 0, 1}, 40 * kDegree, 96, 54));
  }

  std::vector<StiffCase> cases_;
};

bool AllFinite(const Frame& frame) {
  for (const Vec3f& n : frame.normal) {
    if (!IsFinite(n)) return false;
  }
  for (const Pixel& p : frame.color) {
    if (!std::isfinite(p.r) || !std::isfinite(p.g) || !std::isfinite(p.b)) return false;
  }
  return true;
}

StiffOutcome Judge(const StiffCase& stiff, const Frame& frame, const ReferenceFrame& reference) {
  StiffOutcome outcome;
  outcome.stats = frame.stats;
  const std::uint64_t pixels = frame.color.size();
  const bool sound = AllFinite(frame) && frame.stats.unresolved == 0 &&
                     stiff.scene.cloud->size() == stiff.metaballs;
  switch (stiff.expect) {
    case StiffCase::Expect::kReference: {
      outcome.error = CompareToReference(frame, reference, stiff.scene.cloud->frame.unit);
      const FrameDifference& e = outcome.error;
      outcome.passed = sound && e.missed + e.invented == 0 &&
                       !(e.depth_max > stiff.depth_tolerance) &&
                       !(e.normal_max_deg > stiff.normal_tolerance_deg);
      outcome.what = e.Describe();
      break;
    }
    case StiffCase::Expect::kNothing:
      outcome.passed = sound && frame.stats.hits == 0;
      outcome.what = std::to_string(frame.stats.hits) + " of " + std::to_string(pixels) + " hit";
      break;
    case StiffCase::Expect::kAllInside:
      outcome.passed = sound && frame.stats.rays_started_inside == pixels;
      outcome.what = std::to_string(frame.stats.rays_started_inside) + " of " +
                     std::to_string(pixels) + " started inside";
      break;
    case StiffCase::Expect::kRefused:
      outcome.what = "not refused";
      break;
  }
  if (!AllFinite(frame)) outcome.what += "; not finite";
  if (frame.stats.unresolved > 0) {
    outcome.what += "; " + std::to_string(frame.stats.unresolved) + " unresolved";
  }
  if (stiff.scene.cloud->size() != stiff.metaballs) {
    outcome.what += "; " + std::to_string(stiff.scene.cloud->size()) + " metaballs instead of " +
                    std::to_string(stiff.metaballs);
  }
  return outcome;
}

}  // namespace

std::vector<StiffCase> MakeStiffCases() { return Table().Make(); }

ReferenceFrame MakeReference(const StiffCase& stiff) {
  if (stiff.expect != StiffCase::Expect::kReference) return {};
  return ReferenceRender(stiff.scene, stiff.camera);
}

StiffOutcome RunStiffCase(const StiffCase& stiff, Renderer* renderer,
                          const ReferenceFrame& reference) {
  RenderSettings settings;
  settings.planes.depth = settings.planes.normal = settings.planes.id = true;
  try {
    return Judge(stiff, renderer->Render(stiff.scene, stiff.camera, settings), reference);
  } catch (const Error& error) {
    StiffOutcome outcome;
    outcome.passed = stiff.expect == StiffCase::Expect::kRefused;
    outcome.what = std::string("refused: ") + error.what();
    return outcome;
  }
}

StiffOutcome RunStiffCase(const StiffCase& stiff, Renderer* renderer) {
  return RunStiffCase(stiff, renderer, MakeReference(stiff));
}

}  // namespace sherd
