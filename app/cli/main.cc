// The command line program. Commands are in files of their own; here are their registration, the
// exit codes and how the program is stopped.
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <new>
#include <stop_token>
#include <thread>

#include "app/cli/command.h"
#include "metaball/error.h"

namespace sherd::cli {
namespace {

// SIGINT and SIGTERM ask the work to stop; a second one ends the program at once. The signals are
// taken by a thread of their own, so that asking needs no async-signal-safe code.
class StopOnSignal {
 public:
  StopOnSignal() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
    thread_ = std::thread([this] { Listen(); });
  }
  ~StopOnSignal() {
    ended_ = true;
    thread_.join();
  }
  std::stop_token token() const { return source_.get_token(); }

 private:
  void Listen() {
    const timespec tick{0, 50'000'000};
    while (!ended_) {
      if (sigtimedwait(&signals_, nullptr, &tick) < 0) continue;
      if (source_.stop_requested()) _exit(kCancelled);
      source_.request_stop();
    }
  }

  sigset_t signals_;
  std::stop_source source_;
  std::atomic<bool> ended_ = false;
  std::thread thread_;
};

int Fail(int code, const std::string& message) {
  std::fprintf(stderr, "sherd: %s\n", OneLine(message).c_str());
  return code;
}

int Run(const Action& action, const Environment& environment) {
  try {
    return action(environment);
  } catch (const Cancelled&) {
    return Fail(kCancelled, "cancelled; nothing was changed by the unfinished step");
  } catch (const InputError& error) {
    return Fail(kBadInput, error.what());
  } catch (const OutputError& error) {
    return Fail(kOutputFailed, error.what());
  } catch (const ResourceError& error) {
    return Fail(kNoResources, error.what());
  } catch (const DeviceError& error) {
    return Fail(kNoResources, error.what());
  } catch (const Error& error) {
    return Fail(kBadInput, error.what());
  } catch (const std::bad_alloc&) {
    return Fail(kNoResources,
                "there is not enough memory for this; take fewer points, a lower "
                "level or a smaller picture");
  } catch (const std::exception& error) {
    return Fail(kNoResources, std::string("internal error: ") + error.what());
  }
}

int Main(int argc, char** argv) {
  // Writing into a closed pipe or past a file size limit comes back as an error, not as a death.
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);

  CLI::App program(
      "Sherd: an archaeologist's COLMAP project as metaball surfaces at several "
      "densities, compared side by side.");
  program.name("sherd");
  program.set_version_flag("--version", "sherd " SHERD_VERSION);
  program.require_subcommand(1);
  program.footer(
      "Example:\n"
      "  sherd import trench_colmap --project trench.sherd\n"
      "  sherd build trench.sherd --levels 63k,126k,252k,502k\n"
      "  sherd compare trench.sherd --view top --size 1920x1080 --out sheet.png\n"
      "\"sherd COMMAND --help\" explains a command.\n"
      "Exit codes: 0 done, 1 a comparison with a reference failed, 2 bad input or usage, 3 output\n"
      "could not be written, 4 not enough memory or no device, 130 cancelled.");
  Action action;
  AddInfo(&program, &action);
  AddReconstruct(&program, &action);
  AddImport(&program, &action);
  AddBuild(&program, &action);
  AddRender(&program, &action);
  AddCompare(&program, &action);
  AddExport(&program, &action);
  AddBench(&program, &action);
  AddScale(&program, &action);
  AddDevices(&program, &action);
  try {
    program.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return program.exit(help);  // --help, --version
  } catch (const CLI::ParseError& error) {
    std::string command = "sherd";
    for (const CLI::App* sub : program.get_subcommands()) command += " " + sub->get_name();
    return Fail(kBadInput, std::string(error.what()) + "; see " + command + " --help");
  }
  StopOnSignal signals;
  return Run(action, {signals.token()});
}

}  // namespace
}  // namespace sherd::cli

int main(int argc, char** argv) { return sherd::cli::Main(argc, argv); }
