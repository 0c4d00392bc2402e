#include "sim/contact/rest_gaps.hpp"

#include <algorithm>
#include <limits>

#include "collision/geometry/closest_points.hpp"
#include "collision/neighbours/edge_paths.hpp"
#include "collision/query/self_query.hpp"
#include "sim/patches/surface_normals.hpp"

namespace nbd {
namespace {

constexpr double opposed = -0.5;  // cosine between the outward normals of two walls, at most
constexpr double connected = 3;   // times the distance, along edges: one part of the surface

/// Whether face b lies in front of face a, whose outward unit normal is n.
bool is_in_front(const TriMesh& surface, int a, const Eigen::Vector3d& n, int b) {
    const Eigen::Vector3d corner = surface.X.row(surface.F(a, 0));
    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (const int v : surface.F.row(b)) {
        const double height = n.dot(Eigen::Vector3d(surface.X.row(v)) - corner);
        least = std::min(least, height);
        most = std::max(most, height);
    }
    return least + most > 0;
}

}  // namespace

RestGaps rest_gaps(const TriMesh& surface, double distance) {
    // Around the middle, single precision knows small distances.
    const Eigen::RowVector3d middle = surface.X.colwise().mean();
    const Vertices x = (surface.X.rowwise() - middle).cast<float>();
    PosedTree tree(shared_exact_tree(x, surface.F), BoundKind::boxes);
    const VerticesRef pose = x;
    tree.begin_pose(VertexView::as_long_as(pose));
    SelfQuery query;
    const EdgeGraph graph(surface.F, surface.X.rows());
    EdgePaths paths(graph, surface.X);
    RestGaps gaps{.pairs = 0, .least = std::numeric_limits<double>::infinity()};
    int grown_from = -1;  // the face whose surroundings `around` holds
    std::vector<int> around;
    const auto corner = [&](int face, int k) { return Eigen::Vector3f(x.row(surface.F(face, k))); };
    for (const auto& [a, b] : query.within(tree, static_cast<float>(distance))) {
        const Eigen::Vector3d of_a = face_normal(surface.F, surface.X, a),
                              of_b = face_normal(surface.F, surface.X, b);
        if (of_a.dot(of_b) > opposed || !is_in_front(surface, a, of_a, b) ||
            !is_in_front(surface, b, of_b, a))
            continue;
        if (grown_from != a) {
            grown_from = a;
            around.assign({surface.F(a, 0), surface.F(a, 1), surface.F(a, 2)});
            paths.grow(around, connected * distance, around.size() + static_cast<std::size_t>(x.rows()));
            std::ranges::sort(around);
        }
        if (std::ranges::any_of(surface.F.row(b),
                                [&](int v) { return std::ranges::binary_search(around, v); }))
            continue;
        ++gaps.pairs;
        gaps.least = std::min(gaps.least, triangle_distance({corner(a, 0), corner(a, 1), corner(a, 2)},
                                                            {corner(b, 0), corner(b, 1), corner(b, 2)}));
    }
    if (gaps.pairs == 0) gaps.least = 0;
    return gaps;
}

}  // namespace nbd
