#include "app/report/sheet.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "app/report/scale_bar.h"
#include "app/report/sheet_layout.h"
#include "metaball/color.h"
#include "metaball/error.h"
#include "tests/app/test_workspace.h"

namespace sherd {
namespace {

using ::testing::HasSubstr;

std::string MessageOf(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

SheetPanel Panel(const std::string& title, const PanelSize& size, const Pixel& color) {
  SheetPanel panel;
  panel.title = title;
  panel.level.count = 62950;
  panel.level.target_count = 63000;
  panel.level.spacing = 0.0123;
  panel.level.radius_median = 0.025;
  panel.frame.width = size.width;
  panel.frame.height = size.height;
  panel.frame.color.assign(
      static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height), color);
  panel.frame.depth.assign(panel.frame.color.size(), 4.0f);
  panel.frame.stats.backend = "cpu";
  panel.frame.stats.device = "2 threads";
  panel.frame.stats.seconds_total = 0.25;
  return panel;
}

struct Sheet {
  SheetOptions options;
  PanelSize size;
  Camera camera;
  std::vector<SheetPanel> panels;

  Sheet(int width, int height, int n, bool orthographic = true) {
    options.width = width;
    options.height = height;
    options.title = "Trench 4";
    options.subtitle = "Top view, orthographic";
    size = PanelSizeFor(options, n);
    camera = orthographic
                 ? Camera::LookAtOrthographic({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 4.0, size.width,
                                              size.height)
                 : Camera::LookAt({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 1.0, size.width, size.height);
    for (int i = 0; i < n; ++i)
      panels.push_back(Panel(std::to_string(i) + "k", size, {1, 0, 0, 1}));
  }
  Frame Compose() const { return ComposeSheet(options, camera, panels); }
};

bool IsRed(const Pixel& p) { return p.r == 1 && p.g == 0 && p.b == 0; }
bool IsPaper(const Pixel& p) { return p.r == 1 && p.g == 1 && p.b == 1; }

// Pixels of a rectangle that are not paper.
int Ink(const Frame& frame, double x0, double y0, double x1, double y1) {
  int ink = 0;
  for (int y = static_cast<int>(y0); y < static_cast<int>(y1); ++y) {
    for (int x = static_cast<int>(x0); x < static_cast<int>(x1); ++x) {
      ink +=
          !IsPaper(frame.color[static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width) +
                               static_cast<std::size_t>(x)]);
    }
  }
  return ink;
}

TEST(Sheet, LayoutsHoldEverythingWithoutOverlap) {
  for (const auto& [w, h] : {std::pair{1920, 1080},
                             {3840, 2160},
                             {1600, 1200},
                             {2480, 3508},
                             {7680, 4320},
                             {3000, 1100}}) {
    for (int n = 1; n <= 9; ++n) {
      for (const double aspect : {0.5, 1.0, 2.0}) {
        SheetLayout s;
        try {
          s = LayOutSheet(w, h, n, aspect);
        } catch (const Error&) {
          continue;  // too many for this size; the next test looks at that
        }
        for (int i = 0; i < n; ++i) {
          EXPECT_GE(s.PanelX(i), s.margin - 1);
          EXPECT_LE(s.PanelX(i) + s.panel_width, w - s.margin + 1);
          EXPECT_GE(s.PanelY(i), s.margin + s.header - 1);
          EXPECT_LE(s.PanelY(i) + s.panel_height + s.caption, h - s.margin - s.footer + 1);
          if ((i + 1) % s.columns && i + 1 < n) {
            EXPECT_GE(s.PanelX(i + 1), s.PanelX(i) + s.panel_width);
          }
          if (i + s.columns < n) {
            EXPECT_GE(s.PanelY(i + s.columns), s.PanelY(i) + s.panel_height + s.caption);
          }
        }
        EXPECT_GE(s.figure_columns * s.figure_rows, kSheetFigures);
      }
    }
  }
}

TEST(Sheet, GridFollowsTheSubject) {
  EXPECT_EQ(LayOutSheet(1920, 1080, 4, 0.6).columns, 4);  // a standing figure
  EXPECT_EQ(LayOutSheet(1920, 1080, 4, 2.0).columns, 2);  // a facade
  EXPECT_EQ(LayOutSheet(1920, 1080, 2, 0.8).columns, 2);
  EXPECT_EQ(LayOutSheet(1200, 2400, 2, 2.0).columns, 1);
}

TEST(Sheet, TooSmallNamesASizeThatIsLargeEnough) {
  for (const auto& [w, h, n] : {std::tuple{320, 200, 1}, {1280, 720, 12}, {900, 900, 6}}) {
    SheetOptions options;
    options.width = w;
    options.height = h;
    const std::string message = MessageOf([&] { PanelSizeFor(options, n); });
    ASSERT_THAT(message, HasSubstr("is large enough"));
    // "...; 1400x800 is large enough"
    std::istringstream text(message.substr(message.rfind("; ") + 2));
    char x = 0;
    text >> options.width >> x >> options.height;
    EXPECT_NO_THROW(PanelSizeFor(options, n)) << message;
    // Not far more than is needed.
    options.width = options.width * 9 / 10;
    options.height = options.height * 9 / 10;
    EXPECT_THROW(PanelSizeFor(options, n), Error) << message;
  }
  // Captions grow with the sheet: so many levels leave no room for pictures in this shape.
  SheetOptions wide;
  wide.width = 1280;
  wide.height = 720;
  EXPECT_THAT(MessageOf([&] { PanelSizeFor(wide, 40); }), HasSubstr("take fewer levels"));
  SheetOptions huge;
  huge.width = 40000;
  EXPECT_THAT(MessageOf([&] { PanelSizeFor(huge, 1); }), HasSubstr("32000"));
  EXPECT_THROW(PanelSizeFor(huge, 0), Error);
}

TEST(Sheet, PanelsAreDrawnPixelForPixelAndTextIsThere) {
  for (const auto& [w, h, n] : {std::tuple{1920, 1080, 2}, {1920, 1080, 4}, {3840, 2160, 6}}) {
    const Sheet sheet(w, h, n);
    const Frame frame = sheet.Compose();
    ASSERT_EQ(frame.width, w);
    ASSERT_EQ(frame.height, h);
    const SheetLayout s = LayOutSheet(w, h, n, sheet.options.subject_aspect);
    const auto red = std::count_if(frame.color.begin(), frame.color.end(), IsRed);
    EXPECT_EQ(red, static_cast<std::ptrdiff_t>(n) * s.panel_width * s.panel_height);
    // Title, subtitle, each caption's title and figures.
    const double u = s.unit;
    EXPECT_GT(Ink(frame, s.margin, s.margin, w - s.margin, s.margin + 35 * u), 300 * u * u);
    EXPECT_GT(Ink(frame, s.margin, s.margin + 40 * u, w - s.margin, s.margin + 60 * u), 200 * u);
    for (int i = 0; i < n; ++i) {
      const double x = s.PanelX(i), y = s.PanelY(i) + s.panel_height + 4;
      EXPECT_GT(Ink(frame, x, y, x + s.panel_width, y + 40 * u), 100 * u) << i;
      EXPECT_GT(Ink(frame, x, y + 40 * u, x + s.panel_width, y + s.caption - 4), 300 * u) << i;
    }
    // Nothing in the margins.
    EXPECT_EQ(Ink(frame, 0, 0, w, s.margin * 0.8), 0);
    EXPECT_EQ(Ink(frame, 0, 0, s.margin * 0.8, h), 0);
    EXPECT_EQ(Ink(frame, w - s.margin * 0.8, 0, w, h), 0);
    EXPECT_EQ(Ink(frame, 0, h - s.margin * 0.5, w, h), 0);
  }
}

TEST(Sheet, SameInputGivesTheSamePixels) {
  const Sheet sheet(1920, 1080, 3);
  const Frame a = sheet.Compose(), b = sheet.Compose();
  for (std::size_t i = 0; i < a.color.size(); ++i) {
    ASSERT_TRUE(a.color[i].r == b.color[i].r && a.color[i].g == b.color[i].g &&
                a.color[i].b == b.color[i].b);
  }
}

// The bar's outline is its darkest row; its length in pixels.
int LongestDarkRun(const Frame& frame, int y0) {
  int longest = 0;
  for (int y = y0; y < frame.height; ++y) {
    int run = 0;
    for (int x = 0; x < frame.width; ++x) {
      const Pixel& p =
          frame.color[static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width) +
                      static_cast<std::size_t>(x)];
      run = p.r < 0.05f ? run + 1 : 0;
      longest = std::max(longest, run);
    }
  }
  return longest;
}

TEST(Sheet, ScaleBarHasItsLengthAndNeedsAScale) {
  Sheet sheet(1920, 1080, 2);
  const SheetLayout s = LayOutSheet(1920, 1080, 2, sheet.options.subject_aspect);
  const int footer = static_cast<int>(1080 - s.margin - s.footer);
  const int without = LongestDarkRun(sheet.Compose(), footer);
  EXPECT_LT(without, 30);  // text only
  // The picture is 4 units of 0.5 m wide: the bar of 1 m is half the panel, and its outline.
  sheet.options.metres_per_unit = 0.5;
  const int with = LongestDarkRun(sheet.Compose(), footer);
  EXPECT_NEAR(with, 0.5 * s.panel_width + 2, 2);
}

TEST(ScaleBar, LengthsAreRoundAndFit) {
  Camera camera = Camera::LookAtOrthographic({0, 0, 1}, {0, 0, 0}, {0, 1, 0}, 1, 1000, 500);
  for (double scale = 1e-6; scale < 1e6; scale *= 1.37) {
    const auto bar = MakeScaleBar(camera, 1, scale, 300);
    ASSERT_TRUE(bar);
    EXPECT_LE(bar->length_px, 300 + 1e-6);
    EXPECT_GT(bar->length_px, 300 / 2.5 - 1e-6);
    const double digits = bar->metres / std::pow(10, std::floor(std::log10(bar->metres) + 1e-9));
    EXPECT_TRUE(std::abs(digits - 1) < 1e-6 || std::abs(digits - 2) < 1e-6 ||
                std::abs(digits - 5) < 1e-6)
        << bar->metres;
    EXPECT_NEAR(bar->length_px * scale / 1000, bar->metres, 1e-9 * bar->metres);
  }
  const auto bar = MakeScaleBar(camera, 1, 0.1, 100);
  EXPECT_EQ(bar->unit, "cm");
  EXPECT_NEAR(bar->label_end, 1, 1e-9);
  // Perspective: at its depth.
  camera = Camera::LookAt({0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 2 * std::atan(0.5), 1000, 500);
  EXPECT_NEAR(MakeScaleBar(camera, 2, 1, 300)->length_px, 250, 1e-6);  // 2 units wide: 0.5
  EXPECT_NEAR(MakeScaleBar(camera, 2, 1, 300)->metres, 0.5, 1e-12);
  EXPECT_FALSE(MakeScaleBar(camera, 0, 1, 300));
  EXPECT_FALSE(MakeScaleBar(camera, NAN, 1, 300));
}

TEST(ScaleBar, DepthIsThatOfTheMiddle) {
  const Camera camera = Camera::LookAt({0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 1.2, 101, 81);
  Frame frame;
  frame.width = 101;
  frame.height = 81;
  frame.color.resize(101 * 81);
  frame.depth.assign(101 * 81, 0);
  EXPECT_FALSE(DepthAtCenter(camera, frame));
  // A plane at z = 3, seen everywhere: distances grow outwards, the depth does not.
  for (int y = 0; y < 81; ++y) {
    for (int x = 0; x < 101; ++x) {
      const RayD ray = RayThrough(camera, x + 0.5, y + 0.5);
      frame.depth[static_cast<std::size_t>(y * 101 + x)] = static_cast<float>(3 / ray.direction.z);
    }
  }
  EXPECT_NEAR(*DepthAtCenter(camera, frame), 3, 1e-5);
  // Only a corner is hit: still found.
  const float corner = frame.depth[0];
  std::fill(frame.depth.begin(), frame.depth.end(), 0.0f);
  frame.depth[0] = corner;
  EXPECT_NEAR(*DepthAtCenter(camera, frame), 3, 1e-5);
}

TEST(Sheet, LongTitlesAreCutNotDrawnOver) {
  Sheet sheet(1920, 1080, 4);
  sheet.options.title = std::string(400, 'W');
  std::string greek;
  for (int i = 0; i < 300; ++i) greek += "\u03b1";
  sheet.options.subtitle = greek;
  const Frame frame = sheet.Compose();
  EXPECT_EQ(Ink(frame, 1920 - 40, 0, 1920, 1080), 0);
}

TEST(Sheet, RefusesPicturesOfAnotherSize) {
  Sheet sheet(1920, 1080, 2);
  sheet.panels[1] = Panel("63k", {10, 10, 1, 1}, {0, 0, 0, 1});
  EXPECT_THAT(MessageOf([&] { sheet.Compose(); }), HasSubstr("level 63k"));
  sheet = Sheet(1920, 1080, 2);
  sheet.camera.width += 1;
  EXPECT_THROW(sheet.Compose(), Error);
}

TEST(SheetCsv, HasOneRowAPanelAndReadsBack) {
  const std::string path = testing::FreshFolder("out") + "/sheet.csv";
  const Sheet sheet(1920, 1080, 2);
  std::vector<SheetPanel> panels = sheet.panels;
  panels[1].title = "a \"b\", c";
  WriteSheetCsv(path, panels, 0.5);
  std::istringstream text(testing::ReadText(path));
  std::string header, first, second, more;
  std::getline(text, header);
  std::getline(text, first);
  std::getline(text, second);
  EXPECT_FALSE(std::getline(text, more));
  EXPECT_THAT(header, HasSubstr("level,metaballs,target,"));
  EXPECT_THAT(header, HasSubstr("spacing_m"));
  EXPECT_THAT(first, HasSubstr("0k,62950,63000,"));
  EXPECT_THAT(first, HasSubstr(",0.0123,"));
  EXPECT_THAT(second, HasSubstr("\"a \"\"b\"\", c\",62950"));
  EXPECT_EQ(std::count(header.begin(), header.end(), ','),
            std::count(first.begin(), first.end(), ','));
  EXPECT_THROW(WriteSheetCsv(path + "/x/y.csv", panels), OutputError);
}

}  // namespace
}  // namespace sherd
