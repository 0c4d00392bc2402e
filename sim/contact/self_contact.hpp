#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "collision/neighbours/neighbour_proof.hpp"
#include "collision/query/self_query.hpp"
#include "sim/contact/contact.hpp"
#include "sim/contact/contact_sides.hpp"
#include "sim/contact/nearest_face.hpp"
#include "sim/fem/step_report.hpp"
#include "sim/patches/contact_surface.hpp"

namespace nbd {

/// What SelfContactFinder knows of a surface at rest. Does not change; bodies of one shape share it.
class SelfContactRest {
 public:
    /// rest: positions of the nodes, [N, 3]. tree: of the surface, whose leaves may be its patches; null:
    /// none. thickness: self_thickness(), metres.
    SelfContactRest(const ContactSurface& surface, NodesRef rest, const WideTree* tree, double thickness);

    /// Whether the constructor would make the same of these, for a body with the same rest positions.
    bool is_of(const ContactShape* shape, const WideTree* tree, double thickness) const noexcept {
        return shape == shape_.get() && tree == tree_ && thickness == thickness_;
    }
    double thickness() const noexcept { return thickness_; }
    /// Pairs of faces at most twice the thickness apart, by positions in single precision.
    const std::shared_ptr<const FacePairSet>& near() const noexcept { return near_; }
    /// For proofs that others stay apart; null if the leaves of the tree are not the patches.
    const std::shared_ptr<const RestNeighbours>& neighbours() const noexcept { return neighbours_; }

 private:
    std::shared_ptr<const ContactShape> shape_;
    const WideTree* tree_;
    double thickness_;
    std::shared_ptr<const FacePairSet> near_;
    std::shared_ptr<const RestNeighbours> neighbours_;
};

/// Finds where a body presses on itself: each vertex with the nearest face that it is in front of, and pairs
/// of edges that cross at a distance. What was near at rest makes no contact: faces with a common vertex, and
/// faces nearer to each other than twice the thickness. For each vertex in contact it tells the side by
/// which the vertex came, as BodyContactFinder remembers it. A vertex behind a face that it was not in
/// contact with before is no contact: the face may be on the other side of a thin part.
class SelfContactFinder {
 public:
    /// body: its number, to store in the contacts.
    SelfContactFinder(int body, std::shared_ptr<const SelfContactRest> rest);

    /// Appends contacts by ascending vertices, then edges, on the threads of the caller's TBB arena;
    /// stiffness and friction stay zero. tree: of the surface, posed. v: velocities of the nodes, [N, 3],
    /// which they keep for `dt`. error: by how much positions in the tree may be off. moved: maximum approach
    /// of parts of the body since the last call. All lengths in metres. sides: of its vertices in contact at
    /// the last call; replaced by those of now.
    void find(const ContactSurface& surface, PosedTree& tree, const Nodes& v, double dt, double error,
              double moved, VertexSides& sides, std::vector<Contact>& contacts);

    const std::shared_ptr<const SelfContactRest>& rest() const noexcept { return rest_; }

    /// Counts and times of the last find(), as far as it knows them.
    const StepReport& costs() const noexcept { return costs_; }

 private:
    /// A ball around a face and one around its corners' motions in the step, metres.
    struct FaceBalls {
        Eigen::Vector3d centre, motion;
        double radius, spread;
    };
    /// A vertex and a face that may make contact.
    struct VertexFace {
        int vertex;
        NearestFace face;
    };
    struct EdgeContact {
        int a, b;  // edges
        Contact contact;
    };
    struct Found {
        std::vector<VertexFace> vertices;
        std::vector<EdgeContact> edges;
    };

    void prove(const Nodes& x, const ContactReach& reach);
    std::span<const FacePair> near_faces(PosedTree& tree, const ContactReach& reach, double error);
    void measure_faces(const ContactSurface& surface, std::span<const FacePair> pairs);
    /// What decides whether features that are near make contact.
    struct Test {
        const ContactReach& reach;
        double moved;
        const VertexSides& sides;
    };
    void test_pair(const ContactSurface& surface, const FacePair& pair, const Test& test, Found& found) const;
    void test_vertex(const ContactSurface& surface, int vertex, int face, const Test& test,
                     Found& found) const;
    void test_edges(const ContactSurface& surface, int a, int b, const ContactReach& reach,
                    Found& found) const;
    void add_vertices(const ContactSurface& surface, std::vector<VertexFace>& vertices, VertexSides& sides,
                      std::vector<Contact>& contacts) const;

    int body_;
    std::shared_ptr<const SelfContactRest> rest_;
    SelfQuery query_;
    std::optional<NeighbourProof> proof_;  // none without neighbours at rest
    StepReport costs_;
    Nodes motions_;                  // [n, 3] of the vertices in the step, metres
    std::vector<FaceBalls> balls_;   // [m] of the faces in pairs
    std::vector<char> is_measured_;  // [m] whether a face has its balls in this step
};

/// Distance at which contact of a body with itself begins: `thickness`, but no more than the mean length of
/// its surface's edges at rest, so that faces have few neighbours within it. Metres.
double self_thickness(const ContactShape& shape, double thickness);

}  // namespace nbd
