#include "apps/simulate/draw_scene.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "collision/base/file_text.hpp"
#include "sim/scene/scene_template.hpp"

namespace nbd {
namespace {

SceneValues values_of(const SceneTemplate& scene, const SceneDraw& draw) {
    SceneValues values = draw.trajectory ? scene.draw(draw.seed.value_or(1), *draw.trajectory, draw.again)
                                         : SceneValues::object();
    set_values(scene, draw.set, values);
    std::string missing;
    for (const SceneVariable& variable : scene.variables())
        if (!values.contains(variable.name)) missing += (missing.empty() ? "" : ", ") + variable.name;
    if (!missing.empty())
        throw std::invalid_argument(fmt::format(
            "its variables have no values: {}; allowed: --trajectory K, which draws them, or --set "
            "NAME=VALUE for each",
            missing));
    return values;
}

}  // namespace

SceneSpec load_scene(const std::filesystem::path& path, const SceneDraw& draw, const Output& out) {
    try {
        if (is_template(file_text(path))) {
            std::vector<std::string> problems;
            const SceneTemplate scene(file_text(path), path.parent_path(), problems);
            if (!problems.empty()) throw std::invalid_argument(problems.front());
            const SceneValues values = values_of(scene, draw);
            out.text(fmt::format("{}: {}", path.string(), values_text(values)));
            return scene.scene_with(values);
        }
        if (draw.is_given())
            throw std::invalid_argument(
                "has no variables; allowed: --trajectory, --seed, --draw and --set for a scene with \"variables\"");
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(fmt::format("{}: {}", path.string(), error.what()));
    }
    return load_scene(path);
}

}  // namespace nbd
