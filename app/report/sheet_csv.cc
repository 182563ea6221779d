#include <string>
#include <utility>

#include "app/project/format.h"
#include "app/report/sheet.h"
#include "metaball/atomic_file.h"

namespace sherd {
namespace {

using Row = std::vector<std::pair<std::string, std::string>>;

// Quoted where it holds a comma, a quote or a line break (RFC 4180).
std::string Quoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted(1, '"');
  for (const char c : text) {
    quoted += c;
    if (c == '"') quoted += c;
  }
  quoted += '"';
  return quoted;
}

Row RowOf(const SheetPanel& panel, const std::optional<double>& metres_per_unit) {
  const LevelStats& level = panel.level;
  const RenderStats& render = panel.frame.stats;
  Row row;
  const auto text = [&row](const char* name, const std::string& v) { row.emplace_back(name, v); };
  const auto count = [&row](const char* name, std::uint64_t v) {
    row.emplace_back(name, std::to_string(v));
  };
  const auto number = [&row](const char* name, double v) {
    row.emplace_back(name, FormatExact(v));
  };
  text("level", panel.title);
  count("metaballs", level.count);
  count("target", level.target_count);
  count("source_points", level.source_points);
  count("outliers_removed", level.outliers);
  count("closing_points", level.closing_points);
  number("spacing", level.spacing);
  number("radius_min", level.radius_min * panel.radius_scale);
  number("radius_median", level.radius_median * panel.radius_scale);
  number("radius_max", level.radius_max * panel.radius_scale);
  if (metres_per_unit) {
    number("spacing_m", level.spacing * *metres_per_unit);
    number("radius_median_m", level.radius_median * panel.radius_scale * *metres_per_unit);
  }
  number("radius_scale", panel.radius_scale);
  number("threshold", panel.threshold);
  number("gaps_likely_share", level.open_share);
  // Of the level as it was built, world units; empty where not known.
  const auto error = [&](const char* name, double v) {
    text(name, level.HasErrors() ? FormatExact(v) : "");
  };
  error("error_mean", level.error_mean);
  error("error_p95", level.error_p95);
  error("error_max", level.error_max);
  number("build_seconds", level.seconds);
  count("rays", render.rays);
  count("hits", render.hits);
  count("rays_started_inside", render.rays_started_inside);
  count("grazing", render.grazing);
  count("unresolved", render.unresolved);
  number("prepare_seconds", render.seconds_prepare);
  number("bin_seconds", render.seconds_bin);
  number("trace_seconds", render.seconds_trace);
  number("render_seconds", render.seconds_total);
  count("cloud_bytes", level.cloud_bytes);
  count("renderer_bytes", render.bytes);
  text("backend", render.backend);
  text("device", render.device);
  return row;
}

}  // namespace

void WriteSheetCsv(const std::string& path, const std::vector<SheetPanel>& panels,
                   const std::optional<double>& metres_per_unit) {
  std::string text;
  const auto add_line = [&text](const Row& row, auto field) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (i > 0) text += ',';
      text += Quoted(row[i].*field);
    }
    text += '\n';
  };
  using Field = Row::value_type;
  add_line(RowOf({}, metres_per_unit), &Field::first);
  for (const SheetPanel& panel : panels) {
    add_line(RowOf(panel, metres_per_unit), &Field::second);
  }
  AtomicFile file(path);
  file.Write(text.data(), text.size());
  file.Commit();
}

}  // namespace sherd
