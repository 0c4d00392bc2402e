#include "sim/fem/kinetic_energy.hpp"

namespace nbd {

double kinetic_energy(const ElasticBody& body, NodesRef v) {
    Nodes p(v.rows(), 3);
    body.mass_product(v, p);
    return 0.5 * p.cwiseProduct(v).sum();
}

}  // namespace nbd
