#include "app/report/sheet.h"

#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

#include "app/project/format.h"
#include "app/project/picture.h"
#include "app/report/scale_bar.h"
#include "app/report/sheet_layout.h"
#include "metaball/color.h"
#include "metaball/error.h"

namespace sherd {
namespace {

struct Ink {
  double r, g, b;
};
constexpr Ink kPaper{1, 1, 1}, kText{0.10, 0.10, 0.11}, kQuiet{0.42, 0.43, 0.45},
    kLine{0.80, 0.81, 0.82};

// The sheet being drawn.
class Canvas {
 public:
  Canvas(int width, int height)
      : width_(width),
        height_(height),
        surface_(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height),
                 cairo_surface_destroy),
        cr_(cairo_create(surface_.get()), cairo_destroy) {
    if (cairo_surface_status(surface_.get()) != CAIRO_STATUS_SUCCESS) {
      const std::uint64_t bytes =
          4ull * static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
      throw ResourceError("a sheet of " + std::to_string(width) + "x" + std::to_string(height) +
                              " pixels does not fit in memory",
                          bytes, 0);
    }
    // Unhinted type: the same layout at every size.
    const std::unique_ptr<cairo_font_options_t, void (*)(cairo_font_options_t*)> options(
        cairo_font_options_create(), cairo_font_options_destroy);
    cairo_font_options_set_hint_style(options.get(), CAIRO_HINT_STYLE_NONE);
    cairo_font_options_set_hint_metrics(options.get(), CAIRO_HINT_METRICS_OFF);
    cairo_font_options_set_antialias(options.get(), CAIRO_ANTIALIAS_GRAY);
    cairo_set_font_options(cr_.get(), options.get());
    Fill(0, 0, width, height, kPaper);
  }

  void Fill(double x, double y, double w, double h, const Ink& ink) {
    cairo_set_source_rgb(cr_.get(), ink.r, ink.g, ink.b);
    cairo_rectangle(cr_.get(), x, y, w, h);
    cairo_fill(cr_.get());
  }
  // A line of whole pixels just outside the rectangle.
  void Border(int x, int y, int w, int h, int line, const Ink& ink) {
    Fill(x - line, y - line, w + 2 * line, line, ink);
    Fill(x - line, y + h, w + 2 * line, line, ink);
    Fill(x - line, y, line, h, ink);
    Fill(x + w, y, line, h, ink);
  }

  double Width(const std::string& text, double size, bool bold) {
    Font(size, bold);
    cairo_text_extents_t extents;
    cairo_text_extents(cr_.get(), text.c_str(), &extents);
    return extents.x_advance;
  }
  // `y` is the baseline. Text wider than max_width is set smaller down to three quarters, then cut
  // with an ellipsis. Returns the width used.
  double Text(double x, double y, std::string text, double size, bool bold, const Ink& ink,
              double max_width) {
    double width = Width(text, size, bold);
    if (width > max_width) {
      // A little smaller than the ratio says: glyphs keep to whole pixels.
      size = std::max(0.75 * size, 0.97 * size * max_width / width);
      width = Width(text, size, bold);
    }
    if (width > max_width) {
      text = Shortened(text, size, bold, max_width);
      width = Width(text, size, bold);
    }
    Font(size, bold);
    cairo_set_source_rgb(cr_.get(), ink.r, ink.g, ink.b);
    cairo_move_to(cr_.get(), x, y);
    cairo_show_text(cr_.get(), text.c_str());
    return width;
  }
  void TextRight(double x, double y, const std::string& text, double size, const Ink& ink,
                 double max_width) {
    Text(x - std::min(max_width, Width(text, size, false)), y, text, size, false, ink, max_width);
  }
  void TextCentered(double x, double y, const std::string& text, double size, const Ink& ink) {
    Text(x - 0.5 * Width(text, size, false), y, text, size, false, ink, 1e9);
  }

