// Reconstruction by another program: what it says, how it ends badly, and that nothing is lost
// then.
#include "app/project/colmap_run.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>

#include "app/project/child_process.h"
#include "app/project/project.h"
#include "metaball/error.h"
#include "tests/app/run_sherd.h"
#include "tests/app/test_workspace.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// --- a program and its output ---

std::vector<std::string> Shell(const std::string& script) { return {"/bin/sh", "-c", script}; }

TEST(ChildProcess, LinesExitCodesSignalsAndTheLog) {
  const std::string log = testing::FreshFolder("child") + "/log";
  std::vector<std::string> lines;
  const auto take = [&](std::string_view line) { lines.emplace_back(line); };
  EXPECT_EQ(
      RunChild(Shell("echo one; echo two >&2; printf three; exit 7"), log, take, {}).exit_code, 7);
  EXPECT_THAT(lines, ElementsAre("one", "two", "three"));
  EXPECT_EQ(testing::ReadText(log), "one\ntwo\nthree");
  EXPECT_TRUE(RunChild(Shell("true"), log, {}, {}).good());
  EXPECT_EQ(RunChild(Shell("kill -9 $$"), "", {}, {}).signal, 9);
  EXPECT_TRUE(RunChild(Shell("! read line"), "", {}, {}).good()) << "nothing to read";
  EXPECT_THROW(RunChild({"/no/such/program"}, "", {}, {}), InputError);
  EXPECT_THROW(RunChild(Shell("true"), "/no/such/folder/log", {}, {}), OutputError);
  // A log on a full disk.
  EXPECT_THROW(RunChild(Shell("while echo x; do :; done"), "/dev/full", {}, {}), OutputError);
}

TEST(ChildProcess, StoppingEndsTheWholeGroup) {
  const std::string folder = testing::FreshFolder("group");
  std::stop_source source;
  Control control;
  control.stop = source.get_token();
  // A child that does not listen, with a grandchild. Both hold the writing end of a pipe.
  const std::string pipe = folder + "/pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const int reading = open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  ASSERT_GE(reading, 0);
  const std::string script =
      "trap '' TERM; exec 3> " + pipe + "; sleep 60 & echo ready; wait; sleep 60";
  const auto start = std::chrono::steady_clock::now();
  EXPECT_THROW(RunChild(
                   Shell(script), "", [&](std::string_view) { source.request_stop(); }, control),
               Cancelled);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
  // Its end is closed when neither runs any more.
  pollfd end{reading, POLLIN, 0};
  EXPECT_EQ(poll(&end, 1, 2000), 1) << "somebody of the group still runs";
  EXPECT_NE(end.revents & POLLHUP, 0);
  close(reading);
}

// --- COLMAP's words ---

TEST(ColmapProgress, WhatEachStageSays) {
  EXPECT_EQ(ColmapProgress("Processed file [3/12]", 12), 0.25);
  EXPECT_EQ(
      ColmapProgress("I20240101 12:00:00.1 99 feature_extraction.cc:1] Processed file [6/12]", 12),
      0.5);
  EXPECT_EQ(ColmapProgress("Matching block [1/2, 2/4] in 0.5s", 12), 0.25)
      << "half of the first of two";
  EXPECT_EQ(ColmapProgress("Matching block [2/2]", 12), 1);
  EXPECT_EQ(ColmapProgress("Registering image #7 (3)", 12), 0.25);
  EXPECT_EQ(ColmapProgress("Registering image #7 (99)", 12), 1);
  EXPECT_EQ(ColmapProgress("Undistorting image [1/4]", 4), 0.25);
  EXPECT_EQ(ColmapProgress("Processing view 1 / 4 for a.jpg", 4), 0.25);
  EXPECT_EQ(ColmapProgress("Fusing image [2/4] with index 7 in 0.1s", 4), 0.5);
  for (const char* line : {"", "[", "[a/b]", "[1/0]", "[-1/3]", "=> Image sees 100 / 200 points",
                           "Registering image #7", "Registering image #7 (x)", "[1/"}) {
    EXPECT_FALSE(ColmapProgress(line, 12)) << line;
  }
}

