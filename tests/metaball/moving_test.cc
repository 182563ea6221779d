#include "metaball/moving.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "metaball/error.h"
#include "metaball/renderer.h"
#include "tests/metaball/test_scenes.h"

namespace sherd {
namespace {

Frame Draw(std::shared_ptr<const Cloud> cloud, const Camera& camera) {
  Scene scene;
  scene.cloud = std::move(cloud);
  RenderSettings settings;
  settings.planes = {.depth = true, .normal = true};
  return MakeCpuRenderer()->Render(scene, camera, settings);
}

// The frame of a changed cloud is that of a cloud built anew.
void ExpectSameAsBuilt(const MovingCloud& moving, const CloudInput& input, const Camera& camera) {
  const Frame a = Draw(moving.cloud(), camera);
  const Frame b = Draw(std::make_shared<Cloud>(BuildCloud(input)), camera);
  std::size_t hits = 0, odd = 0;
  for (std::size_t i = 0; i < a.color.size(); ++i) {
    if ((a.depth[i] > 0) != (b.depth[i] > 0)) {
      ++odd;  // a ray along the rim
      continue;
    }
    if (a.depth[i] == 0.0f) continue;
    ++hits;
    if (std::abs(a.depth[i] - b.depth[i]) > 2e-3f) {
      ++odd;
      continue;
    }
    EXPECT_NEAR(a.color[i].r, b.color[i].r, 5e-3);
    EXPECT_NEAR(a.color[i].g, b.color[i].g, 5e-3);
  }
  EXPECT_GT(hits, 500u);
  EXPECT_LE(odd, 4u);
}

TEST(MovingCloud, DrawsWhatACloudBuiltAnewDraws) {
  CloudInput input = testing::RandomBall(250, 0.4, 3, 21);
  MovingCloud moving(input);
  const std::shared_ptr<const Cloud> cloud = moving.cloud();
  const LocalFrame frame = cloud->frame;
  ExpectSameAsBuilt(moving, input, testing::FrontCamera());

  // A wave through it: the frame stays.
  for (Vec3d& p : input.center) p.y += 0.2 * std::sin(5 * p.x);
  moving.SetPositions(input.center);
  EXPECT_EQ(moving.cloud(), cloud);
  EXPECT_EQ(cloud->frame.unit, frame.unit);
  EXPECT_EQ(moving.revisions(), (CloudRevisions{.positions = 1}));
  ExpectSameAsBuilt(moving, input, testing::FrontCamera());

  // Some of them alone.
  for (int i = 40; i < 90; ++i) input.center[i].z -= 0.3;
  moving.SetPositions(std::span(input.center).subspan(40, 50), 40);
  ExpectSameAsBuilt(moving, input, testing::FrontCamera());

  // Larger, other colours.
  for (double& r : input.radius) r *= 1.1;
  for (Rgb8& c : input.color) c = {c.g, c.b, c.r};
  moving.SetRadii(input.radius);
  moving.SetColors(input.color);
  EXPECT_EQ(moving.revisions(), (CloudRevisions{.positions = 2, .radii = 1, .colors = 1}));
  ExpectSameAsBuilt(moving, input, testing::FrontCamera());
}

// Far away, and spread out: the frame is left, radii follow it.
TEST(MovingCloud, LeavesItsFrameWhereItMust) {
  CloudInput input = testing::RandomBall(250, 0.4, 3, 22);
  MovingCloud moving(input);
  const Vec3d shift{431250.5, 5411033.25, 311};
  for (Vec3d& p : input.center) p = p * 1.5 + shift;
  moving.SetPositions(input.center);
  EXPECT_EQ(moving.revisions(), (CloudRevisions{.frame = 1, .positions = 1, .radii = 1}));
  const Camera camera = Camera::LookAt(shift + Vec3d{0.3, 0.5, -5}, shift, {0, 1, 0}, 0.9, 96, 64);
  ExpectSameAsBuilt(moving, input, camera);
  // A part of them back into the box: its frame holds, nothing else changes.
  for (int i = 0; i < 100; ++i) input.center[i].x = shift.x + 0.1 * (i % 10);
  moving.SetPositions(std::span(input.center).first(100));
  EXPECT_EQ(moving.revisions(), (CloudRevisions{.frame = 1, .positions = 2, .radii = 1}));
  ExpectSameAsBuilt(moving, input, camera);
}

TEST(MovingCloud, ChannelsLeaveGeometryAlone) {
  CloudInput input = testing::RandomBall(50, 0.4, 3, 23);
  MovingCloud moving(input);
  const std::vector<Vec3f> before = moving.cloud()->center;
  Channel value("value", ChannelType::kFloat32, 1, 50);
  for (int i = 0; i < 50; ++i) value.Set(i, {{static_cast<float>(i)}});
  moving.SetChannel(value);
  moving.SetChannel(value);
  EXPECT_EQ(moving.revisions(), (CloudRevisions{.channels = 2}));
  ASSERT_EQ(moving.cloud()->channels.size(), 1u);
  EXPECT_TRUE(before == moving.cloud()->center);
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(moving.cloud()->channels[0].Get(moving.IndexOf(i)).v[0], static_cast<float>(i));
    const Vec3d p = moving.cloud()->frame.WorldFromLocal(moving.cloud()->center[moving.IndexOf(i)]);
    EXPECT_LT(Length(p - input.center[i]), 1e-6);
  }
}

TEST(MovingCloud, RefusesWhatCannotBeDrawnAndStaysAsItIs) {
  CloudInput input = testing::RandomBall(30, 0.4, 3, 24);
  MovingCloud moving(input);
  const std::vector<Vec3f> before = moving.cloud()->center;
  std::vector<Vec3d> positions = input.center;
  positions[0] = {5, 5, 5};
  positions[17].y = std::numeric_limits<double>::quiet_NaN();
  try {
    moving.SetPositions(positions);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.place(), "metaball 17");
  }
  EXPECT_THROW(moving.SetRadii(std::vector<double>(30, 0.0)), InputError);
  EXPECT_THROW(moving.SetRadii(std::vector<double>(29, 1.0)), Error);
  EXPECT_THROW(moving.SetUniformRadius(-1), InputError);
  EXPECT_THROW(moving.SetThresholds(std::vector<double>(30, INFINITY)), InputError);
  EXPECT_THROW(moving.SetPositions(input.center, 1), Error);
  EXPECT_TRUE(before == moving.cloud()->center);
  EXPECT_EQ(moving.revisions(), CloudRevisions{});
  input.radius[3] = 0;
  EXPECT_THROW(MovingCloud{input}, InputError);
}

}  // namespace
}  // namespace sherd
