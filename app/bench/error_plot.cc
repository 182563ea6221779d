#include "app/bench/error_plot.h"

#include <plplot/plstream.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>

#include "app/bench/pareto.h"
#include "app/project/format.h"
#include "metaball/atomic_file.h"
#include "metaball/error.h"

namespace sherd {
namespace {

constexpr int kWidth = 1600, kHeight = 760;  // pixels; points in the .svg

// Colours of PLplot's first map: 0 the page, 1 ink, 2 the grid, 3 the front, 4... the series.
enum Ink { kPage = 0, kText = 1, kGrid = 2, kFront = 3, kFirstSeries = 4 };

enum class Mark { kCircle, kSquare, kDiamond, kUp, kDown, kStar, kPlus, kCross };

struct Style {
  int r, g, b;
  Mark mark;
};
// In the order of AllSeries(): ours in the strongest colours, told apart without colours by marks.
constexpr std::array<Style, 12> kStyles = {{{200, 30, 40, Mark::kStar},
                                            {230, 120, 20, Mark::kStar},
                                            {150, 20, 110, Mark::kStar},
                                            {40, 90, 180, Mark::kSquare},
                                            {0, 130, 100, Mark::kUp},
                                            {70, 160, 40, Mark::kDown},
                                            {90, 165, 230, Mark::kSquare},
                                            {120, 80, 30, Mark::kDiamond},
                                            {110, 70, 180, Mark::kCircle},
                                            {190, 140, 220, Mark::kCircle},
                                            {70, 70, 70, Mark::kPlus},
                                            {20, 50, 110, Mark::kCross}}};

struct Range {
  double lo = 0, hi = 1;  // decades
};

// One of the two diagrams: points in decades.
struct Panel {
  const char* title;
  const char* y_label;
  double left, right;            // of the page's width
  std::vector<CostPair> points;  // as measured
  Range x, y;
  double floor = 0;  // where an error of zero is drawn, decades
};

bool HasZero(const Panel& panel) {
  return std::any_of(panel.points.begin(), panel.points.end(),
                     [](const CostPair& p) { return p.error <= 0; });
}

constexpr double kBottom = 0.13, kTop = 0.80;  // of the page's height

class Plot {
 public:
  Plot(const char* driver, const std::string& path) {
    stream_.sdev(driver);
    stream_.sfnam(path.c_str());
    stream_.spage(96, 96, kWidth, kHeight, 0, 0);
    stream_.scolbg(255, 255, 255);
    stream_.scmap0n(kFirstSeries + static_cast<int>(kStyles.size()));
    stream_.scol0(kText, 30, 30, 30);
    stream_.scol0(kGrid, 222, 222, 222);
    stream_.scol0(kFront, 150, 150, 150);
    for (std::size_t i = 0; i < kStyles.size(); ++i) {
      stream_.scol0(kFirstSeries + static_cast<int>(i), kStyles[i].r, kStyles[i].g, kStyles[i].b);
    }
    stream_.init();
    stream_.adv(0);
    stream_.sfont(PL_FCI_SANS, PL_FCI_UPRIGHT, PL_FCI_MEDIUM);
    // Five decades of labels are written 10^n, never 0.00001.
    stream_.syax(5, 0);
  }

  void Draw(const BenchScene& scene, const std::vector<Measurement>& drawn,
            const std::array<Panel, 2>& panels) {
    Title(scene);
    for (const Panel& panel : panels) DrawPanel(panel, drawn);
    Legend(drawn);
  }

 private:
  void Title(const BenchScene& scene) {
    stream_.vpor(0, 1, 0, 1);
    stream_.wind(0, 1, 0, 1);
    stream_.col0(kText);
    stream_.schr(0, 0.95);
    stream_.ptex(0.055, 0.945, 1, 0, 0, "Error against time");
    stream_.schr(0, 0.64);
    const std::string thresholds =
        (scene.thresholds == "uniform" ? "threshold " : scene.thresholds + " thresholds about ") +
        FormatNumber(scene.threshold);
    const std::string what = scene.name + ", " + FormatGrouped(scene.metaballs) + " metaballs, " +
                             std::to_string(scene.width) + " x " + std::to_string(scene.height) +
                             " pixels, " + scene.density + ", " + thresholds + "; " + scene.device;
    stream_.ptex(0.055, 0.895, 1, 0, 0, Escaped(what).c_str());
  }

  void DrawPanel(const Panel& panel, const std::vector<Measurement>& drawn) {
    stream_.vpor(panel.left, panel.right, kBottom, kTop);
    stream_.wind(panel.x.lo, panel.x.hi, panel.y.lo, panel.y.hi);
    SetPixels(panel.x.hi - panel.x.lo, panel.y.hi - panel.y.lo, panel.right - panel.left,
              kTop - kBottom);
    Grid(panel);
    stream_.col0(kText);
    stream_.width(1);
    stream_.schr(0, 0.64);
    stream_.smaj(0, 0.6);
    stream_.smin(0, 0.6);
    stream_.box("bclnst", 1, 0, "bclnstv", 1, 0);
    stream_.schr(0, 0.66);
    stream_.mtex("b", 3.4, 0.5, 0.5, "seconds a frame (wall clock, median)");
    stream_.mtex("l", 5.2, 0.5, 0.5, panel.y_label);
    stream_.schr(0, 0.74);
    stream_.mtex("t", 1.0, 0.0, 0.0, panel.title);
    FloorLine(panel);
    FrontLine(panel);
    SeriesLines(panel, drawn);
    for (std::size_t i = 0; i < drawn.size(); ++i) {
      const auto [x, y] = At(panel, i);
      DrawMark(StyleOf(drawn[i]), x, y, 6.5);
    }
  }

