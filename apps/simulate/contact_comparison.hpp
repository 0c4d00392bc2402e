#pragma once

#include <string>
#include <vector>

#include "sim/scene/scene.hpp"
#include "sim/world/world.hpp"

namespace nbd {

/// Runs a scene a second time beside the first, with all contacts kept, and measures how far the two come
/// apart. Contact is chaotic, so small differences grow with time.
class ContactComparison {
 public:
    /// bodies: as passed to build_world().
    ContactComparison(const SceneSpec& spec, const std::vector<LoadedBody>& bodies);

    /// Takes the step that the scene took. Throws std::runtime_error where it fails.
    void step(double dt);

    /// Compares the two at the end of a frame. report: of the scene's last step.
    void compare(const World& world, const WorldReport& report);

    /// What the two have at the end of a frame, the scene's first. Units: metres, newtons, joules.
    struct Row {
        double time = 0;  // seconds
        int contacts = 0, all_contacts = 0;
        double farthest = 0, mean = 0;  // distance of nodes between the two
        double penetration = 0, all_penetration = 0;
        double force = 0, force_difference = 0;  // on the body with the largest one, with all contacts
        double energy = 0, all_energy = 0;
    };
    const std::vector<Row>& rows() const noexcept { return rows_; }

    /// A table of at most ten frames, evenly spread. size: that distances are compared with, metres.
    std::string table(double size) const;

 private:
    World all_;
    WorldReport last_;
    std::vector<Row> rows_;
};

}  // namespace nbd
