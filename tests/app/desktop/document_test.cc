#include "app/desktop/document.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "app/desktop/formatting.h"
#include "app/desktop/import_dialog.h"
#include "metaball/error.h"
#include "metaball/metaball_file.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;
using Counts = std::vector<std::uint64_t>;

fs::path Folder() {
  const fs::path folder = fs::path(testing::TempDir()) /
                          (std::string("sherd_desktop_document_") +
                           testing::UnitTest::GetInstance()->current_test_info()->name());
  fs::create_directories(folder);
  return folder;
}

std::string Write(const std::string& name, const std::string& content) {
  const fs::path path = Folder() / name;
  std::ofstream(path, std::ios::binary) << content;
  return path.string();
}

TEST(SuggestLevels, DefaultsAsFarAsThereArePoints) {
  EXPECT_EQ(SuggestLevels(2'000'000), (Counts{63000, 126000, 252000, 502000}));
  EXPECT_EQ(SuggestLevels(440'996), (Counts{63000, 126000, 252000}));
  EXPECT_EQ(SuggestLevels(126'000), (Counts{63000, 126000}));
}

TEST(SuggestLevels, HalvesOfASmallSurvey) {
  EXPECT_EQ(SuggestLevels(8727), (Counts{1000, 2100, 4300, 8700}));
  EXPECT_EQ(SuggestLevels(90'000), (Counts{11000, 22000, 45000, 90000}));
  EXPECT_EQ(SuggestLevels(300), (Counts{150, 300}));
  EXPECT_EQ(SuggestLevels(7), (Counts{7}));
  EXPECT_EQ(SuggestLevels(0), Counts());
}

TEST(ParseLevels, SortsAndDropsDoubles) {
  EXPECT_EQ(ParseLevels(QStringLiteral(" 126k,63k, 1.5M,63000 ,")),
            (Counts{63000, 126000, 1500000}));
  EXPECT_EQ(ParseLevels(QString()), Counts());
  EXPECT_THROW(ParseLevels(QStringLiteral("63k, lots")), InputError);
  EXPECT_EQ(formatLevels({63000, 1500000}), QStringLiteral("63k, 1.5M"));
}

TEST(FormatCoordinate, AsManyDecimalsAsAPixelHas) {
  EXPECT_EQ(formatCoordinate(1234.56789, 0.01), QStringLiteral("1234.57"));
  EXPECT_EQ(formatCoordinate(1234.56789, 0.009), QStringLiteral("1234.568"));
  EXPECT_EQ(formatCoordinate(1234.56789, 20), QStringLiteral("1235"));
}

constexpr const char* kPlyHeader =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\n"
    "property double z\n";

TEST(Document, OpensAPlyWithRadii) {
  const std::string path =
      Write("cloud.ply", std::string(kPlyHeader) +
                             "property double radius\nend_header\n0 0 0 0.5\n1 0 0 0.5\n2 0 0 1\n");
  EXPECT_EQ(ClassifyPath(path), PathKind::kCloud);
  const auto document = Document::OpenCloud(path, {});
  ASSERT_EQ(document->levels().size(), 1u);
  EXPECT_EQ(document->title(), "cloud");
  EXPECT_EQ(document->project(), nullptr);
  EXPECT_FALSE(document->HasPhotographs());
  const LevelStats& stats = document->levels()[0].stats;
  EXPECT_EQ(stats.count, 3u);
  EXPECT_DOUBLE_EQ(stats.radius_min, 0.5);
  EXPECT_DOUBLE_EQ(stats.radius_max, 1.0);
  EXPECT_GT(stats.spacing, 0.3);  // three points in a row say little about a surface
  EXPECT_LT(stats.spacing, 3.0);
  EXPECT_EQ(document->LoadLevel(0, {})->cloud.size(), 3u);
}

TEST(Document, OpensAMetaballFileWithItsThreshold) {
  CloudInput input;
  input.center = {{0, 0, 0}, {1, 1, 1}};
  input.uniform_radius = 2;
  const std::string path = (Folder() / "two.metaballs").string();
  WriteMetaballFile(path, BuildCloud(input), 0.25);
  EXPECT_EQ(ClassifyPath(path), PathKind::kCloud);
  const auto document = Document::OpenCloud(path, {});
  EXPECT_EQ(document->levels()[0].stats.threshold, 0.25);
  const auto scaled = document->WithScale(0.01);
  EXPECT_EQ(scaled->metres_per_unit(), 0.01);
  EXPECT_FALSE(document->metres_per_unit());
  EXPECT_EQ(scaled->LoadLevel(0, {}), document->LoadLevel(0, {}));
}

TEST(Document, RefusesWhatHoldsNothing) {
  const std::string bare =
      Write("bare.ply", std::string(kPlyHeader) + "end_header\n0 0 0\n1 0 0\n2 0 0\n");
  EXPECT_EQ(ClassifyPath(bare), PathKind::kWorkspace);  // to make levels from
  const std::string empty =
      Write("nan.ply", std::string(kPlyHeader) + "end_header\nnan 0 0\nnan 0 0\nnan 0 0\n");
  EXPECT_THROW(Document::OpenCloud(empty, {}), Error);
  EXPECT_THROW(ClassifyPath((Folder() / "no such file").string()), InputError);
  EXPECT_THROW(Document::OpenProject(Write("bad.sherd", "{ this is no project")), InputError);
  const std::string folder = (Folder() / "nothing").string();
  fs::create_directories(folder);
  EXPECT_EQ(ClassifyPath(folder), PathKind::kWorkspace);
}

}  // namespace
}  // namespace sherd
