// The exception tree of the whole house. A program ends a user's error as one line: what(), which
// already names the place and the way out.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>

namespace sherd {

class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Input that cannot be used. what() reads "PATH: PLACE: MESSAGE; HINT" (empty parts left out).
// `place` says where in the file: "byte 128", "line 7", "point 12".
class InputError : public Error {
 public:
  InputError(std::string path, std::string place, std::string message, std::string hint = "")
      : Error(path + (place.empty() ? "" : ": " + place) + (path.empty() ? "" : ": ") + message +
              (hint.empty() ? "" : "; " + hint)),
        path_(std::move(path)),
        place_(std::move(place)),
        message_(std::move(message)),
        hint_(std::move(hint)) {}

  const std::string& path() const { return path_; }
  const std::string& place() const { return place_; }
  const std::string& message() const { return message_; }
  const std::string& hint() const { return hint_; }

 private:
  std::string path_, place_, message_, hint_;
};

// A result that could not be written (folder missing, disk full, no permission).
class OutputError : public Error {
 public:
  OutputError(const std::string& path, const std::string& message)
      : Error(path + ": " + message), path_(path) {}
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// More memory (or another resource) is needed than there is. Figures in bytes.
class ResourceError : public Error {
 public:
  ResourceError(const std::string& message, std::uint64_t needed, std::uint64_t available)
      : Error(message), needed_(needed), available_(available) {}
  std::uint64_t needed() const { return needed_; }
  std::uint64_t available() const { return available_; }

 private:
  std::uint64_t needed_, available_;
};

// A GPU call that failed: `kernel` names the call or the launch, `code` is the CUDA error number.
class DeviceError : public Error {
 public:
  DeviceError(std::string kernel, int code, const std::string& message)
      : Error(kernel + ": " + message), kernel_(std::move(kernel)), code_(code) {}
  const std::string& kernel() const { return kernel_; }
  int code() const { return code_; }

 private:
  std::string kernel_;
  int code_;
};

// Work that was stopped because its caller asked for it. Nothing the work would have produced
// exists.
class Cancelled : public Error {
 public:
  Cancelled() : Error("cancelled") {}
};

}  // namespace sherd
