#include "app/project/project_json.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "metaball/error.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "sherd project";
// 2: how a level was reduced, and its errors. Files of version 1 are read: their levels are what
// version 1 built, and their errors are not known.
constexpr std::uint64_t kVersion = 2;
constexpr std::uintmax_t kLargestFile = 64 << 20;

Json FromVector(const Vec3d& v) { return Json::array({v.x, v.y, v.z}); }
template <class T>
Json FromOptional(const std::optional<T>& v) {
  if constexpr (std::is_same_v<T, Vec3d>) {
    return v ? FromVector(*v) : Json();
  } else if constexpr (std::is_same_v<T, Similarity3d>) {
    return v ? Json(NumbersOf(*v)) : Json();
  } else {
    return v ? Json(*v) : Json();
  }
}

// `path` as seen from the project file's folder.
std::string Relative(const std::string& path, const std::string& project_path) {
  if (path.empty()) return "";
  std::error_code error;
  const fs::path base = fs::absolute(project_path, error).parent_path();
  const fs::path relative =
      fs::absolute(path, error).lexically_normal().lexically_relative(base.lexically_normal());
  return relative.empty() ? path : relative.string();
}

// A JSON object being read: knows its place in the file for messages.
class Reader {
 public:
  Reader(const Json& json, std::string path, std::string place)
      : json_(json), path_(std::move(path)), place_(std::move(place)) {
    if (!json_.is_object()) Fail(place_, "should be an object");
  }

  Reader Object(const char* key) const { return {Get(key), path_, Name(key)}; }
  std::string Text(const char* key) const {
    const Json& v = Get(key);
    if (!v.is_string()) Fail(Name(key), "should be text");
    return v.get<std::string>();
  }
  double Number(const char* key) const {
    const Json& v = Get(key);
    if (!v.is_number()) Fail(Name(key), "should be a number");
    return v.get<double>();
  }
  std::uint64_t Count(const char* key) const {
    const Json& v = Get(key);
    if (!v.is_number_unsigned()) Fail(Name(key), "should be a whole number from 0");
    return v.get<std::uint64_t>();
  }
  bool Bool(const char* key) const {
    const Json& v = Get(key);
    if (!v.is_boolean()) Fail(Name(key), "should be true or false");
    return v.get<bool>();
  }
  template <std::size_t kCount>
  std::array<double, kCount> Numbers(const char* key) const {
    const Json& v = Get(key);
    if (!v.is_array() || v.size() != kCount ||
        !std::all_of(v.begin(), v.end(), [](const Json& x) { return x.is_number(); })) {
      Fail(Name(key), "should be " + std::to_string(kCount) + " numbers");
    }
    return v.get<std::array<double, kCount>>();
  }
  Vec3d Vector(const char* key) const {
    const auto v = Numbers<3>(key);
    return {v[0], v[1], v[2]};
  }
  bool Has(const char* key) const { return json_.contains(key); }
  bool IsNull(const char* key) const { return Get(key).is_null(); }
  const Json& Array(const char* key) const {
    const Json& v = Get(key);
    if (!v.is_array()) Fail(Name(key), "should be a list");
    return v;
  }
  std::string Name(const std::string& key) const {
    return place_.empty() ? key : place_ + "." + key;
  }
  [[noreturn]] void Fail(const std::string& place, const std::string& message) const {
    throw InputError(path_, place, message, "the project file is damaged; import the survey again");
  }

 private:
  const Json& Get(const char* key) const {
    const auto it = json_.find(key);
    if (it == json_.end()) Fail(Name(key), "is missing");
    return *it;
  }

  const Json& json_;
  std::string path_, place_;
};

Json FromLevel(const LevelEntry& level) {
  const LevelStats& s = level.stats;
  const LevelOptions& o = level.options;
  return {{"name", level.name},
          {"folder", level.folder},
          {"program", level.program},
          {"options",
           {{"target_count", o.target_count},
            {"reduction", ReductionName(o.reduction)},
            {"nested", o.nested},
            {"remove_outliers", o.remove_outliers},
            {"smooth_noise", o.smooth_noise},
            {"close_holes", o.close_holes},
            {"radius_factor", o.radius_factor},
            {"threshold", o.threshold},
            {"photos_per_metaball", o.max_photos_per_metaball},
            {"photo_colors", o.photo_colors}}},
          {"stats",
           {{"source_points", s.source_points},
            {"outliers", s.outliers},
            {"closing_points", s.closing_points},
            {"target_count", s.target_count},
            {"count", s.count},
            {"spacing", s.spacing},
            {"radius_min", s.radius_min},
            {"radius_median", s.radius_median},
            {"radius_max", s.radius_max},
            {"threshold", s.threshold},
            {"open_share", s.open_share},
            {"error_mean", s.error_mean},
            {"error_p95", s.error_p95},
            {"error_max", s.error_max},
            {"seconds", s.seconds},
            {"cloud_bytes", s.cloud_bytes}}}};
}

