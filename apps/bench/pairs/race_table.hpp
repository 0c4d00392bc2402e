#pragma once

#include <span>
#include <string>

#include "apps/bench/pairs/race.hpp"
#include "apps/drawing/canvas.hpp"

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

/// Total time by number of faces, one panel per contact and order; both axes logarithmic.
Page to_page(std::span<const RaceTable> tables);

/// The paper's figure 5: total, update and collision time by number of faces, for each method.
Page figure5(std::span<const RaceRow> rows);

}  // namespace nbd
