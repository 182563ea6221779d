// Bad input and bad luck: one line that says what and where and what to do, the right exit code,
// nothing half written.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "tests/app/run_sherd.h"
#include "tests/app/test_workspace.h"

namespace sherd {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using testing::ExpectFailure;
using ::testing::HasSubstr;
using testing::RunSherd;

class CliErrors : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = testing::FreshFolder("errors");
    testing::WritePly(folder_ + "/cloud.ply", 400);
  }
  std::string Q(const std::string& name) const { return "'" + folder_ + "/" + name + "'"; }
  void MakeProject(int points = 900) {
    testing::WriteWorkspace(folder_ + "/ws", points);
    ASSERT_EQ(RunSherd("import " + Q("ws") + " --project " + Q("p.sherd")).code, 0);
    ASSERT_EQ(RunSherd("build " + Q("p.sherd") + " --levels 500").code, 0);
  }
  std::string folder_;
};

TEST_F(CliErrors, Usage) {
  ExpectFailure(RunSherd(""), 2, "--help");
  ExpectFailure(RunSherd("explode"), 2, "--help");
  ExpectFailure(RunSherd("import"), 2, "sherd import --help");
  ExpectFailure(RunSherd("import x"), 2, "--project");
  ExpectFailure(RunSherd("import x --project p --dense --sparse"), 2, "excludes");
  ExpectFailure(RunSherd("import x --project p --model two"), 2, "--model");
  ExpectFailure(RunSherd("import x --project p --metres-per-unit 0"), 2, "--metres-per-unit");
  ExpectFailure(RunSherd("build p.sherd"), 2, "--levels");
  ExpectFailure(RunSherd("build p.sherd --levels 0"), 2, "--levels");
  ExpectFailure(RunSherd("build p.sherd --levels many"), 2, "--levels");
  ExpectFailure(RunSherd("render x"), 2, "--out");
  ExpectFailure(RunSherd("render x --out a.png --size 5"), 2, "--size");
  ExpectFailure(RunSherd("render x --out a.png --eye 1,2"), 2, "--eye");
  ExpectFailure(RunSherd("render x --out a.png --background 255,255,255"), 2, "from 0 to 1");
  ExpectFailure(RunSherd("render x --out a.png --threshold 0"), 2, "--threshold");
  ExpectFailure(RunSherd("render x --out a.png --reference-threshold 1"), 2, "--reference");
  ExpectFailure(RunSherd("compare p.sherd --out a.png --no-such-option"), 2, "--no-such-option");
}

TEST_F(CliErrors, PathsThatAreNotThere) {
  const std::string none = Q("none");
  ExpectFailure(RunSherd("info " + none), 2, "none");
  ExpectFailure(RunSherd("import " + none + " --project " + Q("p.sherd")), 2, "none");
  ExpectFailure(RunSherd("build " + none + " --levels 63k"), 2, "none");
  ExpectFailure(RunSherd("render " + none + " --out " + Q("a.png")), 2, "none");
  ExpectFailure(RunSherd("compare " + none + " --out " + Q("a.png")), 2, "none");
  ExpectFailure(RunSherd("render " + Q("") + " --out " + Q("a.png")), 2, "is a folder");
  ExpectFailure(
      RunSherd("render " + Q("cloud.ply") + " --reference " + none + " --out " + Q("a.png")), 2,
      "none");
  EXPECT_THAT(testing::Listing(folder_), ElementsAre("cloud.ply"));
}

TEST_F(CliErrors, FilesThatAreSomethingElse) {
  testing::WriteText(folder_ + "/notes.txt", "hello\n");
  ExpectFailure(RunSherd("render " + Q("notes.txt") + " --out " + Q("a.png")), 2,
                "neither a project");
  ExpectFailure(RunSherd("info " + Q("notes.txt")), 2, "notes.txt");
  ExpectFailure(RunSherd("build " + Q("notes.txt") + " --levels 1k"), 2, "line 1");
  testing::WriteText(folder_ + "/empty.sherd", "");
  ExpectFailure(RunSherd("render " + Q("empty.sherd") + " --out " + Q("a.png")), 2, "line 1");
  testing::WriteText(folder_ + "/empty.ply", "");
  ExpectFailure(RunSherd("render " + Q("empty.ply") + " --out " + Q("a.png")), 2, "empty.ply");
  // A .ply that promises more than it holds.
  testing::WriteText(folder_ + "/short.ply",
                     "ply\nformat binary_little_endian 1.0\nelement vertex 99999999999\nproperty "
                     "float x\nproperty float y\nproperty float z\nend_header\nxxxx");
  ExpectFailure(RunSherd("render " + Q("short.ply") + " --out " + Q("a.png")), 2, "short.ply");
  testing::WriteText(folder_ + "/bad.metaballs", "SHERDMB\nxxxx");
  ExpectFailure(RunSherd("render " + Q("bad.metaballs") + " --out " + Q("a.png")), 2, "byte");
  EXPECT_FALSE(fs::exists(folder_ + "/a.png"));
}