// --- the stages ---

// A script that answers as COLMAP 3.8 without CUDA does; `stage` of it does `instead`.
class FakeColmap {
 public:
  explicit FakeColmap(const std::string& name, bool cuda = false)
      : folder(testing::FreshFolder(name)) {
    fs::create_directories(folder + "/photos/sub");
    for (int i = 0; i < 3; ++i) {
      testing::WriteText(folder + "/photos/sub/" + std::to_string(i) + ".jpg", "x");
    }
    options.photos = folder + "/photos";
    options.workspace = folder + "/ws";
    options.colmap = folder + "/colmap";
    testing::WriteWorkspace(folder + "/truth", 900, false);
    Write("", "", cuda);
  }

  void Write(const std::string& stage, const std::string& instead, bool cuda = false) {
    std::string script =
        "#!/bin/sh\nif [ \"$1\" = help ]; then echo 'COLMAP 3.8 -- Structure-from-Motion'; "
        "echo '  (Commit x on y " +
        std::string(cuda ? "with" : "without") +
        " CUDA)'; exit 0; fi\n"
        "if [ \"$2\" = -h ]; then echo '  --SiftExtraction.use_gpu arg (=1)'; "
        "echo '  --SiftMatching.use_gpu arg (=1)'; exit 0; fi\n"
        "echo \"$@\" >> '" +
        folder + "/calls'\nstage=$1\n" +
        // --output_path X and --database_path X into variables.
        "while [ $# -gt 0 ]; do case $1 in --output_path) out=$2;; --database_path) db=$2;; "
        "--workspace_path) dense=$2;; esac; shift; done\n";
    if (!stage.empty()) script += "if [ $stage = " + stage + " ]; then " + instead + "; fi\n";
    script +=
        "case $stage in\n"
        "feature_extractor) echo 'Processed file [1/3]'; echo features > $db;;\n"
        "*_matcher) echo matches >> $db;;\n"
        "mapper) mkdir $out/0 $out/1; cp '" +
        folder +
        "/truth/sparse/0/'* $out/1;"
        "printf '\\4\\0\\0\\0\\0\\0\\0\\0' > $out/1/images.bin;"
        "printf '\\2\\0\\0\\0\\0\\0\\0\\0' > $out/0/images.bin;"
        "echo 'Registering image #1 (3)';;\n"
        "image_undistorter) mkdir $out/sparse $out/images $out/stereo;;\n"
        "patch_match_stereo) mkdir -p $dense/stereo/depth_maps;;\n"
        "stereo_fusion) echo ply > $out;;\n"
        "*) echo unknown command; exit 1;;\nesac\n";
    testing::WriteText(options.colmap, script);
    fs::permissions(options.colmap, fs::perms::owner_all);
  }

  // The commands since the last question.
  std::vector<std::string> Calls() {
    std::vector<std::string> commands;
    std::string text = fs::exists(folder + "/calls") ? testing::ReadText(folder + "/calls") : "";
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t end = text.find('\n', at);
      commands.push_back(text.substr(at, text.find(' ', at) - at));
      at = end + 1;
    }
    fs::remove(folder + "/calls");
    return commands;
  }

  std::string Error() {
    try {
      Reconstruct(options);
    } catch (const sherd::Error& error) {
      return error.what();
    }
    return "no error";
  }

  std::string folder;
  ReconstructOptions options;
};

