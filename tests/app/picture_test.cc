#include "app/project/picture.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "metaball/color.h"
#include "metaball/error.h"
#include "tests/app/test_workspace.h"

namespace sherd {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Frame RandomFrame(int width, int height, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  Frame frame;
  frame.width = width;
  frame.height = height;
  for (int i = 0; i < width * height; ++i) {
    const float a = i % 3 ? 1.0f : uniform(random);
    frame.color.push_back({a * uniform(random), a * uniform(random), a * uniform(random), a});
    frame.depth.push_back(i % 7 ? 10 * uniform(random) : 0.0f);
  }
  return frame;
}

// Rows of floats in the file's own encoding.
std::vector<float> ReadRaw(const std::string& path, OIIO::ImageSpec* spec) {
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);
  auto in = OIIO::ImageInput::open(path, &config);
  if (!in) throw Error("cannot read " + path + ": " + OIIO::geterror());
  *spec = in->spec();
  std::vector<float> pixels(spec->image_pixels() * static_cast<std::size_t>(spec->nchannels));
  EXPECT_TRUE(in->read_image(0, 0, 0, spec->nchannels, OIIO::TypeDesc::FLOAT, pixels.data()));
  return pixels;
}

std::string MessageOf(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(Picture, EncodingTableAgreesWithTheFormula) {
  for (int k = 0; k < 256; ++k) {
    EXPECT_EQ(EncodeSrgb8(SrgbToLinearTable()[k]), k);
  }
  std::mt19937 random(2);
  std::uniform_real_distribution<float> uniform(-0.1f, 1.1f);
  int different = 0;
  for (int i = 0; i < 200000; ++i) {
    const float v = uniform(random);
    const int by_formula = Quantize8(SrgbFromLinear(v));
    const int by_table = EncodeSrgb8(v);
    EXPECT_LE(std::abs(by_formula - by_table), 1) << v;
    different += by_formula != by_table;
  }
  EXPECT_LT(different, 5);  // only within a rounding of a step
  EXPECT_EQ(EncodeSrgb8(NAN), 0);
}

TEST(Picture, BackgroundText) {
  EXPECT_TRUE(ParseBackground("transparent").transparent);
  const Background b = ParseBackground("0,0.5,1");
  EXPECT_EQ(b.srgb, (Vec3f{0, 0.5f, 1}));
  for (const char* bad :
       {"", "1,1", "255,255,255", "1,1,1,1", "a,b,c", "0,0,-0.1", "0, 0,0", "0,0,nan", "black"}) {
    EXPECT_THAT(MessageOf([&] { ParseBackground(bad); }), HasSubstr("from 0 to 1")) << bad;
  }
}

TEST(Picture, CompositesInLinearLight) {
  Frame frame;
  frame.width = 3;
  frame.height = 1;
  frame.color = {{0, 0, 0, 0}, {0.2f, 0.1f, 0, 0.5f}, {0.3f, 0.6f, 0.9f, 1}};
  const Frame original = frame;
  Composite({false, {1, 0.5f, 0}}, &frame);
  const float half = LinearFromSrgb(0.5f);
  EXPECT_FLOAT_EQ(frame.color[0].r, 1);
  EXPECT_FLOAT_EQ(frame.color[0].g, half);
  EXPECT_FLOAT_EQ(frame.color[0].a, 1);
  EXPECT_FLOAT_EQ(frame.color[1].r, 0.7f);
  EXPECT_FLOAT_EQ(frame.color[1].g, 0.1f + 0.5f * half);
  EXPECT_FLOAT_EQ(frame.color[2].b, 0.9f);
  frame = original;
  Composite({true, {}}, &frame);
  EXPECT_EQ(frame.color[0].a, 0);
  EXPECT_EQ(frame.color[1].r, 0.2f);
}

struct RoundTrip {
  const char* extension;
  int bits;
  bool alpha, linear;
  float tolerance;  // of a channel in the file's encoding
};

class PictureRoundTrip : public ::testing::TestWithParam<RoundTrip> {};

TEST_P(PictureRoundTrip, KeepsThePixels) {
  const RoundTrip& p = GetParam();
  const std::string path = testing::FreshFolder("out") + "/picture" + p.extension;
  Frame frame = RandomFrame(67, 41);
  if (!p.alpha) Composite({false, {0.2f, 0.4f, 0.6f}}, &frame);
  PictureOptions options;
  options.alpha = p.alpha;
  options.bits = p.bits;
  options.linear = p.linear;
  options.dpi = 300;
  options.metadata = {{"level", "63k"}, {"threshold", "0.7"}};
  WritePicture(path, frame, options);

  OIIO::ImageSpec spec;
  const std::vector<float> pixels = ReadRaw(path, &spec);
  ASSERT_EQ(spec.width, 67);
  ASSERT_EQ(spec.height, 41);
  ASSERT_EQ(spec.nchannels, p.alpha ? 4 : 3);
  const bool exr = std::string(p.extension) == ".exr";
  for (std::size_t i = 0; i < frame.color.size(); ++i) {
    const Pixel& c = frame.color[i];
    // EXR is linear and premultiplied, the others are straight.
    const float straight = exr || c.a == 0 ? 1 : 1 / c.a;
    const float expected[] = {c.r * straight, c.g * straight, c.b * straight, c.a};
    for (int k = 0; k < spec.nchannels; ++k) {
      float e = expected[k];
      if (k < 3 && !exr && !p.linear) e = SrgbFromLinear(e);
      EXPECT_NEAR(
          pixels[i * static_cast<std::size_t>(spec.nchannels) + static_cast<std::size_t>(k)], e,
          p.tolerance)
          << "pixel " << i << " channel " << k;
    }
  }
  EXPECT_THAT(spec.get_string_attribute("ImageDescription"), HasSubstr("level: 63k"));
  if (!exr) {
    EXPECT_NEAR(spec.get_float_attribute("XResolution"), 300, 0.5);
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, PictureRoundTrip,
                         ::testing::Values(RoundTrip{".png", 8, false, false, 0.51f / 255},
                                           RoundTrip{".png", 8, true, false, 0.51f / 255},
                                           RoundTrip{".png", 8, false, true, 0.51f / 255},
                                           RoundTrip{".png", 16, true, false, 0.6f / 65535},
                                           RoundTrip{".tif", 8, false, false, 0.51f / 255},
                                           RoundTrip{".tiff", 16, true, true, 0.6f / 65535},
                                           RoundTrip{".exr", 8, true, false, 1e-3f},
                                           RoundTrip{".exr", 32, false, false, 0.0f},
                                           RoundTrip{".jpg", 8, false, false, 0.35f}));

TEST(Picture, StripsMakeTheSameFileAsTheWhole) {
  const std::string folder = testing::FreshFolder("out");
  const Frame frame = RandomFrame(50, 31);
  for (const char* extension : {".png", ".exr", ".tif", ".jpg"}) {
    PictureOptions options;
    const std::string whole = folder + "/whole" + extension, parts = folder + "/parts" + extension;
    WritePicture(whole, frame, options);
    PictureWriter writer(parts, 50, 31, options);
    for (int y = 0; y < 31; y += 9) {
      Frame strip;
      strip.width = 50;
      strip.height = std::min(9, 31 - y);
      strip.color.assign(frame.color.begin() + y * 50,
                         frame.color.begin() + (y + strip.height) * 50);
      writer.WriteRows(strip);
    }
    writer.Finish();
    EXPECT_EQ(ComparePictures(whole, parts).largest, 0) << extension;
  }
}

TEST(Picture, DepthIsExact) {
  const std::string path = testing::FreshFolder("out") + "/depth.exr";
  const Frame frame = RandomFrame(33, 20);
  WriteDepth(path, frame);
  OIIO::ImageSpec spec;
  EXPECT_EQ(ReadRaw(path, &spec), frame.depth);
  EXPECT_THAT(spec.channelnames, ElementsAre("Y"));
  EXPECT_EQ(spec.format, OIIO::TypeDesc::FLOAT);
}

TEST(Picture, NothingIsLeftOfAPictureThatWasNotFinished) {
  const std::string folder = testing::FreshFolder("out");
  const std::string path = folder + "/picture.png";
  {
    PictureWriter writer(path, 10, 10, {});
    writer.WriteRows(RandomFrame(10, 4));
  }
  EXPECT_THAT(testing::Listing(folder), IsEmpty());
  // An earlier picture survives a failed one.
  WritePicture(path, RandomFrame(4, 4), {});
  const std::string before = testing::ReadText(path);
  {
    PictureWriter writer(path, 10, 10, {});
    EXPECT_THROW(writer.Finish(), OutputError);  // rows are missing
  }
  EXPECT_EQ(testing::ReadText(path), before);
  EXPECT_THAT(testing::Listing(folder), ElementsAre("picture.png"));
}

TEST(Picture, RefusesWhatAFormatCannotHold) {
  const std::string folder = testing::FreshFolder("out");
  const Frame frame = RandomFrame(4, 4);
  const auto message = [&](const std::string& name, const PictureOptions& options) {
    return MessageOf([&] { WritePicture(folder + name, frame, options); });
  };
  PictureOptions alpha;
  alpha.alpha = true;
  PictureOptions deep;
  deep.bits = 16;
  PictureOptions deeper;
  deeper.bits = 32;
  EXPECT_THAT(message("/a.jpg", alpha), HasSubstr("no transparency"));
  EXPECT_THAT(message("/a.jpg", deep), HasSubstr("8 bits"));
  EXPECT_THAT(message("/a.png", deeper), HasSubstr("8 or 16 bits"));
  EXPECT_THAT(message("/a.gif", {}), HasSubstr(".png"));
  EXPECT_THAT(message("/png", {}), HasSubstr(".png"));
  EXPECT_THAT(message("/missing/a.png", {}), HasSubstr("cannot be written"));
  EXPECT_THAT(MessageOf([&] { WriteDepth(folder + "/d.png", frame); }), HasSubstr(".exr"));
  EXPECT_THAT(testing::Listing(folder), IsEmpty());
}

TEST(Picture, ComparesPictures) {
  const std::string folder = testing::FreshFolder("out");
  Frame frame;
  frame.width = 10;
  frame.height = 10;
  frame.color.assign(100, {0, 0, 0, 1});
  PictureOptions linear;
  linear.linear = true;
  WritePicture(folder + "/a.png", frame, linear);
  frame.color[0].r = 20 / 255.0f;
  frame.color[1].g = 8 / 255.0f;
  WritePicture(folder + "/b.png", frame, linear);
  const PictureDifference d = ComparePictures(folder + "/a.png", folder + "/b.png");
  EXPECT_NEAR(d.largest, 20, 1e-3);
  EXPECT_NEAR(d.share_off_by_8, 0.01, 1e-12);  // 8 itself is not more than 8
  EXPECT_NEAR(d.rms, std::sqrt((20.0 * 20 + 8 * 8) / 300), 1e-3);

  // Without alpha is opaque.
  linear.alpha = true;
  frame.color[0].r = frame.color[1].g = 0;
  WritePicture(folder + "/c.png", frame, linear);
  EXPECT_EQ(ComparePictures(folder + "/a.png", folder + "/c.png").largest, 0);
  frame.color[5].a = 0;
  WritePicture(folder + "/c.png", frame, linear);
  EXPECT_NEAR(ComparePictures(folder + "/a.png", folder + "/c.png").largest, 255, 1e-3);

  WritePicture(folder + "/small.png", RandomFrame(9, 10), {});
  EXPECT_THAT(MessageOf([&] { ComparePictures(folder + "/a.png", folder + "/small.png"); }),
              HasSubstr("9 x 10"));
  testing::WriteText(folder + "/text.png", "no picture");
  EXPECT_THROW(ComparePictures(folder + "/a.png", folder + "/text.png"), InputError);
  EXPECT_THROW(ComparePictures(folder + "/a.png", folder + "/missing.png"), InputError);
}

}  // namespace
}  // namespace sherd
