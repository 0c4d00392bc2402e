#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "apps/cli/output.hpp"
#include "sim/scene/scene.hpp"

namespace nbd {

/// All files that a scene names, in order.
std::vector<std::filesystem::path> scene_inputs(const SceneSpec& spec);

/// Loads the bodies of a scene. A file that several bodies name is read, and meshed if it is a surface, only
/// once; these bodies share its data.
class SceneFiles {
 public:
    /// Throws what reading, checking and filling throw, one line with the path; std::runtime_error if the
    /// tree belongs to another body.
    LoadedBody load(const SceneBody& spec, const Output& out);

 private:
    std::shared_ptr<const Body> body(const SceneBody& spec, const Output& out);

    std::map<std::string, std::shared_ptr<const Body>> bodies_;
    std::map<std::pair<const Body*, std::filesystem::path>, std::shared_ptr<const CollisionTree>> trees_;
};

}  // namespace nbd