  // The frame's pixels as they are.
  void Picture(int x0, int y0, const Frame& frame) {
    cairo_surface_flush(surface_.get());
    unsigned char* const data = cairo_image_surface_get_data(surface_.get());
    const int stride = cairo_image_surface_get_stride(surface_.get());
    const Pixel* in = frame.color.data();
    for (int y = 0; y < frame.height; ++y) {
      unsigned char* const row = data + static_cast<std::ptrdiff_t>(y0 + y) * stride;
      for (int x = 0; x < frame.width; ++x, ++in) {
        const std::uint32_t rgb = static_cast<std::uint32_t>(EncodeSrgb8(in->r)) << 16 |
                                  static_cast<std::uint32_t>(EncodeSrgb8(in->g)) << 8 |
                                  EncodeSrgb8(in->b);
        std::memcpy(row + 4 * static_cast<std::ptrdiff_t>(x0 + x), &rgb, 4);
      }
    }
    cairo_surface_mark_dirty(surface_.get());
  }

  Frame Finish() {
    if (cairo_status(cr_.get()) != CAIRO_STATUS_SUCCESS) {
      throw Error(std::string("drawing the sheet failed: ") +
                  cairo_status_to_string(cairo_status(cr_.get())));
    }
    cairo_surface_flush(surface_.get());
    const unsigned char* const data = cairo_image_surface_get_data(surface_.get());
    const int stride = cairo_image_surface_get_stride(surface_.get());
    Frame frame;
    frame.width = width_;
    frame.height = height_;
    frame.color.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
    const float* const linear = SrgbToLinearTable();
    Pixel* out = frame.color.data();
    for (int y = 0; y < height_; ++y) {
      const unsigned char* const row = data + static_cast<std::ptrdiff_t>(y) * stride;
      for (int x = 0; x < width_; ++x, ++out) {
        std::uint32_t rgb;
        std::memcpy(&rgb, row + 4 * static_cast<std::ptrdiff_t>(x), 4);
        *out = {linear[rgb >> 16 & 0xff], linear[rgb >> 8 & 0xff], linear[rgb & 0xff], 1};
      }
    }
    return frame;
  }

