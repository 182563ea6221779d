// Legibility: which rows of text can be read on the surface?
//
//   sherd_legibility_benchmark chart [--metaballs 10000,40000] [--json F] [--pictures D]
//   sherd_legibility_benchmark board WORKSPACE [--level 63k] [--json F] [--pictures D]
//
// What is read, and how, is described in docs/fidelity.md.
#include <unistd.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "app/project/picture.h"
#include "metaball/error.h"
#include "metaball/parallel.h"
#include "metaball/renderer.h"
#include "reconstruction/level.h"
#include "reconstruction/photo_pyramid.h"
#include "reconstruction/photo_view.h"
#include "reconstruction/photographs.h"
#include "reconstruction/workspace.h"
#include "tests/benchmarks/benchmark_main.h"
#include "tests/benchmarks/chart.h"
#include "tests/benchmarks/row_reader.h"

namespace sherd::benchmarks {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

struct Options {
  std::vector<std::uint64_t> metaballs = {10000, 40000};
  std::string workspace, level = "63k", json, pictures;
};

class ScratchFolder {
 public:
  ScratchFolder() {
    path_ = (fs::temp_directory_path() / ("sherd_legibility_" + std::to_string(getpid()))).string();
    fs::create_directories(path_);
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

float LumaOf(const Pixel& p) {
  return 0.2126f * SrgbFromLinear(p.r) + 0.7152f * SrgbFromLinear(p.g) +
         0.0722f * SrgbFromLinear(p.b);
}

// The picture's luma at (x, y), pixel centres at (0.5, 0.5), linear between them; the mean over a
// square of `footprint` pixels where that is more than one.
float LumaAt(const Frame& frame, double x, double y, double footprint) {
  const int n = std::clamp(static_cast<int>(std::ceil(footprint)), 1, 8);
  float sum = 0;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const double u =
          std::clamp(x - 0.5 + footprint * ((i + 0.5) / n - 0.5), 0.0, frame.width - 1.001);
      const double v =
          std::clamp(y - 0.5 + footprint * ((j + 0.5) / n - 0.5), 0.0, frame.height - 1.001);
      const int u0 = static_cast<int>(u), v0 = static_cast<int>(v);
      const auto fu = static_cast<float>(u - u0), fv = static_cast<float>(v - v0);
      const Pixel* const p = &frame.color[static_cast<std::size_t>(v0) * frame.width + u0];
      sum += (LumaOf(p[0]) * (1 - fu) + LumaOf(p[1]) * fu) * (1 - fv) +
             (LumaOf(p[frame.width]) * (1 - fu) + LumaOf(p[frame.width + 1]) * fu) * fv;
    }
  }
  return sum / static_cast<float>(n * n);
}

Frame RenderLevel(const Level& level, const Camera& camera) {
  Scene scene;
  scene.cloud = std::shared_ptr<const Cloud>(std::shared_ptr<void>(), &level.cloud);
  scene.surface.threshold = level.stats.threshold;
  scene.lighting.unlit = true;
  RenderSettings settings;
  settings.planes.depth = settings.planes.normal = settings.planes.id = true;
  return MakeCpuRenderer()->Render(scene, camera, settings);
}

PhotoShadingStats ShadeLevel(const Survey& survey, const Level& level, const Camera& camera,
                             const PhotoShadingOptions& options, Frame* frame) {
  Surface surface;
  surface.threshold = level.stats.threshold;
  return PhotographShader(survey, options).Shade(level, surface, camera, frame);
}

// ---- The chart: a sheet of 2 x 2 world units in z = 0, its upper left corner at (-1, 1). --------

constexpr double kUnitsPerPixel = 2.0 / kChartSide;

Camera ChartView() {
  return Camera::LookAtOrthographic({0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 2.0, kChartSide, kChartSide);
}

// Five photographs of 2600 x 2600 pixels, one from the front and four from 30 degrees aside,
// through a lens that distorts; each 1.1 to 1.25 pixels a pixel of the chart.
Survey PhotographChart(const Chart& chart, const std::string& folder) {
  Survey survey;
  constexpr int kSide = 2600;
  survey.cameras.push_back(
      {1, CameraModelId::kSimpleRadial, kSide, kSide, {3100.0, kSide / 2.0, kSide / 2.0, -0.06}});
  const double tilt = 30 * std::numbers::pi / 180;
  const Vec3d eyes[] = {{0, 0, 2.6},
                        {2.6 * std::sin(tilt), 0, 2.6 * std::cos(tilt)},
                        {-2.6 * std::sin(tilt), 0, 2.6 * std::cos(tilt)},
                        {0, 2.6 * std::sin(tilt), 2.6 * std::cos(tilt)},
                        {0, -2.6 * std::sin(tilt), 2.6 * std::cos(tilt)}};
  for (std::size_t i = 0; i < std::size(eyes); ++i) {
    const Camera look = Camera::LookAt(eyes[i], {0, 0, 0}, {0, 1, 0}, 0.8, kSide, kSide);
    Photograph photo;
    photo.name = std::to_string(i) + ".png";
    photo.path = folder + "/" + photo.name;
    // The rotation whose rows are right, down, forward, as a quaternion (Shepperd 1978, for the
    // largest component; these rotations turn by half a circle about x, so that is x).
    const Vec3d &r = look.right, &d = look.down, &f = look.forward;
    const double x = std::sqrt(std::max(1e-12, 1 + r.x - d.y - f.z)) / 2;
    photo.cam_from_world.qx = x;
    photo.cam_from_world.qw = (f.y - d.z) / (4 * x);
    photo.cam_from_world.qy = (r.y + d.x) / (4 * x);
    photo.cam_from_world.qz = (r.z + f.x) / (4 * x);
    photo.cam_from_world.translation = -photo.cam_from_world.Rotate(eyes[i]);

    Frame frame;
    frame.width = frame.height = kSide;
    frame.color.resize(std::size_t{kSide} * kSide);
    const auto& p = survey.cameras[0].parameters;
    ParallelFor(kSide, 0, [&](std::int64_t row, int) {
      for (int column = 0; column < kSide; ++column) {
        const double u0 = (column + 0.5 - p[1]) / p[0];
        const double v0 = (static_cast<double>(row) + 0.5 - p[2]) / p[0];
        double u = u0, v = v0;
        for (int k = 0; k < 20; ++k) {
          const double stretch = 1 + p[3] * (u * u + v * v);
          u = u0 / stretch;
          v = v0 / stretch;
        }
        const Vec3d way = photo.cam_from_world.InverseRotate({u, v, 1});
        const Vec3d hit = eyes[i] + way * (-eyes[i].z / way.z);
        // A pixel's side on the sheet, in the chart's pixels: the lens's blur is that of its
        // square.
        const double footprint = Length(hit - eyes[i]) / p[0] / kUnitsPerPixel;
        const float gray = LinearFromSrgb(
            chart.Gray((hit.x + 1) / kUnitsPerPixel, (1 - hit.y) / kUnitsPerPixel, footprint));
        frame.color[static_cast<std::size_t>(row) * kSide + column] = {gray, gray, gray, 1};
      }
    });
    WritePicture(photo.path, frame, {});
    survey.photographs.push_back(std::move(photo));
  }
  return survey;
}

// n metaballs on the sheet with the colour of the chart there, a tenth of a spacing off in height.
Level SheetLevel(const Chart& chart, std::uint64_t n, Survey* survey) {
  const int side = static_cast<int>(std::lround(std::sqrt(static_cast<double>(n))));
  const double spacing = 2.0 / side;
  SurveyPoints& points = survey->points;
  points = {};
  points.photo_begin.push_back(0);
  std::uint32_t random = 1;
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      random = random * 1664525u + 1013904223u;
      const double noise = (random >> 8) / double(1 << 24) - 0.5;
      const Vec3d p{-1 + (i + 0.5) * spacing, 1 - (j + 0.5) * spacing, 0.2 * noise * spacing};
      points.position.push_back(p);
      points.normal.push_back({0, 0, 1});
      const float gray = LinearFromSrgb(chart.Gray(
          (p.x + 1) / kUnitsPerPixel, (1 - p.y) / kUnitsPerPixel, spacing / kUnitsPerPixel));
      points.color.push_back(Rgb8FromLinear({gray, gray, gray}));
      for (std::uint32_t k = 0; k < survey->photographs.size(); ++k) points.photo_idx.push_back(k);
      points.photo_begin.push_back(points.photo_idx.size());
    }
  }
  LevelOptions options;
  options.target_count = points.size();
  return BuildLevel(PreparePoints(*survey, false), *survey, options);
}

