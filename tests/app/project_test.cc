#include "app/project/project.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <functional>

#include "app/project/project_lock.h"
#include "metaball/error.h"
#include "tests/app/test_workspace.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string MessageOf(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

// A folder with a workspace in ws/ and a project path beside it.
class ProjectTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = testing::FreshFolder("project");
    testing::WriteWorkspace(folder_ + "/ws", 2500);
    path_ = folder_ + "/trench.sherd";
  }

  ImportOptions Options() const {
    ImportOptions options;
    options.source = folder_ + "/ws";
    return options;
  }
  Project Import(const Control& control = {}) { return ImportSurvey(Options(), path_, control); }

  // Names and contents of everything the project consists of.
  std::vector<std::pair<std::string, std::string>> State() const {
    std::vector<std::pair<std::string, std::string>> state;
    if (fs::exists(path_)) state.emplace_back("", testing::ReadText(path_));
    if (fs::exists(path_ + ".d")) {
      for (const auto& entry : fs::recursive_directory_iterator(path_ + ".d")) {
        state.emplace_back(entry.path().string(),
                           entry.is_regular_file() ? testing::ReadText(entry.path().string()) : "");
      }
    }
    std::sort(state.begin(), state.end());
    return state;
  }

  std::string folder_, path_;
};

TEST_F(ProjectTest, ImportIsSavedAndOpens) {
  ImportOptions options = Options();
  options.metres_per_unit = 0.25;
  options.up = Vec3d{0, 0, 2};
  const Project imported = ImportSurvey(options, path_);
  const Project project = Project::Open(path_);
  const ImportSummary& summary = project.import_summary();
  EXPECT_EQ(summary.source, fs::path(folder_ + "/ws").lexically_normal().string());
  EXPECT_EQ(summary.points, 2500u);
  EXPECT_EQ(summary.photographs, 4u);
  EXPECT_EQ(summary.photographs_found, 4u);
  EXPECT_EQ(summary.cameras, 1u);
  EXPECT_FALSE(summary.dense);
  EXPECT_TRUE(summary.has_visibility);
  EXPECT_EQ(project.metres_per_unit(), 0.25);
  ASSERT_TRUE(project.up());
  EXPECT_EQ(*project.up(), (Vec3d{0, 0, 1}));
  EXPECT_EQ(project.bounds().min, imported.bounds().min);
  EXPECT_EQ(project.title(), "trench");
  EXPECT_THAT(testing::Listing(path_ + ".d"), ElementsAre("outline.bin", "survey.bin"));

  const auto survey = project.LoadSurveyFromCache();
  EXPECT_EQ(survey->points.position, testing::WavyPoints(2500));
  EXPECT_EQ(survey->points.color.size(), 2500u);
  ASSERT_EQ(survey->photographs.size(), 4u);
  EXPECT_TRUE(fs::exists(survey->photographs[3].path)) << survey->photographs[3].path;
  EXPECT_EQ(survey->metres_per_unit, 0.25);
  EXPECT_FALSE(project.MakeViewContext().points.empty());
}

TEST_F(ProjectTest, MasksAreRememberedAlsoWhenTheyHaveGone) {
  ImportOptions options = Options();
  options.mask_folder = folder_ + "/masks";
  fs::create_directory(options.mask_folder);
  const std::string mask = options.mask_folder + "/photo_2.png.png";
  testing::WriteText(mask, "P5\n2 1\n255\n" + std::string("\0\xff", 2));
  const Project project = ImportSurvey(options, path_);
  EXPECT_EQ(project.LoadSurveyFromCache()->photographs[2].mask_path, mask);
  EXPECT_EQ(project.LoadSurveyFromCache()->photographs[0].mask_path, "");
  // Whoever reads it is to say that it is missing.
  fs::remove(mask);
  EXPECT_EQ(project.LoadSurveyFromCache()->photographs[2].mask_path, mask);
}

