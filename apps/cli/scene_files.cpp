#include "apps/cli/scene_files.hpp"

#include <fmt/core.h>

#include "apps/cli/load_body.hpp"
#include "apps/cli/mesh_file.hpp"

namespace nbd {

std::vector<std::filesystem::path> scene_inputs(const SceneSpec& spec) {
    std::vector<std::filesystem::path> files;
    const auto add = [&](const std::filesystem::path& file) {
        if (!file.empty()) files.push_back(file);
    };
    for (const SceneBody& body : spec.bodies) {
        add(body.file);
        add(body.tree);
    }
    for (const SceneObstacle& obstacle : spec.obstacles) add(obstacle.mesh);
    return files;
}

std::shared_ptr<const Body> SceneFiles::body(const SceneBody& spec, const Output& out) {
    const SceneMeshing& m = spec.meshing;
    const std::string key =
        fmt::format("{}|{}|{}|{}|{}|{}|{}|{}", spec.file.string(), static_cast<int>(spec.source),
                    m.tets.nodes, m.tets.grading, m.scale, m.weld, m.levels, static_cast<int>(m.scheme));
    const auto known = bodies_.find(key);
    if (known != bodies_.end()) return known->second;
    const MeshFileConfig config{.tets = m.tets,
                                .inside = {},
                                .scale = m.scale,
                                .weld = m.weld,
                                .material = {},
                                .levels = m.levels,
                                .scheme = m.scheme};
    Body body = spec.source == BodySource::body   ? load_body(spec.file)
                : spec.source == BodySource::tets ? body_of_tets(spec.file, config, out)
                                                  : body_of_surface(spec.file, config, out).body;
    return bodies_.emplace(key, std::make_shared<const Body>(std::move(body))).first->second;
}

LoadedBody SceneFiles::load(const SceneBody& spec, const Output& out) {
    LoadedBody loaded{body(spec, out), nullptr};
    if (spec.tree.empty()) return loaded;
    std::shared_ptr<const CollisionTree>& tree = trees_[{loaded.body.get(), spec.tree}];
    if (!tree) {
        TreeFile file = load_tree_of(spec.file, body_hash(*loaded.body), spec.tree);
        tree = std::make_shared<const CollisionTree>(std::move(file.tree));
    }
    loaded.tree = tree;
    return loaded;
}

}  // namespace nbd
