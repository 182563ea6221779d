// A project that is levelled by its ground.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <stop_token>

#include "app/project/project.h"
#include "metaball/error.h"
#include "tests/app/test_workspace.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A survey in a national grid, tilted by a quarter turn and some: 20 degrees about x after y has
// become up.
class ProjectGround : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = testing::FreshFolder("ground");
    path_ = folder_ + "/trench.sherd";
    testing::WriteWorkspace(folder_ + "/ws", 2500);
    testing::WriteText(folder_ + "/tilt.txt", "1 " + std::to_string(std::cos(kHalf)) + " " +
                                                  std::to_string(std::sin(kHalf)) +
                                                  " 0 0 653412.25 6861234.5 87\n");
    ImportOptions options;
    options.source = folder_ + "/ws";
    options.transform = folder_ + "/tilt.txt";
    options.metres_per_unit = 0.5;
    project_ = ImportSurvey(options, path_);
    BuildLevels(&project_, {500, 1000}, {});
  }

  std::map<std::string, std::string> State() const {
    std::map<std::string, std::string> state{{"", testing::ReadText(path_)}};
    for (const auto& entry : fs::recursive_directory_iterator(path_ + ".d")) {
      if (entry.is_regular_file()) {
        state[entry.path().string()] = testing::ReadText(entry.path().string());
      }
    }
    return state;
  }

  static constexpr double kHalf = -0.61;  // of the turn, radians
  std::string folder_, path_;
  Project project_;
};

// The wavy square: its ground is the plane through its waves.
const GroundOptions kWavy{std::nullopt, 0.2};

TEST_F(ProjectGround, EverythingMovesTogether) {
  const auto before = project_.LoadSurveyFromCache();
  const auto level_before = project_.LoadLevel("500");
  const LevelledGround levelled = LevelGround(&project_, kWavy);
  EXPECT_GT(levelled.ground.share, 0.9);
  EXPECT_LT(levelled.tilt_rad, 0.1);  // the photographs said what is up

  const Project project = Project::Open(path_);
  EXPECT_EQ(*project.up(), (Vec3d{0, 0, 1}));
  EXPECT_EQ(*project.metres_per_unit(), 0.5);
  const auto after = project.LoadSurveyFromCache();
  ASSERT_EQ(after->points.size(), before->points.size());
  const Vec3d middle = levelled.ground.point;
  for (std::size_t i = 0; i < before->points.size(); ++i) {
    const Vec3d& p = after->points.position[i];
    EXPECT_LT(Length(p - levelled.transform.Apply(before->points.position[i])), 1e-9);
    EXPECT_LT(std::abs(p.z), 0.25);
    EXPECT_LT(std::hypot(p.x - middle.x, p.y - middle.y), 2);
    for (std::size_t k = 0; k < before->photographs.size(); ++k) {
      EXPECT_LT(Length(before->photographs[k].cam_from_world.Apply(before->points.position[i]) -
                       after->photographs[k].cam_from_world.Apply(p)),
                2e-8);
    }
  }
  EXPECT_EQ(project.import_summary().photographs_found, 4u);
  for (const Photograph& photo : after->photographs) EXPECT_TRUE(fs::exists(photo.path));
  EXPECT_LT(std::abs(project.bounds().Center().z), 0.1);
  const ViewContext view = project.MakeViewContext();
  ASSERT_FALSE(view.points.empty());
  for (const Vec3d& p : view.points) EXPECT_LT(std::abs(p.z), 0.25);

  // The levels: each metaball where the turn takes it.
  ASSERT_EQ(project.levels().size(), 2u);
  const auto level = project.LoadLevel("500");
  ASSERT_EQ(level->cloud.size(), level_before->cloud.size());
  EXPECT_EQ(level->stats.threshold, level_before->stats.threshold);
  const auto sorted = [](const Level& l, const auto& place) {
    std::vector<std::array<double, 3>> centers;
    for (const Vec3f& c : l.cloud.center) {
      const Vec3d p = place(l.cloud.frame.WorldFromLocal(c));
      centers.push_back({p.x, p.y, p.z});
    }
    std::sort(centers.begin(), centers.end());
    return centers;
  };
  const auto there = sorted(*level, [](const Vec3d& p) { return p; });
  const auto expected =
      sorted(*level_before, [&](const Vec3d& p) { return levelled.transform.Apply(p); });
  for (std::size_t i = 0; i < there.size(); ++i) {
    EXPECT_NEAR(there[i][0], expected[i][0], 1e-6);
    EXPECT_NEAR(there[i][1], expected[i][1], 1e-6);
    EXPECT_NEAR(there[i][2], expected[i][2], 1e-6);
  }
  // Nothing of the old state is left beside it.
  std::vector<std::string> files = testing::Listing(path_ + ".d");
  EXPECT_EQ(std::count_if(files.begin(), files.end(),
                          [](const std::string& name) { return name.starts_with("survey"); }),
            1);
  EXPECT_EQ(std::count_if(files.begin(), files.end(),
                          [](const std::string& name) { return name.starts_with("500"); }),
            1);
  // What is level stays so.
  const LevelledGround again = LevelGround(&project_, kWavy);
  EXPECT_LT(again.tilt_rad, 1e-6);
  // What leads from the source here, by the import's transform and both turns, survives the file.
  ImportOptions plain;
  plain.source = folder_ + "/ws";
  const auto source = ImportSurvey(plain, folder_ + "/plain.sherd").LoadSurveyFromCache();
  const auto twice = project_.LoadSurveyFromCache();
  const Project reread = Project::Open(path_);
  ASSERT_TRUE(reread.project_from_source());
  for (std::size_t i = 0; i < twice->points.size(); ++i) {
    EXPECT_LT(Length(twice->points.position[i] -
                     reread.project_from_source()->Apply(source->points.position[i])),
              1e-8);
  }
  const Vec3d& still = again.ground.point;
  EXPECT_LT(Length(again.transform.Apply(still) - still), 1e-6);
}

