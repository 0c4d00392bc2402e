#pragma once

#include <span>
#include <string>

#include "apps/bench/pairs/race.hpp"

namespace nbd {

/// Rows of one race, with its kind of contact and vertex order.
struct RaceTable {
    std::string contact;  // "light", "heavy"
    std::string order;    // of the vertices: "file", "tree"
    std::vector<RaceRow> rows;
};

/// CSV: a line with # that describes the machine, column names, then one line per row.
std::string to_csv(std::span<const RaceTable> tables);

/// Text table: one line per method, fastest first, with the ratio to the fastest exact method that reads the
/// same positions.
std::string to_text(const RaceTable& table);

}  // namespace nbd