TEST(Reconstruct, AllStagesThenNoneAgain) {
  FakeColmap fake("reconstruct_all");
  ReconstructResult result = Reconstruct(fake.options);
  EXPECT_EQ(result.version, "COLMAP 3.8");
  EXPECT_FALSE(result.cuda);
  EXPECT_EQ(result.models, 2u);
  EXPECT_THAT(result.no_dense, HasSubstr("without CUDA"));
  EXPECT_THAT(fake.Calls(), ElementsAre("feature_extractor", "exhaustive_matcher", "mapper",
                                        "image_undistorter"));
  EXPECT_TRUE(fs::exists(fake.options.workspace + "/sparse/1/images.bin"));
  EXPECT_TRUE(fs::exists(fake.options.workspace + "/dense/stereo"));
  EXPECT_FALSE(fs::exists(fake.options.workspace + "/sparse.part"));
  EXPECT_THAT(testing::ReadText(result.log), HasSubstr("Processed file [1/3]"));
  result = Reconstruct(fake.options);
  EXPECT_THAT(fake.Calls(), ElementsAre());
  for (const ReconstructStage& stage : result.stages) EXPECT_TRUE(stage.skipped) << stage.name;
  // Another matcher: what follows it is made again, what stands before it is kept.
  fake.options.sequential = true;
  Reconstruct(fake.options);
  EXPECT_THAT(fake.Calls(), ElementsAre("sequential_matcher", "mapper", "image_undistorter"));
  // A result that somebody has removed is made again.
  fs::remove_all(fake.options.workspace + "/dense");
  Reconstruct(fake.options);
  EXPECT_THAT(fake.Calls(), ElementsAre("image_undistorter"));
}

TEST(Reconstruct, TheLargestModelIsUndistortedWithoutADisplayOrAGpu) {
  FakeColmap fake("reconstruct_arguments");
  fake.Write("image_undistorter", "echo \"screen $QT_QPA_PLATFORM\"");
  const ReconstructResult result = Reconstruct(fake.options);
  const std::string calls = testing::ReadText(fake.folder + "/calls");
  EXPECT_THAT(calls, HasSubstr("--input_path " + fake.options.workspace + "/sparse/1 "));
  EXPECT_THAT(calls, HasSubstr("--SiftExtraction.use_gpu 0"));
  EXPECT_THAT(calls, HasSubstr("--SiftMatching.use_gpu 0"));
  EXPECT_THAT(testing::ReadText(result.log), HasSubstr("screen offscreen"));
}

TEST(Reconstruct, WithCudaTheDenseStagesFollow) {
  FakeColmap fake("reconstruct_cuda", true);
  const ReconstructResult result = Reconstruct(fake.options);
  EXPECT_EQ(result.no_dense, "");
  EXPECT_THAT(fake.Calls(),
              ElementsAre("feature_extractor", "exhaustive_matcher", "mapper", "image_undistorter",
                          "patch_match_stereo", "stereo_fusion"));
  EXPECT_TRUE(fs::exists(fake.options.workspace + "/dense/fused.ply"));
}

TEST(Reconstruct, AStageThatFailsLeavesTheOthersAndIsResumed) {
  for (const char* stage :
       {"feature_extractor", "exhaustive_matcher", "mapper", "image_undistorter"}) {
    for (const char* how : {"echo the reason; exit 3", "echo before; kill -9 $$",
                            "echo x > /dev/full || { echo No space left on device; exit 1; }"}) {
      FakeColmap fake("reconstruct_fails");
      fake.Write(stage, how);
      const std::string error = fake.Error();
      EXPECT_THAT(error, HasSubstr(stage));
      EXPECT_THAT(error, HasSubstr("colmap.log"));
      EXPECT_THAT(error, ::testing::AnyOf(HasSubstr("exit code 3, its last words: the reason"),
                                          HasSubstr("killed by signal 9"),
                                          HasSubstr("No space left on device")));
      EXPECT_THAT(error, Not(HasSubstr("\n")));
      const std::vector<std::string> before = fake.Calls();
      ASSERT_FALSE(before.empty());
      EXPECT_EQ(before.back(), stage);
      fake.Write("", "");
      Reconstruct(fake.options);
      const std::vector<std::string> after = fake.Calls();
      ASSERT_FALSE(after.empty());
      EXPECT_EQ(after.front(), stage) << "gone on with what failed";
      EXPECT_EQ(before.size() + after.size(), 5u) << "four stages, one of them twice";
    }
  }
}

TEST(Reconstruct, AnEarlierResultStaysWhileANewOneFails) {
  FakeColmap fake("reconstruct_keeps");
  Reconstruct(fake.options);
  const std::string model = fake.options.workspace + "/sparse/1/images.bin";
  const std::string before = testing::ReadText(model);
  fake.options.sequential = true;
  fake.Write("mapper", "echo half > $out/half; exit 1");
  EXPECT_THAT(fake.Error(), HasSubstr("mapper failed"));
  EXPECT_EQ(testing::ReadText(model), before);
  fake.Write("mapper", "exit 0");  // it finds nothing
  EXPECT_THAT(fake.Error(), HasSubstr("no model was made"));
  EXPECT_EQ(testing::ReadText(model), before);
}

