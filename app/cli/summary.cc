#include "app/cli/summary.h"

#include <nlohmann/json.hpp>
#include <numbers>

#include "app/cli/look_options.h"
#include "app/cli/table.h"
#include "app/project/format.h"
#include "reconstruction/mesh_import.h"

namespace sherd::cli {
namespace {

// Empty where the project is in its source's frame.
std::string DescribeFrame(const std::optional<Similarity3d>& project_from_source) {
  if (!project_from_source) return "not known (the project is older than its record of turns)";
  const Rigid3d& r = project_from_source->rotation_and_translation;
  const Vec3d& t = r.translation;
  const double turn = TurnOf(r) * 180 / std::numbers::pi;
  if (project_from_source->scale == 1 && turn == 0 && t == Vec3d{}) return "";
  return "the source's scaled by " + FormatNumber(project_from_source->scale, 6) + ", turned by " +
         FormatNumber(turn) + " degrees and moved by " + FormatNumber(t.x) + ", " +
         FormatNumber(t.y) + ", " + FormatNumber(t.z) + " (--json has the transform)";
}

}  // namespace

Json ToJson(const LevelEntry& level) {
  const LevelStats& s = level.stats;
  return {{"name", level.name},
          {"folder", level.folder},
          {"count", s.count},
          {"target_count", s.target_count},
          {"source_points", s.source_points},
          {"outliers_removed", s.outliers},
          {"noise_smoothed", level.options.smooth_noise},
          {"closing_points", s.closing_points},
          {"spacing", s.spacing},
          {"radius_min", s.radius_min},
          {"radius_median", s.radius_median},
          {"radius_max", s.radius_max},
          {"threshold", s.threshold},
          {"gaps_likely_share", s.open_share},
          {"error_mean", s.HasErrors() ? Json(s.error_mean) : Json()},
          {"error_p95", s.HasErrors() ? Json(s.error_p95) : Json()},
          {"error_max", s.HasErrors() ? Json(s.error_max) : Json()},
          {"seconds", s.seconds},
          {"cloud_bytes", s.cloud_bytes}};
}

Json ToJson(const Similarity3d& similarity) { return NumbersOf(similarity); }

Json ToJson(const Project& project) {
  const ImportSummary& import = project.import_summary();
  Json levels = Json::array();
  for (const LevelEntry& level : project.levels()) levels.push_back(ToJson(level));
  return {
      {"project", project.path()},
      {"source", import.source},
      {"cameras", import.cameras},
      {"photographs", import.photographs},
      {"photographs_found", import.photographs_found},
      {"points", import.points},
      {"dense", import.dense},
      {"normals", import.has_normals},
      {"visibility", import.has_visibility},
      {"metres_per_unit", project.metres_per_unit() ? Json(*project.metres_per_unit()) : Json()},
      {"up", project.up() ? ToJson(*project.up()) : Json()},
      {"front", project.front() ? ToJson(*project.front()) : Json()},
      {"project_from_source",
       project.project_from_source() ? ToJson(*project.project_from_source()) : Json()},
      {"bounds", {{"min", ToJson(project.bounds().min)}, {"max", ToJson(project.bounds().max)}}},
      {"warnings", import.warnings},
      {"import_seconds", import.seconds},
      {"levels", std::move(levels)}};
}

std::string DescribeImport(const Project& project) {
  const ImportSummary& import = project.import_summary();
  const std::optional<double>& scale = project.metres_per_unit();
  std::string points = FormatGrouped(import.points);
  points += IsMeshFileName(import.source) ? " from a mesh"
            : import.dense                ? " from a dense cloud"
                                          : " from a sparse model";
  points += import.has_normals ? ", with normals" : ", without normals";
  points += import.has_visibility ? ", and which photographs see each"
                                  : ", not known which photographs see each";
  std::string photographs = FormatGrouped(import.photographs);
  if (import.photographs > 0) {
    const std::uint64_t missing = import.photographs - import.photographs_found;
    photographs += missing == 0 ? ", all found"
                                : ", " + FormatGrouped(import.photographs_found) + " found, " +
                                      FormatGrouped(missing) + " missing";
    if (missing > 0) photographs += " (--photos DIR says where to look)";
  }
  const Vec3d size = project.bounds().max - project.bounds().min;
  const auto length = [&](double v) { return FormatLength(v, scale); };
  std::string up = "not known: z is taken as up";
  if (project.up()) {
    const Vec3d& u = *project.up();
    up = FormatNumber(u.x, 3) + ", " + FormatNumber(u.y, 3) + ", " + FormatNumber(u.z, 3);
  }
  std::string text = Fields({{"source", import.source},
                             {"points", points},
                             {"photographs", photographs},
                             {"cameras", FormatGrouped(import.cameras)},
                             {"scale", scale ? "1 unit is " + FormatLength(1, scale, 6)
                                             : "not known (--metres-per-unit M sets it)"},
                             {"extent", length(size.x) + " x " + length(size.y) + " x " +
                                            length(size.z) + " without stray points"},
                             {"up", up},
                             {"frame", DescribeFrame(project.project_from_source())}});
  for (const std::string& warning : import.warnings)
    text += "  warning: " + OneLine(warning) + "\n";
  return text;
}

std::string DescribeLevels(const Project& project) {
  if (project.levels().empty()) return "";
  const std::optional<double>& scale = project.metres_per_unit();
  std::vector<std::vector<std::string>> rows = {
      {"level", "metaballs", "noise", "points added", "spacing", "radius", "threshold",
       "gaps likely", "error, mean", "95 %", "largest", "memory", "built in"}};
  for (const LevelEntry& level : project.levels()) {
    const LevelStats& s = level.stats;
    const auto error = [&](double v) { return s.HasErrors() ? FormatLength(v, scale) : "-"; };
    rows.push_back({level.name, FormatGrouped(s.count), NoiseName(level),
                    level.options.close_holes ? FormatGrouped(s.closing_points) : "-",
                    FormatLength(s.spacing, scale), FormatLength(s.radius_median, scale),
                    FormatNumber(s.threshold), FormatShare(s.open_share), error(s.error_mean),
                    error(s.error_p95), error(s.error_max), FormatBytes(s.cloud_bytes),
                    FormatSeconds(s.seconds)});
  }
  return Table(rows);
}

}  // namespace sherd::cli
