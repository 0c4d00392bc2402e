#pragma once

#include <Eigen/Core>
#include <vector>

#include "sim/fem/elastic_body.hpp"

namespace nbd {

/// The equations K u = f of small displacements of a body of which some nodes do not move.
class HeldStatics {
 public:
    /// is_held: [N], non-zero for these nodes. The body must outlive the equations.
    HeldStatics(const ElasticBody& body, const std::vector<char>& is_held);
    explicit HeldStatics(const ElasticBody&&, const std::vector<char>&) = delete;

    int unknown_count() const noexcept { return 3 * pattern_.node_count(); }
    SparseMatrix stiffness() const;  // K of the nodes that move, N/m

    /// Forces on the nodes that move, stacked. forces: [N, 3], newtons.
    Eigen::VectorXd loads(NodesRef forces) const;
    /// Displacements of all nodes, [N, 3] metres, zero where they are held. u: [unknowns].
    Nodes displacements(const Eigen::VectorXd& u) const;

 private:
    const ElasticBody& body_;
    std::vector<int> row_;  // [N] number among the nodes that move; -1: held
    BlockPattern pattern_;  // of these
};

/// An end of a body, to be held: the corners in the first tenth of its longest axis, and the nodes of edges
/// between these.
struct EndOfBody {
    std::vector<char> nodes;                 // [N] non-zero
    Eigen::Index longest = 0, shortest = 0;  // axes
};
EndOfBody end_of_body(const TetMesh& mesh);

/// The same end of make_quadratic(mesh). held: nodes of the mesh.
std::vector<char> end_of_quadratic(const TetMesh& quadratic, std::vector<char> held);

}  // namespace nbd
