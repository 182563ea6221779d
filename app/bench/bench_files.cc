#include "app/bench/bench_files.h"

#include <stdlib.h>

#include "app/project/format.h"

namespace sherd {
namespace {

struct Column {
  const char* name;
  Figure (*value)(const Measurement& m);
};

Figure Count(std::uint64_t n) { return static_cast<double>(n); }

// Figures that mean something only where the scene was drawn.
constexpr Column kColumns[] = {
    {"device", [](const Measurement& m) -> Figure { return m.device; }},
    {"wall_seconds", [](const Measurement& m) -> Figure { return m.seconds.wall; }},
    {"wall_seconds_min", [](const Measurement& m) -> Figure { return m.seconds.wall_min; }},
    {"cpu_seconds", [](const Measurement& m) -> Figure { return m.seconds.cpu; }},
    {"rays_per_second", [](const Measurement& m) -> Figure { return m.rays_per_second; }},
    {"bytes", [](const Measurement& m) { return Count(m.bytes); }},
    {"pixels", [](const Measurement& m) { return Count(m.difference.pixels); }},
    {"missed", [](const Measurement& m) { return Count(m.difference.missed); }},
    {"invented", [](const Measurement& m) { return Count(m.difference.invented); }},
    {"color_off_by_8", [](const Measurement& m) { return Count(m.difference.color_off); }},
    {"wrong_share", [](const Measurement& m) -> Figure { return m.difference.WrongShare(); }},
    {"depth_radii_median",
     [](const Measurement& m) -> Figure { return m.difference.depth_median; }},
    {"depth_radii_p99", [](const Measurement& m) -> Figure { return m.difference.depth_p99; }},
    {"depth_radii_max", [](const Measurement& m) -> Figure { return m.difference.depth_max; }},
    {"normal_deg_median",
     [](const Measurement& m) -> Figure { return m.difference.normal_median_deg; }},
    {"normal_deg_p99", [](const Measurement& m) -> Figure { return m.difference.normal_p99_deg; }},
    {"normal_deg_max", [](const Measurement& m) -> Figure { return m.difference.normal_max_deg; }},
    {"delta_e_median", [](const Measurement& m) -> Figure { return m.difference.delta_e_median; }},
    {"delta_e_p99", [](const Measurement& m) -> Figure { return m.difference.delta_e_p99; }},
    {"delta_e_max", [](const Measurement& m) -> Figure { return m.difference.delta_e_max; }},
    {"reference_grazing", [](const Measurement& m) { return Count(m.difference.grazing); }},
    {"grazing", [](const Measurement& m) { return Count(m.grazing); }},
    {"unresolved", [](const Measurement& m) { return Count(m.unresolved); }},
};

}  // namespace

double LoadAverage() {
  double load = -1;
  return getloadavg(&load, 1) == 1 ? load : -1;
}

FigureTable FiguresOf(const std::vector<Measurement>& measurements) {
  FigureTable table;
  table.columns = {"method", "parameter", "precision", "backend", "error"};
  for (const Column& column : kColumns) table.columns.push_back(column.name);
  for (const Measurement& m : measurements) {
    std::vector<Figure> row = {m.method, m.parameter, m.precision, m.backend, m.error};
    for (const Column& column : kColumns) {
      row.push_back(m.drawn() ? column.value(m) : Figure{});
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::vector<std::pair<std::string, Figure>> HeaderOf(const BenchScene& scene) {
  return {{"scene", scene.name},
          {"metaballs", Count(scene.metaballs)},
          {"width", static_cast<double>(scene.width)},
          {"height", static_cast<double>(scene.height)},
          {"density", scene.density},
          {"threshold", scene.threshold},
          {"thresholds", scene.thresholds},
          {"threads", static_cast<double>(scene.threads)},
          {"repeat", static_cast<double>(scene.repeat)},
          {"device", scene.device},
          {"load_average_before", scene.load < 0 ? Figure{} : Figure{scene.load}}};
}

std::vector<std::vector<std::string>> ScreenTable(const std::vector<Measurement>& measurements) {
  std::vector<std::vector<std::string>> rows = {
      {"method", "parameter", "wall", "CPU", "Mrays/s", "memory", "missed", "invented", "colour",
       "depth med", "p99", "max", "normal p99", "max", "dE p99", "max"}};
  const auto few = [](double v) { return FormatNumber(v, 2); };
  for (const Measurement& m : measurements) {
    if (!m.drawn()) continue;
    const FrameDifference& d = m.difference;
    rows.push_back({m.series, m.parameter, FormatSeconds(m.seconds.wall),
                    FormatSeconds(m.seconds.cpu), FormatNumber(1e-6 * m.rays_per_second, 3),
                    FormatBytes(m.bytes), FormatGrouped(d.missed), FormatGrouped(d.invented),
                    FormatGrouped(d.color_off), few(d.depth_median), few(d.depth_p99),
                    few(d.depth_max), few(d.normal_p99_deg), few(d.normal_max_deg),
                    few(d.delta_e_p99), few(d.delta_e_max)});
  }
  return rows;
}

std::string ErrorsOf(const std::vector<Measurement>& measurements) {
  std::string text;
  for (const Measurement& m : measurements) {
    if (m.drawn()) continue;
    text += m.series + (m.parameter.empty() ? "" : ", " + m.parameter) + ": " + m.error + "\n";
  }
  return text;
}

}  // namespace sherd