 private:
  void Font(double size, bool bold) {
    cairo_select_font_face(cr_.get(), "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL,
                           bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(cr_.get(), size);
  }
  std::string Shortened(const std::string& text, double size, bool bold, double max_width) {
    std::string cut = text;
    while (!cut.empty()) {
      // A whole UTF-8 character at a time.
      do {
        const bool continuation = (static_cast<unsigned char>(cut.back()) & 0xc0) == 0x80;
        cut.pop_back();
        if (!continuation) break;
      } while (!cut.empty());
      if (Width(cut + "\u2026", size, bold) <= max_width) break;
    }
    return cut + "\u2026";
  }

  int width_, height_;
  std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)> surface_;
  std::unique_ptr<cairo_t, void (*)(cairo_t*)> cr_;
};

struct Figure {
  std::string label, value;
};

std::vector<Figure> FiguresOf(const SheetPanel& panel, const SheetOptions& options) {
  const LevelStats& level = panel.level;
  const RenderStats& render = panel.frame.stats;
  const double scale = panel.radius_scale;
  const bool as_built = level.HasErrors() && scale == 1.0 && panel.threshold == level.threshold;
  const auto error = [&](double v) {
    return as_built ? FormatLength(v, options.metres_per_unit) : std::string("\u2013");
  };
  return {{"Spacing", FormatLength(level.spacing, options.metres_per_unit)},
          {"Radius", FormatLength(level.radius_median * scale, options.metres_per_unit)},
          {"Threshold", FormatNumber(panel.threshold)},
          {"Gaps likely", FormatShare(level.open_share)},
          // Of the surface as it was built: other radii or thresholds make another one.
          {"Error, mean", error(level.error_mean)},
          {"Error, 95 %", error(level.error_p95)},
          {"Render time", FormatSeconds(render.SecondsToDraw())},
          {"Memory", FormatBytes(level.cloud_bytes + render.bytes)}};
}

// Where the columns of figures begin, from 0, and where the last one ends: equally wide, or, where
// one needs more, each by what stands in it.
std::vector<double> ColumnsOf(const std::vector<Figure>& figures, const SheetLayout& s,
                              Canvas* canvas) {
  const double u = s.unit, equal = static_cast<double>(s.panel_width) / s.figure_columns;
  std::vector<double> need(static_cast<std::size_t>(s.figure_columns), 0.0);
  for (std::size_t i = 0; i < figures.size(); ++i) {
    double& widest = need[i % need.size()];
    widest = std::max({widest, canvas->Width(figures[i].label, 12 * u, false) + 8 * u,
                       canvas->Width(figures[i].value, 16 * u, false) + 8 * u});
  }
  double sum = 0;
  for (const double width : need) sum += width;
  const bool fits = *std::max_element(need.begin(), need.end()) <= equal;
  const double spare = (s.panel_width - sum) / s.figure_columns;
  std::vector<double> begin{0};
  for (const double width : need) {
    begin.push_back(begin.back() + (fits || spare < 0 ? equal : width + spare));
  }
  return begin;
}

void DrawCaption(const SheetLayout& s, const SheetPanel& panel, const SheetOptions& options, int x,
                 double top, Canvas* canvas) {
  const double u = s.unit;
  const double used =
      canvas->Text(x, top + 32 * u, panel.title, 26 * u, true, kText, 0.6 * s.panel_width);
  std::string count =
      FormatGrouped(panel.level.count) + (panel.level.count == 1 ? " metaball" : " metaballs");
  const std::uint64_t added = panel.level.closing_points;
  if (added > 0) {
    count +=
        "; " + FormatGrouped(added) + (added == 1 ? " point" : " points") + " added to close holes";
  }
  canvas->Text(x + used + 12 * u, top + 32 * u, count, 16 * u, false, kQuiet,
               s.panel_width - used - 12 * u);
  const std::vector<Figure> figures = FiguresOf(panel, options);
  const std::vector<double> columns = ColumnsOf(figures, s, canvas);
  const auto per_row = static_cast<std::size_t>(s.figure_columns);
  for (std::size_t i = 0; i < figures.size(); ++i) {
    const Figure& figure = figures[i];
    const std::size_t column = i % per_row, row = i / per_row;
    const double left = x + columns[column], room = columns[column + 1] - columns[column] - 8 * u;
    const double y = top + (44 + 44 * static_cast<double>(row)) * u;
    canvas->Text(left, y + 14 * u, figure.label, 12 * u, false, kQuiet, room);
    canvas->Text(left, y + 33 * u, figure.value, 16 * u, false, kText, room);
  }
}

// The bar with its labels; returns the x where what follows may begin.
double DrawScaleBar(const ScaleBar& bar, double x, double y, double u, Canvas* canvas) {
  const double height = 9 * u;
  const double line = std::max(1.0, std::round(1.2 * u));
  x = std::round(x);
  y = std::round(y);
  canvas->Fill(x - line, y - line, bar.length_px + 2 * line, height + 2 * line, kText);
  for (int i = 1; i < bar.segments; i += 2) {
    const double left = x + bar.length_px * i / bar.segments;
    canvas->Fill(left, y, bar.length_px / bar.segments, height, kPaper);
  }
  const double baseline = y + height + 19 * u;
  canvas->TextCentered(x, baseline, "0", 13 * u, kText);
  const std::string end = FormatNumber(bar.label_end) + " " + bar.unit;
  const double number = canvas->Width(FormatNumber(bar.label_end), 13 * u, false);
  // The number stands under the bar's end, its unit after it.
  const double end_x = x + bar.length_px - 0.5 * number;
  const double used = canvas->Text(end_x, baseline, end, 13 * u, false, kText, 1e9);
  return std::max(x + bar.length_px, end_x + used) + 28 * u;
}

std::string DeviceOf(const std::vector<SheetPanel>& panels) {
  const RenderStats& stats = panels.front().frame.stats;
  if (stats.backend.empty()) return "";
  std::string backend = stats.backend;
  for (char& c : backend) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return backend + (stats.device.empty() ? "" : ": " + stats.device);
}

void DrawFooter(const SheetLayout& s, const SheetOptions& options, const Camera& camera,
                const std::vector<SheetPanel>& panels, Canvas* canvas) {
  const double u = s.unit;
  const double top = options.height - s.margin - s.footer + 22 * u;
  const double right = options.width - s.margin;
  std::string made_by = "Sherd " SHERD_VERSION;
  const std::string device = DeviceOf(panels);
  if (!device.empty()) made_by += "   \u00b7   " + device;
  const double made_by_width = std::min(canvas->Width(made_by, 13 * u, false), 0.4 * options.width);
  canvas->TextRight(right, top + 28 * u, made_by, 13 * u, kQuiet, made_by_width);

  double x = s.margin;
  std::string note;
  if (!options.metres_per_unit) {
    note = "No scale bar: how many metres one unit of this survey measures is not known.";
  } else {
    const bool orthographic = camera.projection == Projection::kOrthographic;
    std::optional<double> depth = options.scale_depth;
    for (std::size_t i = panels.size(); !depth && i > 0; --i) {
      depth = DepthAtCenter(camera, panels[i - 1].frame);
    }
    if (orthographic) depth = 1;  // a parallel view has one scale everywhere
    std::optional<ScaleBar> bar;
    if (depth) {
      bar = MakeScaleBar(camera, *depth, *options.metres_per_unit,
                         std::min<double>(0.8 * s.panel_width, 0.3 * options.width));
    }
    if (!bar) {
      note = "No scale bar: the middle of the picture is empty.";
    } else {
      x = DrawScaleBar(*bar, x + 5 * u, top, u, canvas);
      note = orthographic ? "Scale of the whole picture (parallel projection)"
                          : "Scale at the depth of the middle of the picture (perspective)";
    }
  }
  canvas->Text(x, top + 28 * u, note, 13 * u, false, kQuiet, right - made_by_width - 24 * u - x);
}

}  // namespace