// How many rows of the chart are read; `gray` by pixels of the chart.
int RowsRead(const Chart& chart, const std::string& scratch,
             const std::function<float(double x, double y, double footprint)>& gray, Json* rows) {
  int read = 0;
  for (const ChartRow& row : chart.rows) {
    const double height = row.height_px;
    const std::string text = ReadRow(
        [&](double x, double y) {
          return gray(row.left_px + x * height, row.baseline_px - y * height, height / 36);
        },
        row.width_px / height, scratch);
    const bool same = SameText(text, row.text);
    read += same;
    rows->push_back({{"height_px", height}, {"text", row.text}, {"read", text}, {"same", same}});
  }
  return read;
}

int RunChart(const Options& options) {
  const ScratchFolder scratch;
  const Chart chart;
  Survey survey = PhotographChart(chart, scratch.path());
  Json json = {{"rows", kChartRows}};
  Json rows = Json::array();
  const int source = RowsRead(
      chart, scratch.path(),
      [&](double x, double y, double footprint) {
        return chart.Gray(x, y, std::max(1.0, footprint));
      },
      &rows);
  std::printf("source: %d of %d rows\n", source, kChartRows);
  json["source"] = {{"read", source}, {"rows", rows}};
  for (const std::uint64_t n : options.metaballs) {
    const Level level = SheetLevel(chart, n, &survey);
    const Camera camera = ChartView();
    for (const bool photo : {false, true}) {
      Frame frame = RenderLevel(level, camera);
      double seconds = 0;
      if (photo) seconds = ShadeLevel(survey, level, camera, {}, &frame).seconds;
      rows = Json::array();
      const int read = RowsRead(
          chart, scratch.path(),
          [&](double x, double y, double footprint) { return LumaAt(frame, x, y, footprint); },
          &rows);
      std::printf("%8zu metaballs, %s: %d of %d rows (%.2f s)\n", level.cloud.size(),
                  photo ? "photo" : "blend", read, kChartRows, seconds);
      json["levels"].push_back({{"metaballs", level.cloud.size()},
                                {"color", photo ? "photo" : "blend"},
                                {"read", read},
                                {"rows", rows}});
      if (!options.pictures.empty()) {
        WritePicture(options.pictures + "/chart_" + std::to_string(level.cloud.size()) +
                         (photo ? "_photo.png" : "_blend.png"),
                     frame, {});
      }
    }
  }
  WriteJson(options.json, json);
  return 0;
}

