#include "sim/fem/bending_error.hpp"

#include <stdexcept>
#include <utility>
#include <vector>

#include "meshing/surface/quadratic_tets.hpp"
#include "sim/factor/cholesky.hpp"
#include "sim/fem/held_statics.hpp"

namespace nbd {
namespace {

/// Work of a body's weight while its end is held. held: nodes of the end, [N].
double work_of_weight(const ElasticBody& elastic, const std::vector<char>& held, Eigen::Index down) {
    const HeldStatics statics(elastic, held);
    Nodes weight = Nodes::Zero(elastic.node_count(), 3);
    weight.col(down) = elastic.node_masses();
    const SparseMatrix K = statics.stiffness();
    Cholesky factor;
    factor.analyze(K);
    factor.factorize(K);
    const Eigen::VectorXd f = statics.loads(weight);
    Eigen::VectorXd u(f.size());
    factor.solve(f, u);
    return f.dot(u);
}

}  // namespace

std::optional<double> bending_error(const Body& body, int most_tets) {
    const bool quadratic = body.tets.is_quadratic();
    const int parts = quadratic ? 8 : 1;
    if (parts * body.tets.T.rows() > most_tets) return {};
    const EndOfBody end = end_of_body(body.tets);
    TetMesh finer = make_quadratic(quadratic ? split(body.tets) : body.tets);
    std::vector<MaterialRegion> regions = body.regions;
    for (MaterialRegion& region : regions)
        if (quadratic) {
            const std::vector<int> whole = std::exchange(region.tets, {});
            for (const int t : whole)
                for (int k = 0; k < parts; ++k) region.tets.push_back(parts * t + k);
        }
    const std::vector<char> held = end_of_quadratic(finer, end.nodes);
    try {
        const double work = work_of_weight(ElasticBody(body), end.nodes, end.shortest),
                     richer = work_of_weight(ElasticBody(std::move(finer), body.material, regions), held,
                                             end.shortest);
        const double missing = (richer - work) / richer;
        constexpr double rounding = 1e-6;  // richer elements can only yield more
        if (!(work > 0) || !(missing > -rounding) || !(missing < 1)) return {};
        return quadratic ? 4 * missing / 3 : missing;
    } catch (const std::runtime_error&) {  // its end or another part of it is not held enough
        return {};
    } catch (const std::invalid_argument&) {  // tetrahedra that no simulation takes
        return {};
    }
}

}  // namespace nbd
