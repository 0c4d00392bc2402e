#include "apps/cli/load_body.hpp"

#include <fmt/core.h>

#include <stdexcept>

#include "apps/cli/mesh_file.hpp"

namespace nbd {

SurfaceBody surface_body(const Body& body) {
    const Eigen::MatrixXf none(3 * body.tets.X.rows(), 0);  // a body file without modes has no matrix of them
    SurfaceBody result = make_surface_body(body.surface.X.cast<float>(), body.surface.F, body.float_weights(),
                                           body.modes.count() > 0 ? body.modes.U : none, body_hash(body));
    result.solid = body.tets;
    return result;
}

TreeFile load_tree_of(const std::filesystem::path& body, const std::string& hash,
                      const std::filesystem::path& tree) {
    TreeFile file = load_tree(tree);
    if (file.facts.body_hash != hash)
        throw std::runtime_error(
            fmt::format("{}: this tree belongs to another body than {}", tree.string(), body.string()));
    return file;
}

void check_same_tets(const std::filesystem::path& path, const TetMesh& tets,
                     const std::filesystem::path& other_path, const TetMesh& other) {
    if (tets.X.rows() != other.X.rows() || tets.T.rows() != other.T.rows() || tets.X != other.X ||
        tets.T != other.T || tets.E.rows() != other.E.rows() || tets.E != other.E)
        throw std::runtime_error(
            fmt::format("{}: its tetrahedra are not those of {}", path.string(), other_path.string()));
}

std::vector<std::filesystem::path> scene_inputs(const SceneSpec& spec) {
    std::vector<std::filesystem::path> files;
    const auto add = [&](const std::filesystem::path& file) {
        if (!file.empty()) files.push_back(file);
    };
    for (const SceneBody& body : spec.bodies) {
        add(body.file);
        add(body.tree);
    }
    for (const SceneObstacle& obstacle : spec.obstacles) {
        add(obstacle.mesh);
        if (obstacle.heights) add(obstacle.heights->file);
        if (!obstacle.recording) continue;
        add(obstacle.recording->file);
        add(obstacle.recording->body);
    }
    return files;
}

std::shared_ptr<const Body> SceneFiles::body(const SceneBody& spec, const Output& out) {
    const SceneMeshing& m = spec.meshing;
    const std::string key =
        fmt::format("{}|{}|{}|{}|{}|{}|{}|{}|{}|{}|{}|{}|{}|{}|{}", spec.file.string(),
                    static_cast<int>(spec.source), m.tets.nodes, m.tets.grading, m.edge, m.scale,
                    m.stretch.x(), m.stretch.y(), m.stretch.z(), m.weld, m.levels, static_cast<int>(m.scheme),
                    m.error.value_or(-1), m.elements ? static_cast<int>(*m.elements) : -1, m.rigid);
    const auto known = bodies_.find(key);
    if (known != bodies_.end()) return known->second;
    const MeshFileConfig config{m};
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

std::vector<LoadedBody> load_bodies(SceneSpec& spec, const Output& out) {
    SceneFiles files;
    files.load_recordings(spec);
    std::vector<LoadedBody> bodies;
    for (const SceneBody& body : spec.bodies) bodies.push_back(files.load(body, out));
    return bodies;
}

}  // namespace nbd
