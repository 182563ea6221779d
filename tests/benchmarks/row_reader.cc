#include "tests/benchmarks/row_reader.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <vector>

#include "metaball/error.h"

namespace sherd::benchmarks {
namespace {

constexpr int kPixelsOfLetter = 36;
constexpr double kMargin = 0.4;  // letter heights

std::string OutputOf(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  if (!pipe) throw Error("could not be run: " + command);
  std::string text;
  std::array<char, 256> buffer;
  while (std::fgets(buffer.data(), buffer.size(), pipe.get())) text += buffer.data();
  return text;
}

std::string Letters(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (std::isalnum(static_cast<unsigned char>(c))) out.push_back(c);
  }
  return out;
}

}  // namespace

bool HaveTesseract() { return std::system("tesseract --version > /dev/null 2>&1") == 0; }

std::string ReadRow(const std::function<float(double x, double y)>& gray, double width,
                    const std::string& scratch) {
  const int columns = static_cast<int>(std::ceil((width + 2 * kMargin) * kPixelsOfLetter));
  const int rows = static_cast<int>(std::ceil((1 + 2 * kMargin) * kPixelsOfLetter));
  std::string bytes = "P5\n" + std::to_string(columns) + " " + std::to_string(rows) + "\n255\n";
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      const float value =
          gray((x + 0.5) / kPixelsOfLetter - kMargin, 1 + kMargin - (y + 0.5) / kPixelsOfLetter);
      bytes.push_back(
          static_cast<char>(static_cast<int>(std::clamp(value, 0.0f, 1.0f) * 255.0f + 0.5f)));
    }
  }
  const std::string path = scratch + "/row.pgm";
  std::ofstream(path, std::ios::binary) << bytes;
  std::string text =
      OutputOf("OMP_THREAD_LIMIT=1 tesseract '" + path +
               "' stdout --dpi 300 --psm 7 -c "
               "tessedit_char_whitelist='ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789 ' 2>/dev/null");
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
  return text;
}

bool SameText(const std::string& a, const std::string& b) { return Letters(a) == Letters(b); }

}  // namespace sherd::benchmarks
