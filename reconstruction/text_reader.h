// Text files line by line, and the numbers in a line. Never asks the locale.
#pragma once

#include <charconv>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "metaball/error.h"

namespace sherd {

class TextReader {
 public:
  // Throws InputError when the file is missing, no regular file, or not readable.
  explicit TextReader(const std::string& path);

  // The next line without its end ("\n" or "\r\n"); valid until the next call. False at the end of
  // the file. The last line needs no end. Lines may be as long as the file.
  bool ReadLine(std::string_view* line);
  // Goes on reading at byte `position`.
  void SeekTo(std::uint64_t position);

  const std::string& path() const { return path_; }
  std::uint64_t line_number() const { return line_number_; }  // of the line last read, from 1
  std::uint64_t position() const { return position_; }        // bytes consumed
  std::uint64_t size() const { return size_; }

  // InputError at the line last read.
  [[noreturn]] void Fail(const std::string& message, const std::string& hint = "") const;

 private:
  struct Closer {
    void operator()(std::FILE* f) const { std::fclose(f); }
  };
  std::string path_;
  std::unique_ptr<std::FILE, Closer> file_;
  std::uint64_t size_ = 0, position_ = 0, line_number_ = 0;
  std::vector<char> buffer_;
  std::size_t next_ = 0, filled_ = 0;
  bool at_end_ = false;
};

// Blanks at both ends removed.
std::string_view Trimmed(std::string_view text);

// Walks over the blank-separated tokens of one line of `reader`.
class TokenReader {
 public:
  TokenReader(const TextReader& reader, std::string_view line) : reader_(reader), rest_(line) {}

  bool AtEnd();
  // The next token; throws InputError naming `what` when the line has ended.
  std::string_view Token(const char* what);
  // Everything that is left, trimmed.
  std::string_view Rest();

  // A number; throws InputError naming `what` and the token when it is none or out of T's range.
  template <class T>
  T Number(const char* what) {
    const std::string_view token = Token(what);
    const char* first = token.data();
    const char* last = first + token.size();
    if (first != last && *first == '+') ++first;
    T value{};
    const auto [end, error] = std::from_chars(first, last, value);
    if (error != std::errc{} || end != last) FailNumber(token, what);
    return value;
  }

 private:
  [[noreturn]] void FailNumber(std::string_view token, const char* what) const;
  const TextReader& reader_;
  std::string_view rest_;
};

}  // namespace sherd