Frame ComposeSheet(const SheetOptions& options, const Camera& camera,
                   const std::vector<SheetPanel>& panels) {
  const int n = static_cast<int>(panels.size());
  const SheetLayout s = LayOutSheet(options.width, options.height, n, options.subject_aspect);
  if (camera.width != s.panel_width || camera.height != s.panel_height) {
    throw Error("the camera has not the size of the sheet's panels");
  }
  for (const SheetPanel& panel : panels) {
    if (panel.frame.width != s.panel_width || panel.frame.height != s.panel_height) {
      throw Error("the picture of level " + panel.title + " has not the size of its panel");
    }
  }
  Canvas canvas(options.width, options.height);
  const double u = s.unit;
  const double full = options.width - 2 * s.margin;
  canvas.Text(s.margin, s.margin + 26 * u, options.title, 32 * u, true, kText, full);
  canvas.Text(s.margin, s.margin + 54 * u, options.subtitle, 16 * u, false, kQuiet, full);
  const int line = std::max(1, static_cast<int>(std::round(u)));
  for (int i = 0; i < n; ++i) {
    const SheetPanel& panel = panels[static_cast<std::size_t>(i)];
    const int x = s.PanelX(i), y = s.PanelY(i);
    canvas.Border(x, y, s.panel_width, s.panel_height, line, kLine);
    canvas.Picture(x, y, panel.frame);
    DrawCaption(s, panel, options, x, y + s.panel_height, &canvas);
  }
  DrawFooter(s, options, camera, panels, &canvas);
  return canvas.Finish();
}

}  // namespace sherd