// ---- The white board of the synthetic excavation. -----------------------------------------------

struct BoardRow {
  std::string text;
  double height = 0, width = 0;  // metres; letter height and the row's length
  Vec3d left{}, right{}, up{};   // its left end on the baseline; unit directions
};

std::vector<BoardRow> ReadBoard(const std::string& workspace) {
  const std::string path = workspace + "/truth/board.json";
  std::ifstream file(path);
  if (!file) throw InputError(path, "", "is missing: give a workspace made by sherd-synthetic");
  const Json json = Json::parse(file);
  const auto vector = [](const Json& j) { return Vec3d{j[0], j[1], j[2]}; };
  std::vector<BoardRow> rows;
  for (const Json& j : json.at("rows")) {
    BoardRow row;
    row.text = j.at("text");
    row.height = j.at("letter_height_m");
    row.left = vector(j.at("left"));
    const Vec3d along = vector(j.at("right")) - row.left;
    row.width = Length(along);
    row.right = Normalized(along);
    rows.push_back(row);
  }
  for (BoardRow& row : rows) row.up = Normalized(rows.front().left - rows.back().left);
  return rows;
}

// Which rows are read in a picture that `gray` gives at a world point; footprint in metres.
std::vector<bool> RowsRead(const std::vector<BoardRow>& rows, const std::string& scratch,
                           const std::function<float(const Vec3d& p, double footprint)>& gray,
                           Json* json) {
  std::vector<bool> read;
  for (const BoardRow& row : rows) {
    const std::string text = ReadRow(
        [&](double x, double y) {
          return gray(row.left + row.right * (x * row.height) + row.up * (y * row.height),
                      row.height / 36);
        },
        row.width / row.height, scratch);
    read.push_back(SameText(text, row.text));
    json->push_back({{"height_m", row.height},
                     {"text", row.text},
                     {"read", text},
                     {"same", bool{read.back()}}});
  }
  return read;
}

