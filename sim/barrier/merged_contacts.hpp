#pragma once

#include <vector>

#include "sim/contact/contact.hpp"

namespace nbd {

/// Adds up the stiffnesses of contacts of the same points: a vertex nearest to an edge is that to both of its
/// faces, and so are edges that end there. Contacts that only one pair of features has, inside a face,
/// between two edges or with an obstacle, come first; the order is fixed.
std::vector<Contact> merged(std::vector<Contact> contacts);

}  // namespace nbd
