#include "reconstruction/text_reader.h"

#include <algorithm>
#include <cstring>

#include "reconstruction/binary_reader.h"

namespace sherd {
namespace {

bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

}  // namespace

TextReader::TextReader(const std::string& path) : path_(path) {
  file_.reset(OpenForReading(path, &size_));
  buffer_.resize(static_cast<std::size_t>(std::clamp<std::uint64_t>(size_, 16, 1 << 20)));
}

void TextReader::SeekTo(std::uint64_t position) {
  if (::fseeko(file_.get(), static_cast<off_t>(position), SEEK_SET) != 0) {
    Fail("the file could not be read to its end");
  }
  position_ = position;
  next_ = filled_ = 0;
  at_end_ = false;
}

bool TextReader::ReadLine(std::string_view* line) {
  std::size_t searched = next_;
  for (;;) {
    const void* found = filled_ > searched
                            ? std::memchr(buffer_.data() + searched, '\n', filled_ - searched)
                            : nullptr;
    std::size_t end;
    if (found) {
      end = static_cast<std::size_t>(static_cast<const char*>(found) - buffer_.data());
    } else if (at_end_) {
      if (next_ == filled_) return false;
      end = filled_;
    } else {
      // Keep what is there of the line and read on; a line longer than the buffer doubles it, so
      // that it never exceeds twice what the file has been seen to hold.
      const std::size_t kept = filled_ - next_;
      std::memmove(buffer_.data(), buffer_.data() + next_, kept);
      next_ = 0;
      filled_ = searched = kept;
      if (kept == buffer_.size()) buffer_.resize(buffer_.size() * 2);
      const std::size_t got =
          std::fread(buffer_.data() + filled_, 1, buffer_.size() - filled_, file_.get());
      if (got == 0) {
        if (std::ferror(file_.get())) Fail("the file could not be read to its end");
        at_end_ = true;
      }
      filled_ += got;
      continue;
    }
    *line = std::string_view(buffer_.data() + next_, end - next_);
    const std::size_t consumed = (found ? end + 1 : end) - next_;
    next_ += consumed;
    position_ += consumed;
    if (!line->empty() && line->back() == '\r') line->remove_suffix(1);
    ++line_number_;
    return true;
  }
}

void TextReader::Fail(const std::string& message, const std::string& hint) const {
  throw InputError(path_, "line " + std::to_string(line_number_), message, hint);
}

std::string_view Trimmed(std::string_view text) {
  while (!text.empty() && IsBlank(text.front())) text.remove_prefix(1);
  while (!text.empty() && IsBlank(text.back())) text.remove_suffix(1);
  return text;
}

bool TokenReader::AtEnd() {
  while (!rest_.empty() && IsBlank(rest_.front())) rest_.remove_prefix(1);
  return rest_.empty();
}

std::string_view TokenReader::Token(const char* what) {
  if (AtEnd()) reader_.Fail(std::string("the line ends before ") + what);
  std::size_t length = 0;
  while (length < rest_.size() && !IsBlank(rest_[length])) ++length;
  const std::string_view token = rest_.substr(0, length);
  rest_.remove_prefix(length);
  return token;
}

std::string_view TokenReader::Rest() {
  const std::string_view rest = Trimmed(rest_);
  rest_ = {};
  return rest;
}

void TokenReader::FailNumber(std::string_view token, const char* what) const {
  std::string shown;
  for (const char c : token.substr(0, 40)) {
    shown.push_back(static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '?' : c);
  }
  if (token.size() > 40) shown += "...";
  const bool comma = token.find(',') != std::string_view::npos;
  reader_.Fail(std::string("'") + shown + "' is no valid number for " + what,
               comma
                   ? "a decimal comma: write the model again with decimal points (COLMAP 4.0.3 or "
                     "newer, or LC_NUMERIC=C), or as .bin"
                   : "");
}

}  // namespace sherd
