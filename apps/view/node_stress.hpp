#pragma once

#include <vector>

#include "sim/fem/elastic_body.hpp"

namespace nbd {

/// Appends the von Mises stress at the nodes of a body, Pa: means over the tetrahedra around each node,
/// weighted with their volumes at rest. Tetrahedra without a finite stress are left out. x: [N, 3] metres.
void add_node_stress(const ElasticBody& body, NodesRef x, std::vector<float>& stress);

}  // namespace nbd
