#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "meshing/h5/atomic_file.hpp"
#include "sim/scene/scene.hpp"
#include "training/files/recorded_reactions.hpp"

namespace nbd {

/// The reactions of a step.
struct StepReactions {
    int frame = 0;    // that the step belongs to
    double time = 0;  // end of the step, seconds
    std::vector<Reaction> all;
};

/// The reactions of steps, with the names of the scene. Bodies are numbers of the scene.
std::vector<RecordedReaction> recorded(const SceneSpec& spec, std::span<const StepReactions> steps);

/// Writes reactions as CSV, a line for each of every step, with the columns of reaction_columns: vectors take
/// three, a body is told by name, and what a reaction does not have is an empty cell. What does not touch has
/// no line. The file appears at finish().
class ReactionTable {
 public:
    /// spec: gives the bodies' names; must outlive this object. Throws std::runtime_error if the file cannot
    /// be created.
    ReactionTable(const std::filesystem::path& path, const SceneSpec& spec) : spec_(spec), file_(path) {
        file_.out() << columns() << '\n';
    }
    /// Their names, with commas between them.
    static std::string columns();

    void add(std::span<const RecordedReaction> rows);
    /// Throws std::runtime_error if a line could not be written.
    void finish() { file_.commit(); }

 private:
    const SceneSpec& spec_;
    h5::AtomicFile file_;
};

}  // namespace nbd