TEST_F(ProjectTest, LevelsAreBuiltSavedAndLoaded) {
  Project project = Import();
  BuildLevels(&project, {2000, 500}, {});
  ASSERT_EQ(project.levels().size(), 2u);
  EXPECT_EQ(project.levels()[0].name, "500");  // in ascending order
  EXPECT_EQ(project.LargestLevel().name, "2k");

  const Project again = Project::Open(path_);
  ASSERT_EQ(again.levels().size(), 2u);
  for (const char* name : {"500", "2k"}) {
    const LevelEntry &a = project.FindLevel(name), &b = again.FindLevel(name);
    EXPECT_EQ(a.stats.count, b.stats.count);
    EXPECT_EQ(a.stats.spacing, b.stats.spacing);
    EXPECT_EQ(a.stats.radius_max, b.stats.radius_max);
    const auto level = again.LoadLevel(name);
    EXPECT_EQ(level->cloud.size(), a.stats.count);
    EXPECT_NEAR(static_cast<double>(level->cloud.size()), static_cast<double>(a.stats.target_count),
                0.01 * static_cast<double>(a.stats.target_count));
    EXPECT_EQ(level->name, name);
    EXPECT_EQ(level->normal.size(), level->cloud.size());
    EXPECT_EQ(level->photo_begin.size(), level->cloud.size() + 1);
  }
  EXPECT_EQ(&again.FindLevel("2000"), &again.FindLevel("2k"));
  EXPECT_THAT(MessageOf([&] { again.FindLevel("3k"); }), HasSubstr("its levels are 500, 2k"));

  // Building one again replaces it and leaves nothing behind.
  BuildLevels(&project, {500}, {});
  EXPECT_EQ(Project::Open(path_).levels().size(), 2u);
  EXPECT_THAT(testing::Listing(path_ + ".d"),
              ElementsAre("2k", "500-2", "outline.bin", "survey.bin"));
  EXPECT_EQ(Project::Open(path_).LoadLevel("500")->cloud.size(),
            project.FindLevel("500").stats.count);
}

TEST_F(ProjectTest, AProjectWithoutLevelsSaysWhatToDo) {
  const Project project = Import();
  EXPECT_THAT(MessageOf([&] { project.LargestLevel(); }), HasSubstr("sherd build"));
  EXPECT_THAT(MessageOf([&] { project.FindLevel("63k"); }), HasSubstr("sherd build"));
}

TEST_F(ProjectTest, ImportAgainReplacesEverything) {
  Project project = Import();
  BuildLevels(&project, {500}, {});
  fs::remove_all(folder_ + "/ws");
  testing::WriteWorkspace(folder_ + "/ws", 900);
  Import();
  EXPECT_EQ(Project::Open(path_).import_summary().points, 900u);
  EXPECT_TRUE(Project::Open(path_).levels().empty());
  EXPECT_THAT(testing::Listing(path_ + ".d"), ElementsAre("outline-2.bin", "survey-2.bin"));
  Import();
  EXPECT_THAT(testing::Listing(path_ + ".d"), ElementsAre("outline.bin", "survey.bin"));
}

TEST_F(ProjectTest, FailedImportLeavesTheProjectAsItWas) {
  Project project = Import();
  BuildLevels(&project, {500}, {});
  const auto before = State();
  testing::WriteText(folder_ + "/ws/sparse/0/points3D.txt", "1 2 three\n");
  EXPECT_THROW(Import(), InputError);
  EXPECT_EQ(State(), before);
  EXPECT_EQ(Project::Open(path_).LoadLevel("500")->cloud.size(),
            project.FindLevel("500").stats.count);
}

TEST_F(ProjectTest, FailedFirstImportLeavesNothing) {
  fs::remove(folder_ + "/ws/sparse/0/points3D.txt");
  EXPECT_THROW(Import(), InputError);
  EXPECT_THAT(testing::Listing(folder_), ElementsAre("ws"));
}

TEST_F(ProjectTest, CancelAtAnyReportLeavesTheProjectAsItWas) {
  Project project = Import();
  const auto before = State();
  const auto cancel_at = [](int k, const std::function<void(const Control&)>& work) {
    std::stop_source stop;
    int reports = 0;
    Control control;
    control.stop = stop.get_token();
    control.progress = [&](std::string_view, double) {
      if (++reports == k) stop.request_stop();
    };
    try {
      work(control);
      return false;
    } catch (const Cancelled&) {
      return true;
    }
  };
  int cancelled = 0;
  for (int k = 1; k < 40; ++k) {
    if (!cancel_at(k, [&](const Control& c) { Import(c); })) break;
    EXPECT_EQ(State(), before) << "import, report " << k;
    ++cancelled;
  }
  EXPECT_GT(cancelled, 1);
  cancelled = 0;
  for (int k = 1; k < 40; ++k) {
    Project copy = Project::Open(path_);
    const auto now = State();
    if (!cancel_at(k, [&](const Control& c) { BuildLevels(&copy, {400}, {}, c); })) break;
    EXPECT_EQ(State(), now) << "build, report " << k;
    ++cancelled;
  }
  EXPECT_GT(cancelled, 2);
}

