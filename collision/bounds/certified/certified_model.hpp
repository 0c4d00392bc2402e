#pragma once

#include <Eigen/Core>
#include <vector>

#include "collision/bounds/certified/region_motion.hpp"
#include "collision/topology/sphere_tree.hpp"

namespace nbd {

/// Rest-pose data of `certified` bounds; CertifiedBound describes how it is used.
struct CertifiedModel {
    /// Some vertices of a tree node, reached from one of them, the anchor, by paths inside the solid.
    struct Cell {
        int anchor = 0;                               // surface vertex
        int carrier = 0;                              // region with the greatest total length of paths
        int leg_begin = 0, leg_end = 0;               // range of `legs`: all regions with a part of a path
        float path = 0;                               // upper bound on the length of each path, metres
        float weight = 0;                             // weight of the cell in the node's centre, > 0
        Eigen::Vector3f m = {0, 0, 0};                // the ellipsoid {m + B w, |w| <= 1}, metres, contains
        Eigen::Matrix3f B = Eigen::Matrix3f::Zero();  // X_v - X_anchor of all vertices v of the cell
    };
    /// The carrier of a cell and a region that the cell's paths touch.
    struct RegionPair {
        int carrier = 0, other = 0;
    };
    /// The parts of a cell's paths in one region.
    struct Leg {
        int pair = 0;      // pair of the carrier and the region
        float length = 0;  // upper bound on the length of each path in the region, metres
    };

    TetRegions regions;
    std::vector<int> cell_begin;  // [nodes + 1] ranges of `cells`, which cover all vertices of each node
    std::vector<Cell> cells;
    std::vector<Leg> legs;
    std::vector<RegionPair> pairs;
    /// Positions are rounded: a vertex is off its exact position by at most `rounding` times the largest
    /// coordinate of itself and of the nodes that it depends on. `reach`: longest rest path to such a node,
    /// metres.
    float rounding = 0, reach = 0;
};

/// Validates a model read from a file. Throws std::invalid_argument, saying what is wrong, unless its parts
/// fit each other and a tree over a surface of `vertex_count` vertices. Does not check the lengths of the
/// paths.
void check_certified_model(const CertifiedModel& model, const SphereTree& tree, int vertex_count);

}  // namespace nbd
