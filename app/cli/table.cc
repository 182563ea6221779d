#include "app/cli/table.h"

#include <algorithm>

namespace sherd::cli {
namespace {

// Characters, not bytes: names are UTF-8.
std::size_t Width(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xc0) != 0x80;
  }));
}

}  // namespace

std::string Table(const std::vector<std::vector<std::string>>& rows, int indent,
                  const std::vector<std::size_t>& left) {
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], Width(row[i]));
  }
  std::string text;
  for (const auto& row : rows) {
    std::string line(static_cast<std::size_t>(indent), ' ');
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (i > 0) line += "  ";
      const std::string padding(widths[i] - Width(row[i]), ' ');
      const bool flush_left = i == 0 || std::find(left.begin(), left.end(), i) != left.end();
      line += flush_left ? row[i] + padding : padding + row[i];
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

std::string Fields(const std::vector<std::pair<std::string, std::string>>& fields, int indent) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& [label, value] : fields) {
    if (!value.empty()) rows.push_back({label, value});
  }
  return Table(rows, indent, {1});
}

}  // namespace sherd::cli