LevelEntry ToLevel(const Reader& in, std::uint64_t version) {
  LevelEntry level;
  level.name = in.Text("name");
  level.folder = in.Text("folder");
  level.program = in.Text("program");
  const Reader options = in.Object("options");
  level.options.target_count = options.Count("target_count");
  level.options.remove_outliers = options.Bool("remove_outliers");
  level.options.radius_factor = options.Number("radius_factor");
  level.options.threshold = options.Number("threshold");
  level.options.max_photos_per_metaball =
      static_cast<int>(std::min<std::uint64_t>(options.Count("photos_per_metaball"), 1 << 20));
  if (version >= 2) {
    const std::string reduction = options.Text("reduction");
    const std::optional<Reduction> known = FindReduction(reduction);
    if (!known) options.Fail(options.Name("reduction"), "is unknown: " + reduction);
    level.options.reduction = *known;
    level.options.nested = options.Bool("nested");
  } else {
    level.options.reduction = Reduction::kVoxel;
  }
  // Files from before there was a choice do not say, and took the points as they were.
  level.options.smooth_noise = options.Has("smooth_noise") && options.Bool("smooth_noise");
  level.options.close_holes = options.Has("close_holes") && options.Bool("close_holes");
  if (options.Has("photo_colors")) level.options.photo_colors = options.Bool("photo_colors");
  const Reader stats = in.Object("stats");
  LevelStats& s = level.stats;
  s.source_points = stats.Count("source_points");
  s.outliers = stats.Count("outliers");
  if (stats.Has("closing_points")) s.closing_points = stats.Count("closing_points");
  s.target_count = stats.Count("target_count");
  s.count = stats.Count("count");
  s.spacing = stats.Number("spacing");
  s.radius_min = stats.Number("radius_min");
  s.radius_median = stats.Number("radius_median");
  s.radius_max = stats.Number("radius_max");
  s.threshold = stats.Number("threshold");
  s.open_share = stats.Number("open_share");
  if (version >= 2) {
    s.error_mean = stats.Number("error_mean");
    s.error_p95 = stats.Number("error_p95");
    s.error_max = stats.Number("error_max");
  }
  s.seconds = stats.Number("seconds");
  s.cloud_bytes = stats.Count("cloud_bytes");
  return level;
}

Similarity3d ToSimilarity(const Reader& in, const char* key) {
  const auto v = in.Numbers<8>(key);
  const double length = std::hypot(std::hypot(v[1], v[2]), std::hypot(v[3], v[4]));
  if (!(v[0] > 0) || !(std::abs(length - 1) < 1e-6)) {
    in.Fail(in.Name(key), "should be a scale above 0, a unit quaternion and a translation");
  }
  return SimilarityOf(v);
}

std::size_t LineOf(const std::string& text, std::size_t byte) {
  const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(byte, text.size()));
  return 1 + static_cast<std::size_t>(std::count(text.begin(), end, '\n'));
}

}  // namespace

std::string ProjectJson::Write(const Project& project) {
  const ImportSummary& import = project.import_;
  Json levels = Json::array();
  for (const LevelEntry& level : project.levels_) levels.push_back(FromLevel(level));
  const Json json = {
      {"format", kFormat},
      {"version", kVersion},
      {"program", "sherd " SHERD_VERSION},
      {"revision", project.revision_},
      {"metres_per_unit", FromOptional(project.metres_per_unit_)},
      {"up", FromOptional(project.up_)},
      {"front", FromOptional(project.front_)},
      {"project_from_source", FromOptional(project.project_from_source_)},
      {"bounds",
       {{"min", FromVector(project.bounds_.min)}, {"max", FromVector(project.bounds_.max)}}},
      {"import",
       {{"source", Relative(import.source, project.path_)},
        {"photo_folder", Relative(import.photo_folder, project.path_)},
        {"survey", project.survey_file_},
        {"outline", project.outline_file_},
        {"cameras", import.cameras},
        {"photographs", import.photographs},
        {"photographs_found", import.photographs_found},
        {"points", import.points},
        {"dense", import.dense},
        {"has_normals", import.has_normals},
        {"has_visibility", import.has_visibility},
        {"warnings", import.warnings},
        {"seconds", import.seconds}}},
      {"levels", std::move(levels)}};
  try {
    return json.dump(2) + "\n";
  } catch (const Json::type_error&) {
    throw OutputError(project.path_, "a file name in the project is not UTF-8; rename it");
  }
}

