#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace nbd {

/// The known name that takes the fewest insertions, deletions and replacements of a letter to get from
/// `word`, the first of equally near ones. known: not empty.
const std::string& nearest_name(std::string_view word, const std::vector<std::string>& known);

}  // namespace nbd