std::vector<bool> RowsRead(const std::vector<BoardRow>& rows, const std::string& scratch,
                           const Frame& frame, const Camera& camera, Json* json) {
  return RowsRead(
      rows, scratch,
      [&](const Vec3d& p, double footprint) {
        double x = 0, y = 0;
        if (!camera.Project(p, &x, &y)) return 0.0f;
        const double pixel = camera.PixelSizeAt(Dot(p - camera.eye, camera.forward));
        return LumaAt(frame, x, y, footprint / pixel);
      },
      json);
}

// The photograph undistorted, at its own pixel size.
Frame Undistorted(const Survey& survey, std::uint32_t photo, const Camera& camera) {
  Survey plain;
  plain.cameras = survey.cameras;
  plain.photographs = survey.photographs;
  const PhotoView view(plain, photo);
  const PhotoPyramid pyramid = ReadPhotoPyramid(view.path(), 0);
  Frame out;
  out.width = camera.width;
  out.height = camera.height;
  out.color.resize(static_cast<std::size_t>(camera.width) * camera.height);
  ParallelFor(camera.height, 0, [&](std::int64_t y, int) {
    for (int x = 0; x < camera.width; ++x) {
      const RayD ray = RayThrough(camera, x + 0.5, static_cast<double>(y) + 0.5);
      double u = 0, v = 0;
      if (!view.Project(ray.origin + ray.direction, &u, &v)) continue;
      const Vec3f c = pyramid.SampleSharply(static_cast<float>(u), static_cast<float>(v), 0);
      out.color[static_cast<std::size_t>(y) * camera.width + x] = {c.x, c.y, c.z, 1};
    }
  });
  return out;
}

