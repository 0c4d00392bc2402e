#pragma once

#include "sim/fem/elastic_body.hpp"

namespace nbd {

/// Kinetic energy of the node velocities v, [N, 3] m/s, in joules.
double kinetic_energy(const ElasticBody& body, NodesRef v);

}  // namespace nbd
