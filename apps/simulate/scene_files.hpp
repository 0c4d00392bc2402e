#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "apps/cli/output.hpp"
#include "sim/scene/scene.hpp"

namespace nbd {

/// Every file that a scene names, in its order.
std::vector<std::filesystem::path> scene_inputs(const SceneSpec& spec);

/// Loads what a scene's bodies are made from. A file that several bodies name is read, and a surface filled,
/// once.
class SceneFiles {
 public:
    /// Throws what reading, checking and filling throw, one line with the path; std::runtime_error where the
    /// tree belongs to another body.
    LoadedBody load(const SceneBody& spec, const Output& out);

 private:
    const Body& body(const SceneBody& spec, const Output& out);

    std::map<std::string, Body> bodies_;
};

}  // namespace nbd
