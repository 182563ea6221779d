#include "app/project/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <memory>
#include <thread>

#include "metaball/error.h"

extern char** environ;

namespace sherd {
namespace {

constexpr int kTickMs = 50;
constexpr auto kPatience = std::chrono::seconds(2);

// The group of a child; ended with this object if it still runs.
class Group {
 public:
  explicit Group(pid_t pid) : pid_(pid) {}
  ~Group() {
    if (!ended_) End();
  }
  Group(const Group&) = delete;
  Group& operator=(const Group&) = delete;

  bool HasEnded() {
    if (!ended_ && waitpid(pid_, &status_, WNOHANG) == pid_) ended_ = true;
    return ended_;
  }

  void End() {
    kill(-pid_, SIGTERM);
    const auto start = std::chrono::steady_clock::now();
    while (!HasEnded() && std::chrono::steady_clock::now() - start < kPatience) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    // Those that did not listen, and what the child has left behind.
    kill(-pid_, SIGKILL);
    if (!ended_) {
      while (waitpid(pid_, &status_, 0) < 0 && errno == EINTR) {
      }
      ended_ = true;
    }
  }

  ChildOutcome Outcome() const {
    ChildOutcome outcome;
    if (WIFEXITED(status_)) outcome.exit_code = WEXITSTATUS(status_);
    if (WIFSIGNALED(status_)) outcome.signal = WTERMSIG(status_);
    return outcome;
  }

 private:
  pid_t pid_;
  int status_ = 0;
  bool ended_ = false;
};

struct Closer {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

// The environment with one more variable.
std::vector<char*> Environment(std::string* offscreen) {
  std::vector<char*> out;
  for (char** v = environ; *v; ++v) {
    if (std::strncmp(*v, "QT_QPA_PLATFORM=", 16) != 0) out.push_back(*v);
  }
  out.push_back(offscreen->data());
  out.push_back(nullptr);
  return out;
}

pid_t Spawn(const std::vector<std::string>& argv, int output) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, output, 1);
  posix_spawn_file_actions_adddup2(&actions, output, 2);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  // Our own program blocks and ignores signals that a child has to get.
  sigset_t none, defaults;
  sigemptyset(&none);
  sigemptyset(&defaults);
  for (const int s : {SIGINT, SIGTERM, SIGPIPE, SIGXFSZ}) sigaddset(&defaults, s);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &defaults);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes,
                           POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  std::vector<char*> arguments;
  for (const std::string& a : argv) arguments.push_back(const_cast<char*>(a.c_str()));
  arguments.push_back(nullptr);
  std::string offscreen = "QT_QPA_PLATFORM=offscreen";
  std::vector<char*> environment = Environment(&offscreen);
  pid_t pid = 0;
  const int error = posix_spawnp(&pid, argv[0].c_str(), &actions, &attributes, arguments.data(),
                                 environment.data());
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (error != 0) {
    throw InputError(argv[0], "", std::string("cannot be run: ") + std::strerror(error),
                     "install it (Debian: apt install colmap) or name another program");
  }
  return pid;
}

}  // namespace

ChildOutcome RunChild(const std::vector<std::string>& argv, const std::string& log,
                      const std::function<void(std::string_view line)>& on_line,
                      const Control& control) {
  control.ThrowIfStopped();
  std::unique_ptr<std::FILE, Closer> file;
  if (!log.empty()) {
    file.reset(std::fopen(log.c_str(), "ab"));
    if (!file) throw OutputError(log, std::string("cannot be written: ") + std::strerror(errno));
  }
  int pipe_ends[2];
  if (pipe2(pipe_ends, O_CLOEXEC) != 0) {
    throw Error(std::string("no pipe to another program: ") + std::strerror(errno));
  }
  const auto close_fd = [](int* fd) {
    close(*fd);
    delete fd;
  };
  std::unique_ptr<int, decltype(close_fd)> input(new int(pipe_ends[0]), close_fd);
  pid_t pid;
  {
    std::unique_ptr<int, decltype(close_fd)> output(new int(pipe_ends[1]), close_fd);
    pid = Spawn(argv, *output);
  }
  Group group(pid);
  std::string line;
  char buffer[4096];
  bool open = true;
  while (open) {
    if (control.stopped()) {
      group.End();
      throw Cancelled();
    }
    pollfd waiting{*input, POLLIN, 0};
    const int ready = poll(&waiting, 1, kTickMs);
    if (ready == 0) {
      // What the child has left running does not keep us.
      if (group.HasEnded()) break;
      continue;
    }
    const ssize_t got = ready < 0 ? -1 : read(*input, buffer, sizeof buffer);
    if (got < 0 && errno == EINTR) continue;
    open = got > 0;
    if (!open) break;
    if (file && (std::fwrite(buffer, 1, static_cast<std::size_t>(got), file.get()) !=
                     static_cast<std::size_t>(got) ||
                 std::fflush(file.get()) != 0)) {
      throw OutputError(log, std::string("cannot be written: ") + std::strerror(errno));
    }
    for (ssize_t i = 0; i < got; ++i) {
      if (buffer[i] != '\n' && buffer[i] != '\r') {
        if (line.size() < sizeof buffer) line.push_back(buffer[i]);
        continue;
      }
      if (on_line && !line.empty()) on_line(line);
      line.clear();
    }
  }
  if (on_line && !line.empty()) on_line(line);
  while (!group.HasEnded()) {
    if (control.stopped()) {
      group.End();
      throw Cancelled();
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return group.Outcome();
}

}  // namespace sherd