  void Grid(const Panel& panel) {
    stream_.col0(kGrid);
    stream_.width(1);
    for (double x = std::ceil(panel.x.lo); x < panel.x.hi; x += 1) {
      stream_.join(x, panel.y.lo, x, panel.y.hi);
    }
    for (double y = std::ceil(panel.y.lo); y < panel.y.hi; y += 1) {
      stream_.join(panel.x.lo, y, panel.x.hi, y);
    }
  }

  // Zero has no logarithm: it lies on a line of its own, below what is not zero.
  void FloorLine(const Panel& panel) {
    if (!HasZero(panel)) return;
    stream_.col0(kText);
    stream_.width(1);
    stream_.lsty(2);
    stream_.join(panel.x.lo, panel.floor, panel.x.hi, panel.floor);
    stream_.lsty(1);
    stream_.schr(0, 0.56);
    stream_.ptex(panel.x.hi - 8 * x_per_pixel_, panel.floor - 20 * y_per_pixel_, 1, 0, 1,
                 "on this line: exactly 0");
  }

  void FrontLine(const Panel& panel) {
    const std::vector<std::size_t> front = ParetoFront(panel.points);
    std::vector<double> x, y;
    for (const std::size_t i : front) {
      const auto [px, py] = At(panel, i);
      // A step: between two points of the front nothing lower is known than the left one.
      if (!x.empty()) {
        x.push_back(px);
        y.push_back(y.back());
      }
      x.push_back(px);
      y.push_back(py);
    }
    // To the frame on both sides: more time never makes the best known error larger.
    x.insert(x.begin(), x.front());
    y.insert(y.begin(), panel.y.hi);
    x.push_back(panel.x.hi);
    y.push_back(y.back());
    stream_.col0(kFront);
    stream_.width(4);
    stream_.line(static_cast<int>(x.size()), x.data(), y.data());
    stream_.width(1);
  }

  // Joins the points of a series in the order they were measured, which is that of its parameter.
  void SeriesLines(const Panel& panel, const std::vector<Measurement>& drawn) {
    stream_.width(1.5);
    for (std::size_t i = 1; i < drawn.size(); ++i) {
      if (drawn[i].series != drawn[i - 1].series) continue;
      const auto [x0, y0] = At(panel, i - 1);
      const auto [x1, y1] = At(panel, i);
      stream_.col0(kFirstSeries + IndexOf(drawn[i].series));
      stream_.join(x0, y0, x1, y1);
    }
    stream_.width(1);
  }

  void Legend(const std::vector<Measurement>& drawn) {
    constexpr double kLeft = 0.84;
    stream_.vpor(0, 1, 0, 1);
    stream_.wind(0, 1, 0, 1);
    SetPixels(1, 1, 1, 1);
    double y = kTop - 0.015;
    const auto label = [&](const std::string& text) {
      stream_.col0(kText);
      stream_.schr(0, 0.64);
      stream_.ptex(kLeft + 0.026, y, 1, 0, 0, text.c_str());
      y -= 0.045;
    };
    const std::vector<std::string>& series = AllSeries();
    for (std::size_t i = 0; i < series.size(); ++i) {
      const bool takes_part = std::any_of(
          drawn.begin(), drawn.end(), [&](const Measurement& m) { return m.series == series[i]; });
      if (!takes_part) continue;
      DrawMark(static_cast<int>(i), kLeft + 0.01, y, 7.5);
      label(series[i]);
    }
    stream_.col0(kFront);
    stream_.width(4);
    stream_.join(kLeft, y, kLeft + 0.02, y);
    stream_.width(1);
    label("nothing is better");
    y -= 0.01;
    stream_.schr(0, 0.54);
    for (const char* line :
         {"A line joins one method's", "points in the order of", "its parameter."}) {
      stream_.ptex(kLeft, y, 1, 0, 0, line);
      y -= 0.03;
    }
  }