TEST_F(ProjectTest, FinishedLevelsStayWhenALaterOneIsCancelled) {
  Project project = Import();
  std::stop_source stop;
  Control control;
  control.stop = stop.get_token();
  control.progress = [&](std::string_view what, double) {
    if (what.starts_with("900")) stop.request_stop();
  };
  EXPECT_THROW(BuildLevels(&project, {400, 900}, {}, control), Cancelled);
  ASSERT_EQ(Project::Open(path_).levels().size(), 1u);
  EXPECT_EQ(Project::Open(path_).levels()[0].name, "400");
  EXPECT_EQ(project.levels().size(), 1u);
  EXPECT_THAT(testing::Listing(path_ + ".d"), ElementsAre("400", "outline.bin", "survey.bin"));
}

TEST_F(ProjectTest, RefusesToReplaceWhatIsNoProject) {
  testing::WriteText(path_, "my notes\n");
  EXPECT_THAT(MessageOf([&] { Import(); }), HasSubstr("will not be replaced"));
  EXPECT_EQ(testing::ReadText(path_), "my notes\n");
  fs::create_directory(folder_ + "/folder.sherd");
  path_ = folder_ + "/folder.sherd";
  EXPECT_THAT(MessageOf([&] { Import(); }), HasSubstr("is a folder"));
  path_ = folder_ + "/missing/trench.sherd";
  EXPECT_THAT(MessageOf([&] { Import(); }), HasSubstr("does not exist; make it first"));
}

TEST_F(ProjectTest, UnwritableFolderIsOneError) {
  if (geteuid() == 0) {
    // The superuser may write anywhere: a file where the data folder should be fails for all.
    testing::WriteText(path_ + ".d", "in the way");
  } else {
    chmod(folder_.c_str(), 0555);
  }
  EXPECT_THROW(Import(), OutputError);
  chmod(folder_.c_str(), 0755);
  EXPECT_FALSE(fs::exists(path_));
}

TEST_F(ProjectTest, ADamagedProjectFileIsNamedByItsPlace) {
  Project project = Import();
  BuildLevels(&project, {500}, {});
  const std::string text = testing::ReadText(path_);
  const std::string copy = folder_ + "/copy.sherd";
  // Cut anywhere: never a crash, always an InputError.
  for (std::size_t n = 0; n + 2 < text.size(); n += 1 + n / 40) {
    testing::WriteText(copy, text.substr(0, n));
    EXPECT_THROW(Project::Open(copy), InputError) << "cut at " << n;
  }
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string changed = text;
    const std::size_t at = changed.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    testing::WriteText(copy, changed.replace(at, from.size(), to));
    return MessageOf([&] { Project::Open(copy); });
  };
  EXPECT_THAT(with("\"up\": [", "\"up\": [["), HasSubstr("copy.sherd: line "));
  EXPECT_THAT(with("\"version\": 2", "\"version\": 3"), HasSubstr("use a newer Sherd"));
  EXPECT_THAT(with("\"version\": 2", "\"version\": \"2\""),
              HasSubstr("version: should be a whole"));
  EXPECT_THAT(with("\"reduction\": \"voxel\"", "\"reduction\": \"sieve\""),
              HasSubstr("levels[0].options.reduction: is unknown: sieve"));
  EXPECT_THAT(with("\"points\": 2500", "\"points\": -1"), HasSubstr("import.points"));
  EXPECT_THAT(with("\"spacing\":", "\"spaceing\":"),
              HasSubstr("levels[0].stats.spacing: is missing"));
  EXPECT_THAT(with("\"format\": \"sherd project\"", "\"format\": \"other\""),
              HasSubstr("is no Sherd project"));
  EXPECT_THAT(with("\"metres_per_unit\": null", "\"metres_per_unit\": 0"),
              HasSubstr("metres_per_unit: should be above 0"));
  testing::WriteText(copy, "[1, 2]");
  EXPECT_THROW(Project::Open(copy), InputError);
  EXPECT_THROW(Project::Open(folder_), InputError);
  EXPECT_THROW(Project::Open(folder_ + "/none.sherd"), InputError);
}

