// A table of figures that becomes a CSV file, JSON objects and columns on a screen from one
// description.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace sherd {

// Nothing, a word, a number or yes/no. Not finite numbers are written as nothing.
using Figure = std::variant<std::monostate, std::string, double, bool>;

struct FigureTable {
  std::vector<std::string> columns;
  std::vector<std::vector<Figure>> rows;  // each as long as `columns`
};

// First row the names; RFC 4180: what holds a comma, a quote or a line end is quoted.
std::string CsvOf(const FigureTable& table);
// {HEADER..., "rows": [{COLUMN: FIGURE, ...}, ...]}, indented, with a line end.
std::string JsonOf(const std::vector<std::pair<std::string, Figure>>& header,
                   const FigureTable& table);

// Makes the folder where it is not there. Throws OutputError.
void MakeFolder(const std::string& folder);
// The whole file or none. Throws OutputError.
void WriteTextFile(const std::string& path, const std::string& text);

}  // namespace sherd