  void DrawMark(int style, double x, double y, double size) {
    std::vector<std::pair<double, double>> outline;  // pixels, y up
    const auto ring = [&](int corners, double turn, double even, double odd) {
      for (int k = 0; k < corners; ++k) {
        const double angle = 2 * std::numbers::pi * (k / static_cast<double>(corners) + turn);
        const double r = size * (k % 2 == 0 ? even : odd);
        outline.emplace_back(r * std::cos(angle), r * std::sin(angle));
      }
    };
    switch (kStyles[static_cast<std::size_t>(style)].mark) {
      case Mark::kCircle:
        ring(24, 0, 1, 1);
        break;
      case Mark::kSquare:
        ring(4, 0.125, 1.25, 1.25);
        break;
      case Mark::kDiamond:
        ring(4, 0, 1.3, 1.3);
        break;
      case Mark::kUp:
        ring(3, 0.25, 1.4, 1.4);
        break;
      case Mark::kDown:
        ring(3, 0.75, 1.4, 1.4);
        break;
      case Mark::kStar:
        ring(10, 0.25, 1.75, 0.75);
        break;
      case Mark::kPlus:
        ring(8, 0, 1.6, 0.7);
        break;
      case Mark::kCross:
        ring(8, 0.125, 1.6, 0.7);
        break;
    }
    std::vector<double> xs, ys;
    for (const auto& [dx, dy] : outline) {
      xs.push_back(x + dx * x_per_pixel_);
      ys.push_back(y + dy * y_per_pixel_);
    }
    stream_.col0(kFirstSeries + style);
    stream_.fill(static_cast<int>(xs.size()), xs.data(), ys.data());
    xs.push_back(xs.front());
    ys.push_back(ys.front());
    stream_.col0(kPage);  // a white rim parts marks that touch
    stream_.width(1);
    stream_.line(static_cast<int>(xs.size()), xs.data(), ys.data());
  }

  static int IndexOf(const std::string& series) {
    const std::vector<std::string>& all = AllSeries();
    return static_cast<int>(std::find(all.begin(), all.end(), series) - all.begin());
  }
  static int StyleOf(const Measurement& m) { return IndexOf(m.series); }
  static std::pair<double, double> At(const Panel& panel, std::size_t i) {
    const CostPair& p = panel.points[i];
    return {std::log10(p.time), p.error > 0 ? std::log10(p.error) : panel.floor};
  }
  // '#' begins PLplot's escapes.
  static std::string Escaped(const std::string& text) {
    std::string out;
    for (const char c : text) out += c == '#' ? std::string("##") : std::string(1, c);
    return out;
  }
  // Of the window just set: how much of its axes a pixel of the page is.
  void SetPixels(double x_span, double y_span, double x_share, double y_share) {
    x_per_pixel_ = x_span / (x_share * kWidth);
    y_per_pixel_ = y_span / (y_share * kHeight);
  }

  plstream stream_;
  double x_per_pixel_ = 0, y_per_pixel_ = 0;
};

// The ranges of a panel from its points.
void FitAxes(Panel* panel) {
  double x_lo = 1e300, x_hi = -1e300, y_lo = 1e300, y_hi = -1e300;
  for (const CostPair& p : panel->points) {
    x_lo = std::min(x_lo, std::log10(p.time));
    x_hi = std::max(x_hi, std::log10(p.time));
    if (p.error > 0) {
      y_lo = std::min(y_lo, std::log10(p.error));
      y_hi = std::max(y_hi, std::log10(p.error));
    }
  }
  if (y_lo > y_hi) y_lo = -6, y_hi = -5;  // nothing is wrong anywhere
  panel->floor = std::floor(y_lo - 0.3) - 0.5;
  panel->x = {x_lo - 0.15, x_hi + 0.15};
  const bool has_zero = HasZero(*panel);
  panel->y = {has_zero ? panel->floor - 0.08 * (y_hi - panel->floor) - 0.3 : y_lo - 0.4,
              y_hi + 0.4};
}

}  // namespace

void WriteErrorPlot(const BenchScene& scene, const std::vector<Measurement>& measurements,
                    const std::string& path_without_extension) {
  std::vector<Measurement> drawn;
  std::copy_if(measurements.begin(), measurements.end(), std::back_inserter(drawn),
               [](const Measurement& m) { return m.drawn(); });
  if (drawn.empty()) throw Error("no method can draw this scene, so there is nothing to plot");
  std::array<Panel, 2> panels = {Panel{"Wrong pixels: missed, invented or off by > 8/255",
                                       "share of the picture", 0.075, 0.41},
                                 Panel{"Depth error, 99th percentile",
                                       "radii of the smallest metaball at the hit", 0.485, 0.82}};
  for (const Measurement& m : drawn) {
    panels[0].points.push_back({m.seconds.wall, m.difference.WrongShare()});
    panels[1].points.push_back({m.seconds.wall, m.difference.depth_p99});
  }
  for (Panel& panel : panels) FitAxes(&panel);
  for (const auto& [driver, extension] : {std::pair{"pngcairo", ".png"}, {"svgcairo", ".svg"}}) {
    const std::string path = path_without_extension + extension;
    AtomicFile file(path);
    file.CloseForExternalWriter();
    {
      Plot plot(driver, file.temporary_path());
      plot.Draw(scene, drawn, panels);
    }  // the page is written here
    std::error_code error;
    if (std::filesystem::file_size(file.temporary_path(), error) == 0 || error) {
      throw OutputError(path, "the plot could not be written (is PLplot's cairo driver there?)");
    }
    file.Commit();
  }
}

}  // namespace sherd
