#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "meshing/h5/reader.hpp"
#include "meshing/h5/writer.hpp"
#include "training/files/recorded_reactions.hpp"

// The reactions of a recording: an array for each column, in a group of the file. Texts are numbers of lines
// of one text.
namespace nbd {

/// Group of a recording's reactions.
inline constexpr const char* reactions_group = "reactions";
inline constexpr const char* reaction_names = "reactions/names";

class ReactionArrays {
 public:
    /// Begins the arrays.
    explicit ReactionArrays(h5::Writer& file);

    /// Throws std::invalid_argument for a row that is earlier than the one before, or not finite.
    void add(std::span<const RecordedReaction> rows);
    /// Ends the arrays.
    void finish();

 private:
    int number_of(std::string text);

    h5::Writer& file_;
    std::vector<int> handles_;  // [columns]
    std::map<std::string, int> numbers_;
    std::vector<std::string> names_;
    RecordedReaction last_;  // row
};

/// All rows; none where the file has no reactions. Throws std::runtime_error for arrays of different lengths,
/// rows that are out of order, numbers that are not finite, and texts that are not there.
std::vector<RecordedReaction> read_reactions(const h5::Reader& file);

}  // namespace nbd
