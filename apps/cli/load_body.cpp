#include "apps/cli/load_body.hpp"

#include <fmt/core.h>

#include <stdexcept>

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
        tets.T != other.T)
        throw std::runtime_error(
            fmt::format("{}: its tetrahedra are not those of {}", path.string(), other_path.string()));
}

}  // namespace nbd
