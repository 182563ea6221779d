#include "app/bench/figure_table.h"

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/project/format.h"
#include "metaball/atomic_file.h"
#include "metaball/error.h"

namespace sherd {
namespace {

using Json = nlohmann::ordered_json;

std::string Quoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out(1, '"');
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c;
  }
  out += '"';
  return out;
}

std::string CellOf(const Figure& figure) {
  if (const auto* text = std::get_if<std::string>(&figure)) return Quoted(*text);
  if (const auto* yes = std::get_if<bool>(&figure)) return *yes ? "true" : "false";
  const auto* number = std::get_if<double>(&figure);
  return number && std::isfinite(*number) ? FormatExact(*number) : "";
}

Json JsonValue(const Figure& figure) {
  if (const auto* text = std::get_if<std::string>(&figure)) return *text;
  if (const auto* yes = std::get_if<bool>(&figure)) return *yes;
  const auto* number = std::get_if<double>(&figure);
  if (!number || !std::isfinite(*number)) return nullptr;
  // Counts are written as whole numbers.
  if (*number == std::floor(*number) && std::abs(*number) < 0x1p53) {
    return static_cast<std::int64_t>(*number);
  }
  return *number;
}

}  // namespace

std::string CsvOf(const FigureTable& table) {
  std::string text;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    if (i > 0) text += ',';
    text += Quoted(table.columns[i]);
  }
  text += '\n';
  for (const std::vector<Figure>& row : table.rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (i > 0) text += ',';
      text += CellOf(row[i]);
    }
    text += '\n';
  }
  return text;
}

std::string JsonOf(const std::vector<std::pair<std::string, Figure>>& header,
                   const FigureTable& table) {
  Json json = Json::object();
  for (const auto& [name, value] : header) json[name] = JsonValue(value);
  Json rows = Json::array();
  for (const std::vector<Figure>& row : table.rows) {
    Json object = Json::object();
    for (std::size_t i = 0; i < row.size(); ++i) object[table.columns[i]] = JsonValue(row[i]);
    rows.push_back(std::move(object));
  }
  json["rows"] = std::move(rows);
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

void MakeFolder(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!std::filesystem::is_directory(folder)) {
    throw OutputError(folder, "no such folder, and it cannot be made: " + error.message());
  }
}

void WriteTextFile(const std::string& path, const std::string& text) {
  AtomicFile file(path);
  file.Write(text.data(), text.size());
  file.Commit();
}

}  // namespace sherd