int RunBoard(const Options& options) {
  const ScratchFolder scratch;
  const std::vector<BoardRow> rows = ReadBoard(options.workspace);
  const Survey survey = LoadSurvey(InspectWorkspace(options.workspace), {});
  // The camera without the points' own offset, for the photographs as they are.
  Survey plain;
  plain.cameras = survey.cameras;
  plain.photographs = survey.photographs;
  Json json;
  std::uint32_t best = 0;
  std::vector<bool> best_rows;
  std::ptrdiff_t most = -1;
  Frame best_frame;
  for (std::uint32_t i = 0; i < survey.photographs.size(); ++i) {
    const Camera camera = CameraOfPhotograph(plain, i);
    double x = 0, y = 0;
    const Vec3d middle = rows.front().left;
    if (!camera.Project(middle, &x, &y) || x < 0 || y < 0 || x >= camera.width ||
        y >= camera.height || Dot(camera.forward, Cross(rows[0].right, rows[0].up)) > -0.2) {
      continue;
    }
    const Frame frame = Undistorted(survey, i, camera);
    Json read_rows = Json::array();
    const std::vector<bool> read = RowsRead(rows, scratch.path(), frame, camera, &read_rows);
    const std::ptrdiff_t count = std::count(read.begin(), read.end(), true);
    std::printf("%-18s %2td of %zu rows\n", survey.photographs[i].name.c_str(), count, rows.size());
    json["photographs"].push_back({{"name", survey.photographs[i].name}, {"read", count}});
    if (count > most) {
      most = count;
      best = i;
      best_rows = read;
      best_frame = frame;
      json["best"] = {{"photograph", survey.photographs[i].name}, {"rows", read_rows}};
    }
  }
  if (most < 0) throw Error("no photograph shows the board");
  LevelOptions level_options;
  level_options.target_count = ParseCount(options.level);
  const Level level =
      BuildLevel(PrepareForLevels(survey.points, survey, level_options), survey, level_options);
  const Camera camera = CameraOfPhotograph(survey, best), truth = CameraOfPhotograph(plain, best);
  int missed = 0;
  for (const char* const color : {"blend", "photo", "photo, the best one left out"}) {
    Frame frame = RenderLevel(level, camera);
    PhotoShadingOptions shading;
    if (std::string(color).ends_with("out")) shading.leave_out.push_back(best);
    if (color[0] == 'p') ShadeLevel(survey, level, camera, shading, &frame);
    Json read_rows = Json::array();
    const std::vector<bool> read = RowsRead(rows, scratch.path(), frame, truth, &read_rows);
    int lost = 0;
    for (std::size_t i = 0; i < read.size(); ++i) lost += best_rows[i] && !read[i];
    std::printf("%s %s: %td of %zu rows; of the %td of %s %d are lost\n", options.level.c_str(),
                color, std::count(read.begin(), read.end(), true), rows.size(), most,
                survey.photographs[best].name.c_str(), lost);
    json["level"].push_back({{"metaballs", level.cloud.size()},
                             {"color", color},
                             {"read", std::count(read.begin(), read.end(), true)},
                             {"lost", lost},
                             {"rows", read_rows}});
    if (!options.pictures.empty()) {
      for (Pixel& p : frame.color) p.a = 1;
      std::string name = color;
      std::replace(name.begin(), name.end(), ' ', '_');
      WritePicture(options.pictures + "/board_" + name + ".png", frame, {});
      for (Pixel& p : best_frame.color) p.a = 1;
      WritePicture(options.pictures + "/board_photograph.png", best_frame, {});
    }
    if (std::string(color) == "photo") missed = lost;
  }
  WriteJson(options.json, json);
  return missed > 0;
}

int Run(int argc, char** argv) {
  Options options;
  CLI::App app("Rows of text that tesseract reads on the surface");
  app.require_subcommand(1);
  CLI::App* const chart = app.add_subcommand("chart", "22 rows of capitals on a sheet");
  chart->add_option("--metaballs", options.metaballs, "counts")->delimiter(',');
  CLI::App* const board = app.add_subcommand("board", "the synthetic excavation's white board");
  board->add_option("workspace", options.workspace, "made by sherd-synthetic")->required();
  board->add_option("--level", options.level, "density level");
  for (CLI::App* const command : {chart, board}) {
    command->add_option("--json", options.json, "write the figures here");
    command->add_option("--pictures", options.pictures, "folder for the pictures");
  }
  CLI11_PARSE(app, argc, argv);
  if (!HaveTesseract()) {
    throw Error("tesseract is not installed (Debian: apt install tesseract-ocr)");
  }
  return chart->parsed() ? RunChart(options) : RunBoard(options);
}

}  // namespace
}  // namespace sherd::benchmarks

int main(int argc, char** argv) {
  return sherd::benchmarks::RunMain("sherd_legibility_benchmark", sherd::benchmarks::Run, argc,
                                    argv);
}
