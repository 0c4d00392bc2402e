#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "collision/neighbours/edge_paths.hpp"
#include "collision/neighbours/rest_neighbours.hpp"

namespace nbd {

/// Where the faces of a tree are.
struct FacePlaces {
    explicit FacePlaces(const WideTree& tree);
    std::vector<int> leaf;           // [m]
    std::vector<std::uint8_t> slot;  // [m] position in the leaf
};

/// Finds the region around a leaf, and how near its faces are to the leaf's. One object per thread.
class RegionBuilder {
 public:
    struct Surface {
        const Nodes& X;
        FacesRef F;
        const WideTree& tree;
        const FacePlaces& places;
        const EdgeGraph& graph;
        const FacePairSet* left_out;  // null: none
        double left_out_distance;     // see RestNeighbours
        double radius;
    };
    /// As RestNeighbours::Region has them.
    struct Lists {
        std::vector<int> vertices;
        std::vector<RestNeighbours::Covered> covered;
        double distance, longest_edge;
    };

    /// surface: what it refers to must outlive this object.
    explicit RegionBuilder(const Surface& surface);
    Lists build(int leaf);

 private:
    struct Face {
        int face;
        std::array<int, 3> corners;
        Eigen::RowVector3d centre;
        double radius;        // of a ball around the centre
        double longest_edge;  // metres
    };
    Face face_of(int face) const;
    std::vector<int> faces_between(std::span<const int> vertices);
    void enclose_own();
    double lower_bound(const Face& a, const Face& b) const;
    double measured(const Face& a, const Face& b) const;
    double distance_to_leaf(const Face& face, double least, double enough);

    const Surface surface_;
    const double coordinate_error_;  // of positions in single precision, metres
    EdgePaths paths_;
    std::vector<char> is_inside_;  // [n] whether a vertex is in the region
    std::vector<Face> own_;        // faces of the leaf
    Eigen::RowVector3d own_centre_ = Eigen::RowVector3d::Zero();
    double own_radius_ = 0;  // of a ball around them
    struct Candidate {
        double bound;  // of the distance
        const Face* own;
    };
    std::vector<Candidate> candidates_;  // scratch
};

}  // namespace nbd