TEST_F(ProjectGround, ProgressRunsOnce) {
  double last = 0;
  int reports = 0;
  Control control;
  control.progress = [&](std::string_view what, double fraction) {
    EXPECT_GE(fraction, last) << what;
    last = fraction;
    ++reports;
  };
  LevelGround(&project_, kWavy, control);
  EXPECT_GT(reports, 5);
  EXPECT_EQ(last, 1);
}

TEST_F(ProjectGround, PhotographsThatAreAwayAreNotForgotten) {
  fs::rename(folder_ + "/ws/images", folder_ + "/away");
  LevelGround(&project_, kWavy);
  EXPECT_EQ(project_.LoadSurveyFromCache()->photographs[0].path, "");
  fs::rename(folder_ + "/away", folder_ + "/ws/images");
  EXPECT_NE(Project::Open(path_).LoadSurveyFromCache()->photographs[0].path, "");
}

TEST_F(ProjectGround, ARefusalChangesNothing) {
  const auto before = State();
  try {
    LevelGround(&project_, {std::nullopt, 1e-7});
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("trench.sherd: no ground to level"));
  }
  EXPECT_EQ(State(), before);
  // Nor does one half way: a level whose file is gone, or whoever asks to stop.
  fs::remove(path_ + ".d/1k/attributes.bin");
  const auto damaged = State();
  EXPECT_THROW(LevelGround(&project_, kWavy), InputError);
  EXPECT_EQ(State(), damaged);
  std::stop_source stop;
  Control control;
  control.stop = stop.get_token();
  control.progress = [&](std::string_view what, double) {
    if (what.starts_with("500")) stop.request_stop();
  };
  EXPECT_THROW(LevelGround(&project_, kWavy, control), Cancelled);
  EXPECT_EQ(State(), damaged);
}

TEST_F(ProjectGround, UpIsSaid) {
  project_.SetUp({0, -3, 0}, *project_.LoadSurveyFromCache());
  project_.Save();
  EXPECT_EQ(*Project::Open(path_).up(), (Vec3d{0, -1, 0}));
}

}  // namespace
}  // namespace sherd
