#include "meshing/body/enclose.hpp"

#include <cmath>
#include <stdexcept>

#include "meshing/body/embed.hpp"

namespace nbd {

void enclose(TetMesh& tets, NodesRef points) {
    constexpr int rounds = 20;
    constexpr double beyond = 1.1,  // times the way to the outermost point
        rounding = 1e-12;           // of weights
    double volumes = 0;
    for (Eigen::Index t = 0; t < tets.T.rows(); ++t) volumes += volume(tets, t);
    const double margin = 1e-6 * std::cbrt(volumes / static_cast<double>(tets.T.rows()));  // metres
    for (int round = 0; round <= rounds; ++round) {
        const Embedding W = embed(tets, points);
        Nodes ways = Nodes::Zero(tets.X.rows(), 3);
        bool are_inside = true;
        for (Eigen::Index p = 0; p < W.rows(); ++p) {
            double inside = 0;
            Eigen::RowVector3d nearest = Eigen::RowVector3d::Zero();
            bool is_inside = true;
            for (Embedding::InnerIterator entry(W, p); entry; ++entry) {
                is_inside = is_inside && entry.value() >= -rounding;
                if (entry.value() <= 0) continue;
                inside += entry.value();
                nearest += entry.value() * tets.X.row(entry.col());
            }
            if (is_inside) continue;
            are_inside = false;
            // From the node that it lies behind: across the face by as far as it is outside.
            const Eigen::RowVector3d outside = points.row(p) - nearest / inside,
                                     way = beyond * outside + margin * outside.normalized();
            for (Embedding::InnerIterator entry(W, p); entry; ++entry)
                if (entry.value() > 0 && way.squaredNorm() > ways.row(entry.col()).squaredNorm())
                    ways.row(entry.col()) = way;
        }
        if (are_inside) return;
        if (round == rounds) throw std::invalid_argument("tetrahedra do not come to hold the whole surface");
        tets.X += ways;
        for (Eigen::Index t = 0; t < tets.T.rows(); ++t)
            if (!(volume(tets, t) > 0))
                throw std::invalid_argument("tetrahedra that hold the whole surface would be inside out");
    }
}

}  // namespace nbd
