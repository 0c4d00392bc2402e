#include "sim/fem/held_statics.hpp"

#include <utility>

#include "meshing/surface/quadratic_tets.hpp"

namespace nbd {

HeldStatics::HeldStatics(const ElasticBody& body, const std::vector<char>& is_held)
    : body_(body), row_(body.node_count(), -1) {
    int moving = 0;
    for (int i = 0; i < body.node_count(); ++i)
        if (!is_held[i]) row_[i] = moving++;
    std::vector<std::vector<int>> rows(moving);
    for (int i = 0; i < body.node_count(); ++i)
        for (const int j : body.pattern().neighbours(i))
            if (row_[i] >= 0 && row_[j] >= 0) rows[row_[i]].push_back(row_[j]);
    pattern_ = BlockPattern(std::move(rows));
}

SparseMatrix HeldStatics::stiffness() const {
    const BlockPattern& whole = body_.pattern();
    SparseMatrix all = body_.rest_stiffness(), K = pattern_.zero_matrix();
    for (int i = 0; i < body_.node_count(); ++i) {
        if (row_[i] < 0) continue;
        int place = 0;  // rows keep their order
        for (int k = 0; k < std::ssize(whole.neighbours(i)); ++k)
            if (row_[whole.neighbours(i)[k]] >= 0)
                pattern_.block(K, row_[i], place++) = whole.block(all, i, k);
    }
    return K;
}

Eigen::VectorXd HeldStatics::loads(NodesRef forces) const {
    Eigen::VectorXd f(unknown_count());
    for (int i = 0; i < body_.node_count(); ++i)
        if (row_[i] >= 0) f.segment<3>(3 * row_[i]) = forces.row(i).transpose();
    return f;
}

Nodes HeldStatics::displacements(const Eigen::VectorXd& u) const {
    Nodes result = Nodes::Zero(body_.node_count(), 3);
    for (int i = 0; i < body_.node_count(); ++i)
        if (row_[i] >= 0) result.row(i) = u.segment<3>(3 * row_[i]).transpose();
    return result;
}

EndOfBody end_of_body(const TetMesh& mesh) {
    EndOfBody end;
    const Eigen::RowVector3d low = mesh.X.colwise().minCoeff(), extent = mesh.X.colwise().maxCoeff() - low;
    extent.maxCoeff(&end.longest);
    extent.minCoeff(&end.shortest);
    end.nodes.assign(mesh.X.rows(), 0);
    for (const int node : mesh.T.reshaped())
        end.nodes[node] = mesh.X(node, end.longest) < low[end.longest] + 0.1 * extent[end.longest];
    end.nodes = end_of_quadratic(mesh, std::move(end.nodes));
    return end;
}

std::vector<char> end_of_quadratic(const TetMesh& quadratic, std::vector<char> held) {
    held.resize(quadratic.X.rows(), 0);
    for (Eigen::Index t = 0; t < quadratic.E.rows(); ++t)
        for (std::size_t k = 0; k < edges_of_tet.size(); ++k) {
            const auto [a, b] = edges_of_tet[k];
            held[quadratic.E(t, k)] = held[quadratic.T(t, a)] && held[quadratic.T(t, b)];
        }
    return held;
}

}  // namespace nbd
