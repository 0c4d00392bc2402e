#pragma once

#include <span>
#include <string>

#include "apps/bench/pairs/race.hpp"
#include "apps/drawing/canvas.hpp"

namespace nbd {

/// Rows of one race, and which it was.
struct RaceTable {
    std::string contact;  // "light", "heavy"
    std::string order;    // of the vertices: "file", "tree"
    std::vector<RaceRow> rows;
};

/// One line a row under a line of column names. Lines that begin with # name the machine.
std::string to_csv(std::span<const RaceTable> tables);

/// For reading: a line a method, fastest first, with the ratio to the fastest exact one that is given
/// the same positions.
std::string to_text(const RaceTable& table);

/// Total time by faces, a panel a contact and order; both axes logarithmic.
Page to_page(std::span<const RaceTable> tables);

/// The paper's figure 5: total, update and collision time by faces, for each method.
Page figure5(std::span<const RaceRow> rows);

}  // namespace nbd
