#include "app/cli/progress.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "app/project/format.h"

namespace sherd::cli {

std::string ProgressLine(std::string_view what, double fraction, double elapsed_s, int columns) {
  fraction = std::clamp(fraction, 0.0, 1.0);
  std::string end = "  " + std::to_string(static_cast<int>(fraction * 100)) + " %";
  // A guess from less than two seconds or a fiftieth of the work would jump about.
  if (elapsed_s >= 2 && fraction >= 0.02 && fraction < 1) {
    end +=
        "  about " + FormatSeconds(std::max(1.0, elapsed_s * (1 - fraction) / fraction)) + " left";
  }
  const std::size_t room =
      static_cast<std::size_t>(std::max(0, columns - 1 - static_cast<int>(end.size())));
  return std::string(what.substr(0, room)) + end;
}

Progress::Progress(std::stop_token stop)
    : terminal_(isatty(STDERR_FILENO) == 1), start_(std::chrono::steady_clock::now()) {
  control_.stop = std::move(stop);
  if (terminal_) {
    control_.progress = [this](std::string_view what, double fraction) { Show(what, fraction); };
  }
}

Progress::~Progress() { Clear(); }

void Progress::Clear() {
  if (shown_) std::fputs("\r\033[K", stderr);
  shown_ = false;
}

void Progress::Show(std::string_view what, double fraction) {
  const auto now = std::chrono::steady_clock::now();
  furthest_ = std::max(furthest_, fraction);
  if (shown_ && what == last_what_ && now - last_ < std::chrono::milliseconds(100)) return;
  last_ = now;
  last_what_ = what;
  winsize size{};
  const bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  std::fprintf(stderr, "\r\033[K%s",
               ProgressLine(what, furthest_, elapsed, known ? size.ws_col : 80).c_str());
  std::fflush(stderr);
  shown_ = true;
}

}  // namespace sherd::cli
