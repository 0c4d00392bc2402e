#pragma once

#include <vector>

#include "sim/barrier/barrier_contact.hpp"

namespace nbd {

/// Adds up the contacts of the same points: a vertex nearest to an edge is that to both of its faces, and so
/// are edges that end there. Contacts that only one pair of features has, inside a face, between two edges or
/// with an obstacle, come first; the order is fixed.
std::vector<BarrierContact> merged(std::vector<BarrierContact> contacts);

}  // namespace nbd
