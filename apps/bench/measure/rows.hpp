#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace nbd {

/// What a benchmark found: objects with the same keys, one a row. Its table on the screen, its CSV and its
/// JSON are made of them.
using Rows = std::vector<nlohmann::ordered_json>;

/// Writes CSV: a comment that names the machine, the keys of the first row, then a line per row. Numbers have
/// up to nine digits; true is 1, false 0, null nothing. Atomic. Throws std::runtime_error with path and
/// reason.
void write_csv(const std::filesystem::path& path, const Rows& rows);

/// Columns of these keys, aligned, with the keys on top; numbers have about three digits.
std::string to_text(const Rows& rows, const std::vector<std::string>& keys);

/// Sum of a column of whole numbers; 0 if there are no rows.
long sum_of(const Rows& rows, const std::string& key);

}  // namespace nbd