TEST_F(CliErrors, LevelsAndPhotographsThatAreNotThere) {
  MakeProject();
  const std::string render = "render " + Q("p.sherd") + " --out " + Q("a.png") + " ";
  ExpectFailure(RunSherd(render + "--level 63k"), 2, "its levels are 500");
  ExpectFailure(RunSherd(render + "--photo photo_9.png"), 2, "near names: photo_");
  ExpectFailure(RunSherd(render + "--photo .png"), 2, "4 photographs");
  ExpectFailure(RunSherd(render + "--photos " + Q("none") + " --photo photo_1.png"), 2, "none");
  ExpectFailure(RunSherd("compare " + Q("p.sherd") + " --levels 500,63k --out " + Q("a.png")), 2,
                "no level \"63k\"");
  ExpectFailure(RunSherd("compare " + Q("p.sherd") + " --size 100x100 --out " + Q("a.png")), 2,
                "is large enough");
  ExpectFailure(RunSherd("render " + Q("cloud.ply") + " --level 63k --out " + Q("a.png")), 2,
                "has no levels");
  ExpectFailure(RunSherd("render " + Q("cloud.ply") + " --photo x --out " + Q("a.png")), 2,
                "need a project");
  ExpectFailure(RunSherd("render " + Q("cloud.ply") + " --color photo --out " + Q("a.png")), 2,
                "need a project");
  ExpectFailure(RunSherd(render + "--color photo --color-by z"), 2, "leave one of them out");
  ExpectFailure(RunSherd("import " + Q("ws") + " --project " + Q("q.sherd") + " --model 7"), 2,
                "its models are 0");
  ExpectFailure(RunSherd("import " + Q("ws") + " --project " + Q("q.sherd") + " --dense"), 2, "ws");
  EXPECT_FALSE(fs::exists(folder_ + "/a.png"));
  EXPECT_FALSE(fs::exists(folder_ + "/q.sherd"));
  EXPECT_FALSE(fs::exists(folder_ + "/q.sherd.d"));
}

TEST_F(CliErrors, OutputThatCannotBeWritten) {
  const std::string render = "render " + Q("cloud.ply") + " --size 40x30 ";
  ExpectFailure(RunSherd(render + "--out " + Q("none/a.png")), 3, "none/a.png");
  ExpectFailure(RunSherd(render + "--out " + Q("a.gif")), 3, ".png");
  ExpectFailure(RunSherd(render + "--out " + Q("a.jpg") + " --background transparent"), 3,
                "no transparency");
  ExpectFailure(RunSherd(render + "--out " + Q("a.png") + " --bits 32"), 3, "8 or 16");
  ExpectFailure(RunSherd(render + "--out " + Q("a.png") + " --depth-out " + Q("none/d.exr")), 3,
                "none/d.exr");
  ExpectFailure(RunSherd(render + "--out " + Q("a.png") + " --depth-out " + Q("d.png")), 3, ".exr");
  ExpectFailure(RunSherd(render + "--out " + Q("a.png") + " --stats " + Q("none/s.json")), 3,
                "none/s.json");
  ExpectFailure(RunSherd("import " + Q("cloud.ply") + " --project " + Q("none/p.sherd")), 3,
                "make it first");
  ExpectFailure(RunSherd("import " + Q("cloud.ply") + " --project " + Q("cloud.ply")), 3,
                "will not be replaced");
  EXPECT_THAT(testing::Listing(folder_), ElementsAre("cloud.ply"));
}

TEST_F(CliErrors, FullDiskLeavesEverythingAsItWas) {
  MakeProject();
  const std::string before = testing::ReadText(folder_ + "/p.sherd");
  const auto listing = testing::Listing(folder_ + "/p.sherd.d");
  // A limit on the size of any file stands for the full disk: the write fails half-way.
  const std::string limit = "ulimit -f 8;";  // blocks of 512 or 1024 bytes
  for (const char* name : {"a.png", "a.exr", "a.tif", "a.jpg"}) {
    ExpectFailure(RunSherd("render " + Q("cloud.ply") + " --size 700x500 --out " + Q(name), limit),
                  3, name);
    EXPECT_FALSE(fs::exists(folder_ + "/" + name));
  }
  ExpectFailure(RunSherd("render " + Q("cloud.ply") + " --size 400x300 --out " + Q("a.png") +
                             " --depth-out " + Q("d.exr"),
                         limit),
                3, "d.exr");
  ExpectFailure(RunSherd("import " + Q("ws") + " --project " + Q("p.sherd"), limit), 3, "survey");
  ExpectFailure(RunSherd("build " + Q("p.sherd") + " --levels 800", limit), 3, "800");
  ExpectFailure(RunSherd("compare " + Q("p.sherd") + " --out " + Q("a.png"), limit), 3, "a.png");
  EXPECT_EQ(testing::ReadText(folder_ + "/p.sherd"), before);
  EXPECT_EQ(testing::Listing(folder_ + "/p.sherd.d"), listing);
  EXPECT_THAT(testing::Listing(folder_), ElementsAre("cloud.ply", "p.sherd", "p.sherd.d", "ws"));
  const int status = std::system(("'" SHERD_PROGRAM "' devices >/dev/full 2>" + Q("err")).c_str());
  EXPECT_EQ(WEXITSTATUS(status), 3);
  EXPECT_THAT(testing::ReadText(folder_ + "/err"), HasSubstr("standard output"));
}

