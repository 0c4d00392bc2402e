#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/cli/output.hpp"
#include "sim/scene/scene.hpp"

namespace nbd {

/// Which trajectory of a scene with variables is run: as nbdtree dataset draws it, or with values that are
/// given.
struct SceneDraw {
    std::optional<int> trajectory{};
    int again = 0;  // how often its values are drawn again
    std::optional<std::uint64_t> seed{};
    std::vector<std::string> set{};  // "name=value"

    bool is_given() const { return trajectory || seed || again > 0 || !set.empty(); }
};

/// load_scene(), and of a scene with variables the one that is drawn, whose values it prints. Throws one line
/// where a variable has no value, or the scene has none.
SceneSpec load_scene(const std::filesystem::path& path, const SceneDraw& draw, const Output& out);

}  // namespace nbd
