#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace nbd {

/// The known name that a mistyped word means: the one that is the fewest insertions, deletions and
/// replacements of a letter away, the first of equally near ones. A word counts as mistyped up to one of
/// these for every three of its letters, rounded up; dashes in front are no letters. Else the first name that
/// ends in the word, if it has three letters or more; else empty.
std::string nearest_name(std::string_view word, const std::vector<std::string>& known);

/// phrase, with {} replaced by nearest_name(); empty if that is empty. Ends a message about an unknown word.
std::string nearest_hint(std::string_view word, const std::vector<std::string>& known,
                         std::string_view phrase);

}  // namespace nbd
