// Enough of JSON to write a report with nothing but the standard library.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

namespace sherd {

class JsonWriter {
 public:
  JsonWriter& BeginObject() { return Open('{'); }
  JsonWriter& EndObject() { return Close('}'); }
  JsonWriter& BeginArray() { return Open('['); }
  JsonWriter& EndArray() { return Close(']'); }

  JsonWriter& Key(std::string_view key) {
    Separate();
    Quote(key);
    text_ += ": ";
    after_key_ = true;
    return *this;
  }
  JsonWriter& Value(std::string_view value) {
    Separate();
    Quote(value);
    return *this;
  }
  JsonWriter& Value(const char* value) { return Value(std::string_view(value)); }
  JsonWriter& Value(bool value) {
    Separate();
    text_ += value ? "true" : "false";
    return *this;
  }
  JsonWriter& Value(double value) {
    Separate();
    char number[40] = "null";  // JSON has no NaN and no infinity
    if (std::isfinite(value)) std::snprintf(number, sizeof number, "%.9g", value);
    text_ += number;
    return *this;
  }
  JsonWriter& Value(std::uint64_t value) {
    Separate();
    text_ += std::to_string(value);
    return *this;
  }
  JsonWriter& Value(int value) {
    Separate();
    text_ += std::to_string(value);
    return *this;
  }

  // All that another writer holds: what was measured first may be reported last.
  JsonWriter& Value(const JsonWriter& inner) {
    Separate();
    for (const char c : inner.text_) {
      text_ += c;
      if (c == '\n') text_ += Indent();  // in strings it is escaped
    }
    return *this;
  }

  template <class T>
  JsonWriter& Field(std::string_view key, const T& value) {
    return Key(key).Value(value);
  }

  std::string text() const { return text_ + "\n"; }

 private:
  JsonWriter& Open(char bracket) {
    Separate();
    text_ += bracket;
    ++depth_;
    first_ = true;
    return *this;
  }
  JsonWriter& Close(char bracket) {
    --depth_;
    if (!first_) NewLine();
    text_ += bracket;
    first_ = false;
    return *this;
  }
  void Separate() {
    if (after_key_) {
      after_key_ = false;
      return;
    }
    if (depth_ == 0) return;
    if (!first_) text_ += ',';
    first_ = false;
    NewLine();
  }
  void NewLine() { text_ += '\n' + Indent(); }
  std::string Indent() const { return std::string(2 * static_cast<std::size_t>(depth_), ' '); }
  void Quote(std::string_view s) {
    text_ += '"';
    for (const char c : s) {
      if (c == '"' || c == '\\') {
        text_ += '\\';
        text_ += c;
      } else if (static_cast<unsigned char>(c) < 0x20) {
        char escape[8];
        std::snprintf(escape, sizeof escape, "\\u%04x", static_cast<unsigned>(c));
        text_ += escape;
      } else {
        text_ += c;
      }
    }
    text_ += '"';
  }

  std::string text_;
  int depth_ = 0;
  bool first_ = true, after_key_ = false;
};

}  // namespace sherd
