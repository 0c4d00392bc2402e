#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "meshing/h5/atomic_file.hpp"
#include "sim/scene/scene.hpp"

namespace nbd {

/// The reactions of a step.
struct StepReactions {
    int frame = 0;    // that the step belongs to
    double time = 0;  // end of the step, seconds
    std::vector<Reaction> all;
};

/// Writes reactions as CSV, a line for each of every step: frame, time, the body that it acts on, kind and
/// name of what exerts it, force (N) and torque (N m) about the origin; of a cavity, its pressure (Pa) above
/// the ambient one and its volume (m3) at the end of the step, else nothing. What does not touch has no line.
/// The file appears at finish().
class ReactionTable {
 public:
    /// spec: gives the names; must outlive this object. Throws std::runtime_error if the file cannot be
    /// created.
    ReactionTable(const std::filesystem::path& path, const SceneSpec& spec) : spec_(spec), file_(path) {
        file_.out() << columns << '\n';
    }
    static constexpr const char* columns =
        "frame,time,body,kind,by,force_x,force_y,force_z,torque_x,torque_y,torque_z,pressure,volume";

    void add(const std::vector<StepReactions>& steps);
    /// Throws std::runtime_error if a line could not be written.
    void finish() { file_.commit(); }

 private:
    const SceneSpec& spec_;
    h5::AtomicFile file_;
};

}  // namespace nbd