void ProjectJson::Read(const std::string& text, Project* project) {
  Json json;
  try {
    json = Json::parse(text);
  } catch (const Json::parse_error& error) {
    throw InputError(project->path_, "line " + std::to_string(LineOf(text, error.byte)),
                     "is no Sherd project: the JSON is damaged here",
                     "import the survey again, or restore the file");
  } catch (const Json::exception&) {  // a number that no double holds
    throw InputError(project->path_, "", "is no Sherd project: a number in it is out of range",
                     "import the survey again, or restore the file");
  }
  if (!json.is_object() || json.value("format", Json()) != kFormat) {
    throw InputError(project->path_, "line 1", "is no Sherd project",
                     "make one with: sherd import FOLDER --project " + project->path_);
  }
  const Reader in(json, project->path_, "");
  const std::uint64_t version = in.Count("version");
  if (version == 0 || version > kVersion) {
    throw InputError(
        project->path_, "version",
        "is " + std::to_string(version) + ", this program knows 1 to " + std::to_string(kVersion),
        "use a newer Sherd, or import the survey again");
  }
  project->revision_ = in.Count("revision");
  if (!in.IsNull("metres_per_unit")) {
    const double scale = in.Number("metres_per_unit");
    if (!(scale > 0) || !std::isfinite(scale)) in.Fail("metres_per_unit", "should be above 0");
    project->metres_per_unit_ = scale;
  }
  if (!in.IsNull("up")) project->up_ = in.Vector("up");
  if (!in.IsNull("front")) project->front_ = in.Vector("front");
  if (in.Has("project_from_source") && !in.IsNull("project_from_source")) {
    project->project_from_source_ = ToSimilarity(in, "project_from_source");
  }
  const Reader bounds = in.Object("bounds");
  project->bounds_ = {bounds.Vector("min"), bounds.Vector("max")};

  const Reader import = in.Object("import");
  ImportSummary& summary = project->import_;
  summary.source = project->Resolve(import.Text("source"));
  summary.photo_folder = project->Resolve(import.Text("photo_folder"));
  project->survey_file_ = import.Text("survey");
  project->outline_file_ = import.Text("outline");
  summary.cameras = import.Count("cameras");
  summary.photographs = import.Count("photographs");
  summary.photographs_found = import.Count("photographs_found");
  summary.points = import.Count("points");
  summary.dense = import.Bool("dense");
  summary.has_normals = import.Bool("has_normals");
  summary.has_visibility = import.Bool("has_visibility");
  for (const Json& warning : import.Array("warnings")) {
    if (!warning.is_string()) import.Fail(import.Name("warnings"), "should be a list of text");
    summary.warnings.push_back(warning.get<std::string>());
  }
  summary.seconds = import.Number("seconds");

  std::size_t i = 0;
  for (const Json& level : in.Array("levels")) {
    project->levels_.push_back(
        ToLevel(Reader(level, project->path_, "levels[" + std::to_string(i++) + "]"), version));
  }
}

std::string ProjectJson::Load(const std::string& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) {
    throw InputError(path, "", "is a folder, not a project file",
                     "make a project of it with: sherd import " + path + " --project NAME.sherd");
  }
  std::ifstream in(path, std::ios::binary);
  if (!in) {
    throw InputError(path, "", std::string("cannot be opened (") + std::strerror(errno) + ")",
                     "check the name");
  }
  const std::uintmax_t size = fs::file_size(path, error);
  if (!error && size > kLargestFile) {
    throw InputError(path, "", "is no Sherd project: it is far too large",
                     "a project's name ends in .sherd");
  }
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace sherd