TEST_F(ProjectTest, KeepsHowALevelWasReducedAndItsErrors) {
  Project project = Import();
  LevelOptions options;
  options.reduction = Reduction::kAdaptive;
  options.nested = true;
  BuildLevels(&project, {500}, options);
  const LevelEntry built = project.FindLevel("500"), read = Project::Open(path_).FindLevel("500");
  EXPECT_EQ(read.options.reduction, Reduction::kAdaptive);
  EXPECT_TRUE(read.options.nested);
  EXPECT_TRUE(read.options.smooth_noise);
  EXPECT_TRUE(read.options.close_holes);
  EXPECT_EQ(read.stats.closing_points, built.stats.closing_points);
  EXPECT_TRUE(read.stats.HasErrors());
  EXPECT_GT(read.stats.error_mean, 0);
  EXPECT_GE(read.stats.error_p95, read.stats.error_mean);
  EXPECT_GE(read.stats.error_max, read.stats.error_p95);
  EXPECT_EQ(read.stats.error_mean, built.stats.error_mean);
  EXPECT_EQ(Project::Open(path_).LoadLevel("500")->depth.size(), 500u);
}

// As version 1 wrote it: without the errors, and with levels reduced by voxels.
TEST_F(ProjectTest, OpensProjectsOfVersion1) {
  Project project = Import();
  BuildLevels(&project, {500}, {});
  std::string text = testing::ReadText(path_);
  for (const char* key :
       {"\"reduction\"", "\"nested\"", "\"smooth_noise\"", "\"close_holes\"", "\"closing_points\"",
        "\"error_mean\"", "\"error_p95\"", "\"error_max\""}) {
    const std::size_t at = text.find(key);
    ASSERT_NE(at, std::string::npos) << key;
    text.erase(at, text.find('\n', at) + 1 - at);
  }
  const std::string version = "\"version\": 2";
  text.replace(text.find(version), version.size(), "\"version\": 1");
  testing::WriteText(path_, text);
  const Project old = Project::Open(path_);
  ASSERT_EQ(old.levels().size(), 1u);
  EXPECT_FALSE(old.levels()[0].stats.HasErrors());
  EXPECT_EQ(old.levels()[0].options.reduction, Reduction::kVoxel);
  EXPECT_FALSE(old.levels()[0].options.nested);
  EXPECT_FALSE(old.levels()[0].options.smooth_noise);
  EXPECT_FALSE(old.levels()[0].options.close_holes);
  EXPECT_EQ(old.levels()[0].stats.closing_points, 0u);
  EXPECT_EQ(old.levels()[0].stats.count, 500u);
}

TEST_F(ProjectTest, MissingAndDamagedDataAreNamed) {
  Project project = Import();
  BuildLevels(&project, {500}, {});
  const std::string attributes = path_ + ".d/500/attributes.bin";
  const std::string whole = testing::ReadText(attributes);
  testing::WriteText(attributes, whole.substr(0, whole.size() / 2));
  EXPECT_THAT(MessageOf([&] { project.LoadLevel("500"); }), HasSubstr("attributes.bin: byte"));
  fs::remove(attributes);
  EXPECT_THAT(MessageOf([&] { project.LoadLevel("500"); }),
              HasSubstr("sherd build " + path_ + " --levels 500"));
  fs::rename(path_ + ".d", folder_ + "/elsewhere");
  EXPECT_THAT(MessageOf([&] { project.LoadSurveyFromCache(); }), HasSubstr("keep it beside"));
}

