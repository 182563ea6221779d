// Figures in columns, for people.
#pragma once

#include <string>
#include <vector>

namespace sherd::cli {

// Each row has as many cells as the first. The first column is flush left, the others flush right
// or, where `left` names them, left; two blanks between, `indent` before.
std::string Table(const std::vector<std::vector<std::string>>& rows, int indent = 2,
                  const std::vector<std::size_t>& left = {});

// "label   value" lines with the values under each other; lines without a value are left out.
std::string Fields(const std::vector<std::pair<std::string, std::string>>& fields, int indent = 2);

}  // namespace sherd::cli
