#pragma once

#include <Eigen/Core>
#include <vector>

#include "collision/bounds/certified/region_motion.hpp"
#include "collision/topology/sphere_tree.hpp"

namespace nbd {

/// What `certified` bounds know of a body at rest; see CertifiedBound for the use that is made of it.
struct CertifiedModel {
    /// Some vertices of a tree node, reached from one of them, the anchor, by paths inside the tetrahedra.
    struct Cell {
        int anchor = 0;                  // surface vertex
        int carrier = 0;                 // region that most of the paths run through
        int leg_begin = 0, leg_end = 0;  // range of `legs`: all regions that paths run through
        float path = 0;                  // no path is longer, metres
        float weight = 0;                // of the cell in the node's centre, > 0
        Eigen::Vector3f m = {0, 0, 0};   // X_v - X_anchor of the cell's vertices at rest lie in the
        Eigen::Matrix3f B = Eigen::Matrix3f::Zero();  // ellipsoid {m + B w, |w| <= 1}, metres
    };
    /// The carrier of a cell and a region that the cell's paths touch.
    struct RegionPair {
        int carrier = 0, other = 0;
    };
    /// What paths of a cell do in one region.
    struct Leg {
        int pair = 0;      // of the carrier and the region
        float length = 0;  // no path runs further through it, metres
    };

    TetRegions regions;
    std::vector<int> cell_begin;  // [nodes + 1] into `cells`; every vertex of a node is in one of its cells
    std::vector<Cell> cells;
    std::vector<Leg> legs;
    std::vector<RegionPair> pairs;
    /// Positions come rounded: a vertex lies within `rounding` times its own largest coordinate or that of a
    /// node it hangs on of where exact arithmetic puts it. `reach`: the longest rest path to such a node, m.
    float rounding = 0, reach = 0;
};

/// Throws std::invalid_argument with what is wrong unless the model's parts fit each other and a tree over a
/// surface of `vertex_count` vertices: for models that come from a file. That the paths are as long as the
/// model says is not checked.
void check_certified_model(const CertifiedModel& model, const SphereTree& tree, int vertex_count);

}  // namespace nbd
