#include "metaball/channel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "metaball/cloud.h"
#include "metaball/error.h"

namespace sherd {
namespace {

TEST(Channel, KeepsValuesToItsStep) {
  struct Case {
    ChannelType type;
    std::size_t bytes;
    float step;
  };
  for (const Case& c :
       {Case{ChannelType::kFloat32, 8, 0.0f}, Case{ChannelType::kUnorm16, 4, 30.0f / 65535},
        Case{ChannelType::kUnorm8, 2, 30.0f / 255}}) {
    Channel channel("views", c.type, 2, 100, -10.0f, 20.0f);
    EXPECT_EQ(channel.BytesPerMetaball(), c.bytes);
    for (std::size_t i = 0; i < 100; ++i) {
      const float a = -10.0f + 0.3f * static_cast<float>(i),
                  b = 20.0f - 0.17f * static_cast<float>(i);
      channel.Set(i, {{a, b}});
      EXPECT_NEAR(channel.Get(i).v[0], a, 0.51f * c.step);
      EXPECT_NEAR(channel.Get(i).v[1], b, 0.51f * c.step);
      EXPECT_EQ(channel.Get(i).v[2], 0.0f);
    }
  }
}

TEST(Channel, ValuesOutOfRangeAreClamped) {
  Channel channel("c", ChannelType::kUnorm8, 1, 3, 2.0f, 4.0f);
  channel.Set(0, {{100.0f}});
  channel.Set(1, {{-INFINITY}});
  channel.Set(2, {{NAN}});
  EXPECT_EQ(channel.Get(0).v[0], 4.0f);
  EXPECT_EQ(channel.Get(1).v[0], 2.0f);
  EXPECT_EQ(channel.Get(2).v[0], 2.0f);
}

TEST(Channel, OctahedralDirectionsAreWithinAFewThousandthsOfADegree) {
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  Channel channel("normal", ChannelType::kOctahedral, 3, 1);
  EXPECT_EQ(channel.BytesPerMetaball(), 4u);
  EXPECT_EQ(channel.Get(0).v[2], 1.0f);
  const auto check = [&](Vec3f v) {
    channel.Set(0, {{v.x, v.y, v.z}});
    const ChannelValue got = channel.Get(0);
    const Vec3f n = Normalized(v), g{got.v[0], got.v[1], got.v[2]};
    EXPECT_LT(Length(Cross(n, g)), 1e-4f) << v.x << " " << v.y << " " << v.z;
    EXPECT_GT(Dot(n, g), 0.0f);
  };
  for (int i = 0; i < 10000; ++i) check({normal(random), normal(random), normal(random)});
  for (const float s : {1.0f, -1.0f}) {
    check({s, 0, 0});
    check({0, s, 0});
    check({0, 0, s});
  }
  channel.Set(0, {{NAN, 0, 0}});
  EXPECT_EQ(channel.Get(0).v[2], 1.0f);
}

TEST(Channel, RefusesWhatMakesNoSense) {
  EXPECT_THROW(Channel("", ChannelType::kFloat32, 1, 1), Error);
  EXPECT_THROW(Channel("c", ChannelType::kFloat32, 0, 1), Error);
  EXPECT_THROW(Channel("c", ChannelType::kFloat32, 5, 1), Error);
  EXPECT_THROW(Channel("c", ChannelType::kOctahedral, 2, 1), Error);
  EXPECT_THROW(Channel("c", ChannelType::kUnorm8, 1, 1, 1.0f, 1.0f), Error);
}

TEST(BuildCloud, ChannelsAndThresholdsFollowTheirMetaballs) {
  CloudInput input;
  input.uniform_radius = 1;
  Channel channel("spacing", ChannelType::kFloat32, 1, 50);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int i = 0; i < 50; ++i) {
    input.center.push_back({uniform(random), uniform(random), uniform(random)});
    input.threshold.push_back(i == 7 ? -1.0 : 0.5 + i);
    channel.Set(i, {{static_cast<float>(i)}});
  }
  input.channels = {channel};
  std::vector<std::uint32_t> order;
  CloudReport report;
  const Cloud cloud = BuildCloud(input, &report, &order);
  EXPECT_EQ(report.dropped_threshold, 1u);
  ASSERT_EQ(cloud.size(), 49u);
  ASSERT_NE(cloud.FindChannel("spacing"), nullptr);
  EXPECT_EQ(cloud.FindChannel("other"), nullptr);
  for (std::size_t k = 0; k < cloud.size(); ++k) {
    EXPECT_EQ(cloud.FindChannel("spacing")->Get(k).v[0], static_cast<float>(order[k]));
    EXPECT_EQ(cloud.threshold[k], 0.5f + static_cast<float>(order[k]));
  }
  cloud.Validate("test");
  Cloud twice = cloud;
  twice.channels.push_back(twice.channels[0]);
  EXPECT_THROW(twice.Validate("test"), InputError);
}

}  // namespace
}  // namespace sherd