TEST(Reconstruct, CanBeCancelledAndResumed) {
  FakeColmap fake("reconstruct_cancel");
  fake.Write("exhaustive_matcher", "echo 'Matching block [1/4]'; sleep 60");
  std::stop_source source;
  Control control;
  control.stop = source.get_token();
  control.progress = [&](std::string_view what, double fraction) {
    EXPECT_GE(fraction, 0);
    EXPECT_LE(fraction, 1);
    if (what == "matching photographs" && fraction > 0.3) source.request_stop();
  };
  EXPECT_THROW(Reconstruct(fake.options, control), Cancelled);
  fake.Calls();
  fake.Write("", "");
  Reconstruct(fake.options);
  EXPECT_THAT(fake.Calls(), ElementsAre("exhaustive_matcher", "mapper", "image_undistorter"));
}

TEST(Reconstruct, WhatCannotBeginSaysWhy) {
  FakeColmap fake("reconstruct_begin");
  const ReconstructOptions good = fake.options;
  fake.options.colmap = "/no/such/colmap";
  EXPECT_THAT(fake.Error(), HasSubstr("cannot be run"));
  fake.options.colmap = "/bin/true";
  EXPECT_THAT(fake.Error(), HasSubstr("does not answer as COLMAP does"));
  fake.options = good;
  fake.options.photos = fake.folder + "/none";
  EXPECT_THAT(fake.Error(), HasSubstr("is no folder"));
  fs::create_directories(fake.folder + "/empty");
  fake.options.photos = fake.folder + "/empty";
  EXPECT_THAT(fake.Error(), HasSubstr("holds 0 photographs"));
  fake.options = good;
  fake.options.workspace = good.photos + "/ws";
  EXPECT_THAT(fake.Error(), HasSubstr("lies in the folder of the photographs"));
  fake.options.workspace = fake.folder + "/a/b";
  EXPECT_THAT(fake.Error(), HasSubstr("make it first"));
}

// The program with --project: the project that is there survives whatever happens to COLMAP.
TEST(Reconstruct, AProjectIsAsItWasWhereColmapFails) {
  FakeColmap fake("reconstruct_project");
  const std::string project = fake.folder + "/p.sherd";
  ImportOptions import;
  import.source = fake.folder + "/truth";
  ImportSurvey(import, project);
  const std::string before = testing::ReadText(project);
  const auto files = testing::Listing(project + ".d");
  for (const char* how : {"exit 1", "kill -9 $$", "kill -11 $$", "echo full > /dev/full; exit 1"}) {
    fake.Write("mapper", how);
    testing::ExpectFailure(
        testing::RunSherd("reconstruct '" + fake.options.photos + "' --workspace '" +
                          fake.options.workspace + "' --colmap '" + fake.options.colmap +
                          "' --project '" + project + "'"),
        2, "mapper");
    EXPECT_EQ(testing::ReadText(project), before);
    EXPECT_EQ(testing::Listing(project + ".d"), files);
  }
  // And is replaced where all went well (the model of the script is text beside a stub of .bin).
  fake.Write("mapper", "mkdir $out/0; cp '" + fake.folder +
                           "/truth/sparse/0/'* $out/0;"
                           "printf '\\4\\0\\0\\0\\0\\0\\0\\0' > $out/0/images.bin; exit 0");
  fs::remove_all(fake.options.workspace);
  const testing::RunResult result = testing::RunSherd(
      "reconstruct '" + fake.options.photos + "' --workspace '" + fake.options.workspace +
      "' --colmap '" + fake.options.colmap + "' --project '" + project + "'");
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("No dense cloud: COLMAP 3.8 was built without CUDA"));
  EXPECT_NE(testing::ReadText(project), before);
}

}  // namespace
}  // namespace sherd
