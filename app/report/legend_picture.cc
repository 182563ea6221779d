#include "app/report/legend_picture.h"

#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>

#include "metaball/color.h"
#include "metaball/error.h"

namespace sherd {
namespace {

using Surface2d = std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)>;
using Pen = std::unique_ptr<cairo_t, void (*)(cairo_t*)>;

constexpr double kPanelOpacity = 0.85;

Surface2d MakeSurface(int width, int height) {
  Surface2d surface(cairo_image_surface_create(CAIRO_FORMAT_ARGB32, width, height),
                    cairo_surface_destroy);
  if (cairo_surface_status(surface.get()) != CAIRO_STATUS_SUCCESS) {
    throw ResourceError("a legend of " + std::to_string(width) + "x" + std::to_string(height) +
                            " pixels does not fit in memory",
                        4ull * width * height, 0);
  }
  return surface;
}

double WidthOf(cairo_t* pen, const std::string& text) {
  cairo_text_extents_t extents;
  cairo_text_extents(pen, text.c_str(), &extents);
  return extents.x_advance;
}

void Font(cairo_t* pen, double size, bool bold) {
  cairo_select_font_face(pen, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                         bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(pen, size);
}

void Text(cairo_t* pen, double x, double y, const std::string& text) {
  cairo_set_source_rgb(pen, 0.1, 0.1, 0.11);
  cairo_move_to(pen, x, y);
  cairo_show_text(pen, text.c_str());
}

// Cairo's pixels are sRGB values times alpha in eight bits; a frame's are linear light times alpha.
Frame FrameOf(cairo_surface_t* surface, int width, int height) {
  cairo_surface_flush(surface);
  Frame frame;
  frame.width = width;
  frame.height = height;
  frame.color.reserve(static_cast<std::size_t>(width) * height);
  const unsigned char* data = cairo_image_surface_get_data(surface);
  const int stride = cairo_image_surface_get_stride(surface);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      std::uint32_t argb = 0;
      std::memcpy(&argb, data + static_cast<std::ptrdiff_t>(y) * stride + 4 * x, 4);
      const float alpha = static_cast<float>(argb >> 24) / 255.0f;
      const auto linear = [&](int shift) {
        if (!(alpha > 0.0f)) return 0.0f;
        const float encoded = static_cast<float>(argb >> shift & 255) / 255.0f / alpha;
        return LinearFromSrgb(std::min(encoded, 1.0f)) * alpha;
      };
      frame.color.push_back({linear(16), linear(8), linear(0), alpha});
    }
  }
  return frame;
}

}  // namespace

Frame DrawLegend(const Legend& legend, int picture_height_px) {
  const double u = std::max(picture_height_px / 720.0, 0.4);  // the unit of all measures
  const double text_size = 15 * u, pad = 12 * u, bar_width = 18 * u, bar_height = 220 * u;
  const Surface2d scratch = MakeSurface(1, 1);
  const Pen ruler(cairo_create(scratch.get()), cairo_destroy);
  Font(ruler.get(), text_size, true);
  double text_width = WidthOf(ruler.get(), legend.title) - bar_width;
  Font(ruler.get(), text_size, false);
  for (const LegendTick& tick : legend.ticks) {
    text_width = std::max(text_width, 14 * u + WidthOf(ruler.get(), tick.label));
  }
  const int width = static_cast<int>(std::ceil(2 * pad + bar_width + text_width));
  const int height = static_cast<int>(std::ceil(3.2 * pad + text_size + bar_height));

  const Surface2d surface = MakeSurface(width, height);
  const Pen pen(cairo_create(surface.get()), cairo_destroy);
  cairo_set_source_rgba(pen.get(), 1, 1, 1, kPanelOpacity);
  cairo_paint(pen.get());
  Font(pen.get(), text_size, true);
  Text(pen.get(), pad, pad + 0.8 * text_size, legend.title);
  Font(pen.get(), text_size, false);
  const double top = 2 * pad + text_size;
  // Row by row, so that no two colours of the map melt into a band.
  const int rows = static_cast<int>(std::ceil(bar_height));
  for (int k = 0; k < rows; ++k) {
    const double share = 1 - (k + 0.5) / rows;
    const auto i = static_cast<std::size_t>(share * static_cast<double>(legend.colors.size()));
    const Rgb8 c = legend.colors[std::min(i, legend.colors.size() - 1)];
    cairo_set_source_rgb(pen.get(), c.r / 255.0, c.g / 255.0, c.b / 255.0);
    cairo_rectangle(pen.get(), std::floor(pad), std::floor(top) + k, std::floor(bar_width), 1);
    cairo_fill(pen.get());
  }
  for (const LegendTick& tick : legend.ticks) {
    const double y = std::floor(top) + (1 - tick.position) * rows;
    cairo_set_source_rgb(pen.get(), 0.1, 0.1, 0.11);
    cairo_rectangle(pen.get(), std::floor(pad) + std::floor(bar_width), std::round(y) - 0.5 * u,
                    6 * u, std::max(u, 1.0));
    cairo_fill(pen.get());
    Text(pen.get(), pad + bar_width + 10 * u, y + 0.35 * text_size, tick.label);
  }
  return FrameOf(surface.get(), width, height);
}

void OverlayLegend(const Frame& legend, int picture_height_px, int first_row, Frame* strip) {
  const int margin = std::max(picture_height_px / 60, 2);
  const int top = std::max(picture_height_px - margin - legend.height, 0);
  for (int y = 0; y < legend.height; ++y) {
    const int row = top + y - first_row;
    if (row < 0 || row >= strip->height) continue;
    for (int x = 0; x < legend.width && margin + x < strip->width; ++x) {
      const Pixel& over = legend.color[static_cast<std::size_t>(y) * legend.width + x];
      Pixel& under = strip->color[static_cast<std::size_t>(row) * strip->width + margin + x];
      const float rest = 1 - over.a;
      under = {over.r + rest * under.r, over.g + rest * under.g, over.b + rest * under.b,
               over.a + rest * under.a};
    }
  }
}

}  // namespace sherd
