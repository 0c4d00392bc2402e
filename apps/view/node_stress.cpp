#include "apps/view/node_stress.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/fem/stress.hpp"

namespace nbd {

void add_node_stress(const ElasticBody& body, NodesRef x, std::vector<float>& stress) {
    const Eigen::VectorXd of_tets = von_mises_stress(body, x);
    const Tets& T = body.rest().T;
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(body.node_count()), weight = sum;
    for (int t = 0; t < body.element_count(); ++t) {
        if (!std::isfinite(of_tets[t])) continue;
        const double volume = body.rest_volumes()[t];
        for (int c = 0; c < 4; ++c) {
            sum[T(t, c)] += volume * of_tets[t];
            weight[T(t, c)] += volume;
        }
    }
    for (int i = 0; i < body.node_count(); ++i) {
        const double mean = weight[i] > 0 ? sum[i] / weight[i] : 0;
        stress.push_back(static_cast<float>(std::min<double>(mean, std::numeric_limits<float>::max())));
    }
}

}  // namespace nbd