TEST_F(CliErrors, DamagedProjectDataIsNamed) {
  MakeProject();
  const std::string survey = folder_ + "/p.sherd.d/survey.bin";
  const std::string whole = testing::ReadText(survey);
  testing::WriteText(survey, whole.substr(0, whole.size() - 100));
  ExpectFailure(RunSherd("build " + Q("p.sherd") + " --levels 700"), 2, "survey.bin: byte");
  // The levels are still there.
  EXPECT_EQ(RunSherd("render " + Q("p.sherd") + " --size 40x30 --out " + Q("a.png")).code, 0);
  fs::remove(folder_ + "/p.sherd.d/500/cloud.metaballs");
  ExpectFailure(RunSherd("render " + Q("p.sherd") + " --out " + Q("b.png")), 2, "build it again");
}

TEST_F(CliErrors, MemoryLimitIsRefusedWithTheFigures) {
  testing::WriteWorkspace(folder_ + "/ws", 40000, false);
  ExpectFailure(RunSherd("import " + Q("ws") + " --project " + Q("p.sherd") + " --memory-limit 1"),
                4, "memory");
  EXPECT_FALSE(fs::exists(folder_ + "/p.sherd"));
}

TEST_F(CliErrors, NoGpuIsSaidWhereOneIsAskedFor) {
  const auto devices = RunSherd("devices --json");
  if (devices.out.find("\"auto\": \"cuda\"") != std::string::npos) {
    GTEST_SKIP() << "this machine has a GPU";
  }
  ExpectFailure(
      RunSherd("render " + Q("cloud.ply") + " --size 40x30 --backend cuda --out " + Q("a.png")), 4,
      "");
  for (const char* device : {"0", "all"}) {
    ExpectFailure(RunSherd("render " + Q("cloud.ply") + " --size 40x30 --device " + device +
                           " --out " + Q("a.png")),
                  4, "GPU");
  }
  ExpectFailure(RunSherd("render " + Q("cloud.ply") +
                         " --size 40x30 --backend cpu --device 0 --out " + Q("a.png")),
                2, "--backend cpu");
  EXPECT_FALSE(fs::exists(folder_ + "/a.png"));
  const auto fallback = RunSherd("render " + Q("cloud.ply") + " --size 40x30 --out " + Q("a.png"));
  EXPECT_EQ(fallback.code, 0);
  EXPECT_NE(fallback.err, "");  // says why the CPU
  EXPECT_EQ(
      RunSherd("render " + Q("cloud.ply") + " --size 40x30 --backend cpu --out " + Q("a.png")).err,
      "");
}

TEST_F(CliErrors, InterruptCancelsCleanly) {
  MakeProject();
  const std::string out = folder_ + "/big.png", err = folder_ + "/err";
  for (const int signal : {SIGINT, SIGTERM}) {
    const pid_t pid = fork();
    ASSERT_GE(pid, 0);
    if (pid == 0) {
      // Many rays: seconds of work.
      const std::string project = folder_ + "/p.sherd";
      if (!freopen(err.c_str(), "w", stderr) || !freopen("/dev/null", "w", stdout)) _exit(99);
      execl(SHERD_PROGRAM, "sherd", "render", project.c_str(), "--size", "12000x9000",
            "--supersample", "4", "--backend", "cpu", "--out", out.c_str(), nullptr);
      _exit(98);
    }
    // Once the temporary file is there the work has begun.
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    const auto begun = [&] {
      for (const std::string& name : testing::Listing(folder_)) {
        if (name.starts_with("big.png.tmp")) return true;
      }
      return false;
    };
    while (!begun() && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
    ASSERT_TRUE(begun());
    kill(pid, signal);
    int status = 0;
    waitpid(pid, &status, 0);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 130);
    EXPECT_THAT(testing::ReadText(err), HasSubstr("sherd: cancelled"));
    EXPECT_FALSE(fs::exists(out));
    EXPECT_FALSE(begun());  // no temporary file is left
  }
}

}  // namespace
}  // namespace sherd