TEST_F(ProjectTest, OpensAfterItsSourceIsGoneAndFindsMovedPhotographs) {
  Import();
  fs::create_directory(folder_ + "/archive");
  fs::rename(folder_ + "/ws/images", folder_ + "/archive/photos_2019");
  fs::remove_all(folder_ + "/ws");
  Project project = Project::Open(path_);
  auto survey = project.LoadSurveyFromCache();
  EXPECT_EQ(survey->points.size(), 2500u);
  EXPECT_TRUE(survey->photographs[0].path.empty());
  project.SetPhotoFolder(folder_ + "/archive/photos_2019");
  project.Save();
  survey = Project::Open(path_).LoadSurveyFromCache();
  EXPECT_TRUE(fs::exists(survey->photographs[0].path));
  EXPECT_TRUE(fs::exists(survey->photographs[3].path));
}

TEST_F(ProjectTest, MovesAsAWhole) {
  Project project = Import();
  BuildLevels(&project, {500}, {});
  const std::string moved = testing::FreshFolder("moved");
  fs::remove(moved);
  fs::rename(folder_, moved);
  const Project there = Project::Open(moved + "/trench.sherd");
  EXPECT_EQ(there.LoadLevel("500")->cloud.size(), project.FindLevel("500").stats.count);
  EXPECT_EQ(there.import_summary().source, fs::path(moved + "/ws").lexically_normal().string());
  EXPECT_TRUE(fs::exists(there.LoadSurveyFromCache()->photographs[1].path));
  // The file alone may be renamed: it still names its data.
  fs::rename(moved + "/trench.sherd", moved + "/other.sherd");
  Project renamed = Project::Open(moved + "/other.sherd");
  BuildLevels(&renamed, {300}, {});
  EXPECT_EQ(Project::Open(moved + "/other.sherd").levels().size(), 2u);
}

TEST_F(ProjectTest, ChangesOfAnotherProgramAreNotLost) {
  Project mine = Import();
  Project theirs = Project::Open(path_);
  theirs.SetMetresPerUnit(0.5);
  theirs.Save();
  mine.SetMetresPerUnit(2.0);
  EXPECT_THAT(MessageOf([&] { mine.Save(); }), HasSubstr("open it again"));
  EXPECT_THAT(MessageOf([&] { BuildLevels(&mine, {500}, {}); }), HasSubstr("open it again"));
  EXPECT_EQ(Project::Open(path_).metres_per_unit(), 0.5);
  // Saved one after the other by one program is no conflict.
  theirs.Save();
  theirs.Save();
}

TEST_F(ProjectTest, OnlyOneProgramWorksOnAProject) {
  Project project = Import();
  const ProjectLock lock(path_, path_ + ".d");
  EXPECT_THAT(MessageOf([&] { Import(); }), HasSubstr("another program is working"));
  EXPECT_THAT(MessageOf([&] { BuildLevels(&project, {500}, {}); }),
              HasSubstr("another program is working"));
  EXPECT_THAT(MessageOf([&] { project.Save(); }), HasSubstr("another program is working"));
}

TEST_F(ProjectTest, RefusesNonsense) {
  ImportOptions options = Options();
  options.metres_per_unit = 0;
  EXPECT_THROW(ImportSurvey(options, path_), InputError);
  options = Options();
  options.up = Vec3d{0, 0, 0};
  EXPECT_THROW(ImportSurvey(options, path_), InputError);
  options = Options();
  options.points = PointSource::kDense;  // there is no dense cloud
  EXPECT_THROW(ImportSurvey(options, path_), InputError);
  options = Options();
  options.model = 3;
  EXPECT_THROW(ImportSurvey(options, path_), InputError);
  EXPECT_THAT(testing::Listing(folder_), ElementsAre("ws"));
  Project project = Import();
  EXPECT_THROW(BuildLevels(&project, {}, {}), InputError);
  EXPECT_THROW(BuildLevels(&project, {0}, {}), InputError);
}

TEST(ModelNumbers, FollowTheFolders) {
  Workspace workspace;
  const auto add = [&](const char* folder) {
    SparseModelFiles model;
    model.folder = folder;
    workspace.models.push_back(model);
  };
  add("ws/sparse/1");
  add("ws/sparse/0/");
  add("ws/dense/sparse");
  add("ws/other/1");
  add("ws/sparse/01x");
  EXPECT_THAT(ModelNumbers(workspace), ElementsAre(1, 0, 2, 3, 4));
  EXPECT_THAT(ModelNumbers({}), IsEmpty());
}

}  // namespace
}  // namespace sherd
