#include "sim/fem/stress.hpp"

#include <cmath>

#include "meshing/parallel/parallel_for.hpp"

namespace nbd {

Eigen::VectorXd von_mises_stress(const ElasticBody& body, NodesRef x) {
    Eigen::VectorXd stress(body.point_count());
    parallel_for(body.batch_count(), [&](int batch) {
        const LaneModuli moduli = body.lane_moduli(batch);
        const PrincipalLanes sigma = body.principal_stretches_of(x, batch);
        PrincipalLanes principal = body.response(batch, sigma).stress;
        for (std::size_t i = 0; i < 3; ++i) {
            const Lanes cauchy = principal[i] / (sigma[(i + 1) % 3] * sigma[(i + 2) % 3]);
            for (int l = 0; l < lanes; ++l)
                if (moduli.law[l] != MaterialLaw::corotated) principal[i][l] = cauchy[l];
        }
        const Lanes squared = (principal[0] - principal[1]).square() +
                              (principal[1] - principal[2]).square() + (principal[2] - principal[0]).square();
        for (int l = 0; l < body.points_of(batch); ++l)
            stress[body.first_point(batch) + l] = std::sqrt(squared[l] / 2);
    });
    const int per_tet = body.points_per_tet();
    return stress.reshaped(per_tet, body.element_count()).colwise().mean().transpose();
}

ElementStress element_stress(const ElasticBody& body, NodesRef x) {
    ElementStress result{Vertices(3 * body.point_count(), 3), Vertices(3 * body.point_count(), 3)};
    parallel_for(body.batch_count(), [&](int batch) {
        LaneMatrix3 F, P;
        body.stress_of(x, batch, F, P);
        for (int l = 0; l < body.points_of(batch); ++l) {
            const Eigen::Index row = 3 * (body.first_point(batch) + l);
            result.F.middleRows<3>(row) = F.lane(l).cast<float>();
            result.P.middleRows<3>(row) = P.lane(l).cast<float>();
        }
    });
    return result;
}

}  // namespace nbd
