// Which clouds are kept in a machine's memory.
#include "cuda/device_clouds.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "cuda/host_machine.h"
#include "metaball/cloud.h"
#include "scenes.h"

namespace sherd {
namespace {

using Machine = HostMachine<false>;

Scene BallScene(int count, std::uint64_t seed) {
  Scene scene;
  scene.cloud = std::make_shared<Cloud>(BuildCloud(MakeBall(count, 0.2, 2, kOwnRadius, seed)));
  return scene;
}

class DeviceCloudsTest : public ::testing::Test {
 protected:
  void Use(const Scene& scene) {
    clouds_.Use(scene, 1, &machine_);
    ASSERT_TRUE(clouds_.current().Holds(scene.cloud));
    constexpr std::uint64_t kTable = 256 * sizeof(float);
    EXPECT_EQ(machine_.ReservedBytes(), clouds_.Bytes() + kTable);
  }
  void Limit(std::uint64_t bytes) { machine_ = Machine(bytes, kernels::ThreadOrder::kForward); }

  Machine machine_{std::uint64_t{1} << 30, kernels::ThreadOrder::kForward};
  DeviceClouds<Machine> clouds_;
};

TEST_F(DeviceCloudsTest, ThoseDrawnLastStay) {
  const Scene a = BallScene(1000, 1), b = BallScene(500, 2);
  Use(a);
  const void* const memory = clouds_.current().Metaballs(a).sphere;
  Use(b);
  EXPECT_TRUE(clouds_.Holds(a.cloud));
  EXPECT_EQ(clouds_.OtherBytes(), clouds_.Bytes() - clouds_.current().Bytes());
  EXPECT_EQ(clouds_.OtherBytes(), 1000 * sizeof(kernels::Sphere));
  Use(a);
  EXPECT_EQ(clouds_.current().Metaballs(a).sphere, memory);
  clouds_.ReleaseOthers(&machine_);
  EXPECT_FALSE(clouds_.Holds(b.cloud));
  EXPECT_TRUE(clouds_.Holds(a.cloud));
  EXPECT_EQ(clouds_.OtherBytes(), 0u);
}

TEST_F(DeviceCloudsTest, WhatNobodyHoldsAnyMoreGoes) {
  Scene a = BallScene(1000, 1);
  const Scene b = BallScene(500, 2);
  Use(a);
  a.cloud = nullptr;
  Use(b);
  EXPECT_EQ(clouds_.OtherBytes(), 0u);
}

TEST_F(DeviceCloudsTest, TheOldestGoFirst) {
  std::vector<Scene> scenes;
  for (int i = 0; i < 10; ++i) {
    scenes.push_back(BallScene(200, static_cast<std::uint64_t>(i)));
    Use(scenes.back());
    Use(scenes.front());
  }
  EXPECT_TRUE(clouds_.Holds(scenes[0].cloud));
  EXPECT_FALSE(clouds_.Holds(scenes[1].cloud));
  EXPECT_FALSE(clouds_.Holds(scenes[2].cloud));
  EXPECT_TRUE(clouds_.Holds(scenes[3].cloud));
}

TEST_F(DeviceCloudsTest, TheOthersTakeAQuarterOfTheMemoryAtMost) {
  Limit(200'000);
  std::vector<Scene> scenes;
  for (int i = 0; i < 6; ++i) {
    scenes.push_back(BallScene(1000, static_cast<std::uint64_t>(i)));
    Use(scenes.back());
    EXPECT_LE(clouds_.OtherBytes(), 50'000u);
  }
  EXPECT_TRUE(clouds_.Holds(scenes[4].cloud));
  EXPECT_FALSE(clouds_.Holds(scenes[0].cloud));
}

}  // namespace
}  // namespace sherd
