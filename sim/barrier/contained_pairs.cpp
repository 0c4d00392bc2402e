#include "sim/barrier/contained_pairs.hpp"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "meshing/parallel/parallel_for.hpp"
#include "meshing/surface/box_tree.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "sim/barrier/face_distance.hpp"
#include "sim/barrier/least_stretch.hpp"

namespace nbd {
namespace {

using RestBox = Eigen::AlignedBox3d;

BoxTree tree_over(const auto& cells, const Nodes& X) {
    std::vector<RestBox> boxes(cells.rows());
    for (std::size_t c = 0; c < boxes.size(); ++c)
        for (const int node : cells.row(c)) boxes[c].extend(X.row(node).transpose());
    return BoxTree(std::move(boxes));
}

/// The tetrahedron beside each face of each: the one opposite of corner k; -1 if there is none.
std::vector<std::array<int, 4>> joined_by_faces(const Tets& T) {
    std::vector<std::pair<std::array<int, 3>, std::pair<int, int>>> faces;
    for (int t = 0; t < T.rows(); ++t)
        for (int k = 0; k < 4; ++k) {
            std::array<int, 3> face{T(t, (k + 1) % 4), T(t, (k + 2) % 4), T(t, (k + 3) % 4)};
            std::ranges::sort(face);
            faces.push_back({face, {t, k}});
        }
    std::ranges::sort(faces);
    std::vector<std::array<int, 4>> joined(T.rows(), std::array<int, 4>{-1, -1, -1, -1});
    for (std::size_t i = 1; i < faces.size(); ++i) {
        if (faces[i].first != faces[i - 1].first) continue;
        const auto [t, k] = faces[i - 1].second;
        const auto [u, l] = faces[i].second;
        joined[t][k] = u;
        joined[u][l] = t;
    }
    return joined;
}

/// Whether a vertex moves as its place in a tetrahedron does: its weights are the shape functions there.
bool follows(const Embedding& W, int v, std::span<const int> nodes) {
    std::array<double, 10> weights{};
    double carried = 0;
    for (Embedding::InnerIterator entry(W, v); entry; ++entry) {
        const auto* const at = std::ranges::find(nodes, static_cast<int>(entry.col())).base();
        if (at == nodes.data() + nodes.size()) {
            if (entry.value() != 0) return false;
            continue;
        }
        if (entry.value() < 0) return false;
        weights[at - nodes.data()] = entry.value();
        carried += entry.value();
    }
    constexpr double rounding = 1e-9;
    if (std::abs(carried - 1) > rounding) return false;
    Eigen::Vector4d z;
    for (std::size_t a = 0; a < 4; ++a) z[a] = weights[a];
    for (std::size_t k = 0; k < 6; ++k) {
        z[edges_of_tet[k].first] += weights[4 + k] / 2;
        z[edges_of_tet[k].second] += weights[4 + k] / 2;
    }
    for (int a = 0; a < 4; ++a)
        if (std::abs(weights[a] - z[a] * z[a]) > rounding) return false;
    for (std::size_t k = 0; k < 6; ++k)
        if (std::abs(weights[4 + k] - 2 * z[edges_of_tet[k].first] * z[edges_of_tet[k].second]) > rounding)
            return false;
    return true;
}

}  // namespace

struct ContainedPairs::Search {
    const ContainedPairs& pairs;
    const Nodes& rest;
    const WideTree& tree;
    const Nodes& X;
    Faces boundary;
    BoxTree tets, boundary_faces;
    std::vector<std::array<int, 4>> joined;  // [T] tetrahedra beside the faces of each; -1: none
    std::vector<int> tet_of;                 // [n] that a vertex follows; -1: none

    Eigen::Vector3d at(int vertex) const { return rest.row(vertex); }

    /// The pair with its tetrahedra; tet = -1 if it is not contained.
    Group group(LeafPair leaves) const {
        Group result;
        std::vector<int> vertices;
        RestBox box;
        for (const int leaf : {leaves.a, leaves.b})
            for (const int v : tree.leaf_vertices(leaf)) {
                if (tet_of[v] < 0) return result;
                vertices.push_back(v);
                box.extend(at(v));
            }
        result.centre = box.center();
        for (const int v : vertices) result.radius = std::max(result.radius, (at(v) - result.centre).norm());
        bool leaves_tets = false;
        boundary_faces.overlapping(box, [&](int f) {
            const Eigen::Vector3d a = X.row(boundary(f, 0)), b = X.row(boundary(f, 1)),
                                  c = X.row(boundary(f, 2)), out = (b - a).cross(c - a);
            leaves_tets =
                leaves_tets || std::ranges::any_of(vertices, [&](int v) { return out.dot(at(v) - a) > 0; });
        });
        if (leaves_tets) return result;
        double deepest = -1e-9;
        bool is_finite = true;
        std::vector<int> met;
        tets.overlapping(box, [&](int t) {
            const Tet& tet = pairs.tets_[t];
            Eigen::Vector4d most = Eigen::Vector4d::Constant(-1);
            for (const int v : vertices) most = most.cwiseMax(tet.coordinates(at(v)));
            if (most.minCoeff() < 0) return;  // a plane lies in between
            is_finite = is_finite && most.allFinite();
            met.push_back(t);
            if (const double depth = tet.coordinates(result.centre).minCoeff(); depth > deepest) {
                deepest = depth;
                result.tet = t;
            }
        });
        if (result.tet < 0) return result;
        std::vector<int> reached{result.tet};
        for (std::size_t i = 0; i < reached.size(); ++i)
            for (const int t : joined[reached[i]])
                if (std::ranges::find(met, t) != met.end() && std::ranges::find(reached, t) == reached.end())
                    reached.push_back(t);
        const bool are_joined = std::ranges::all_of(
            vertices, [&](int v) { return std::ranges::find(reached, tet_of[v]) != reached.end(); });
        if (!are_joined || !is_finite) {
            result.tet = -1;
            return result;
        }
        reached.erase(reached.begin());
        std::ranges::sort(reached);
        result.others = std::move(reached);
        result.ratio = ratio(leaves, vertices);
        return result;
    }

    /// vertices: of both leaves, one after the other.
    double ratio(LeafPair leaves, const std::vector<int>& vertices) const {
        constexpr double least = 2;  // smaller ones prove hardly more
        const Eigen::Index count = vertices.size(), first_of_b = tree.leaf_vertices(leaves.a).size();
        Eigen::Matrix<double, 3, Eigen::Dynamic> places(3, count);
        for (Eigen::Index i = 0; i < count; ++i) places.col(i) = at(vertices[i]);
        Eigen::MatrixXd apart(first_of_b, count - first_of_b);
        for (Eigen::Index j = 0; j < apart.cols(); ++j)
            apart.col(j) =
                (places.leftCols(first_of_b).colwise() - places.col(first_of_b + j)).colwise().norm();
        struct Part {
            std::array<int, 3> face, places;
            RestBox box{};
        };
        const auto parts = [&](int leaf, Eigen::Index first) {
            std::vector<Part> all(tree.faces_in[leaf]);
            for (std::size_t k = 0; k < all.size(); ++k)
                for (std::size_t c = 0; c < 3; ++c) {
                    const int i = tree.corners[leaf][c * tree_width + k];
                    all[k].face[c] = vertices[first + i];
                    all[k].places[c] = i;
                    all[k].box.extend(places.col(first + i));
                }
            return all;
        };
        const std::vector<Part> s = parts(leaves.a, 0), t = parts(leaves.b, first_of_b);
        double most = least;
        for (std::size_t i = 0; i < s.size(); ++i)
            for (std::size_t j = leaves.a == leaves.b ? i + 1 : 0; j < t.size(); ++j) {
                double longest = 0;
                for (const int v : s[i].places)
                    for (const int w : t[j].places) longest = std::max(longest, apart(v, w));
                if (longest <= most * std::sqrt(s[i].box.squaredExteriorDistance(t[j].box))) continue;
                const double distance = face_distance(s[i].face, t[j].face, [&](int v) { return at(v); });
                most = std::max(most,
                                distance > 0 ? longest / distance : std::numeric_limits<double>::infinity());
            }
        return most;
    }
};

ContainedPairs::ContainedPairs(const ContactShape& shape, const TetMesh& mesh, const Nodes& rest,
                               const WideTree& tree, std::span<const LeafPair> near)
    : is_contained_(near.size(), 0) {
    if (near.empty() || !mesh.is_quadratic()) return;
    corner_tets_ = nbd::corner_tets(mesh);
    tets_.resize(mesh.T.rows());
    for (Eigen::Index p = 0; p < corner_tets_.rows(); ++p) {
        Eigen::Matrix3d edges;
        for (int k = 0; k < 3; ++k)
            edges.col(k) = (mesh.X.row(corner_tets_(p, k + 1)) - mesh.X.row(corner_tets_(p, 0))).transpose();
        inverse_edges_.emplace_back(edges.inverse());
    }
    for (std::size_t t = 0; t < tets_.size(); ++t) {
        Tet& tet = tets_[t];
        Eigen::Matrix4d corners;
        for (int a = 0; a < 4; ++a) corners.col(a) << mesh.X.row(mesh.T(t, a)).transpose(), 1;
        tet.centre = corners.topRows<3>().rowwise().mean();
        tet.radius = (corners.topRows<3>().colwise() - tet.centre).colwise().norm().maxCoeff();
        tet.slopes.bottomRows<3>() =
            (corners.topRightCorner<3, 3>().colwise() - corners.topLeftCorner<3, 1>()).inverse();
        tet.slopes.row(0) = -tet.slopes.bottomRows<3>().colwise().sum();
    }
    Search search{.pairs = *this,
                  .rest = rest,
                  .tree = tree,
                  .X = mesh.X,
                  .boundary = boundary_faces(mesh),
                  .tets = tree_over(mesh.T, mesh.X),
                  .boundary_faces = tree_over(boundary_faces(mesh), mesh.X),
                  .joined = joined_by_faces(mesh.T),
                  .tet_of = std::vector<int>(rest.rows(), -1)};
    const ElementNodes nodes = nodes_of_tets(mesh);
    std::vector<std::vector<int>> tets_of(mesh.X.rows());
    for (Eigen::Index t = 0; t < nodes.rows(); ++t)
        for (const int node : nodes.row(t)) tets_of[node].push_back(static_cast<int>(t));
    parallel_for(static_cast<int>(rest.rows()), [&](int v) {
        Embedding::InnerIterator heaviest(shape.W, v);
        for (Embedding::InnerIterator entry(shape.W, v); entry; ++entry)
            if (entry.value() > heaviest.value()) heaviest = entry;
        if (!heaviest) return;
        for (const int t : tets_of[heaviest.col()])
            if (follows(shape.W, v, {nodes.row(t).data(), static_cast<std::size_t>(nodes.cols())}))
                search.tet_of[v] = t;
    });
    std::vector<LeafPair> pairs(near.begin(), near.end());
    std::vector<int> order(pairs.size());
    std::iota(order.begin(), order.end(), 0);
    std::ranges::sort(order, {}, [&](int i) { return pairs[i]; });
    std::vector<Group> all(pairs.size());
    parallel_for(
        static_cast<int>(all.size()), [&](int i) { all[i] = search.group(pairs[i]); }, 16);
    for (const int i : order)
        if (all[i].tet >= 0 && std::isfinite(all[i].ratio)) {
            is_contained_[i] = 1;
            all[i].begin = static_cast<int>(pairs_.size());
            all[i].end = all[i].begin + 1;
            pairs_.push_back(pairs[i]);
            groups_[of_pair].push_back(std::move(all[i]));
        }
    gather(of_leaf, [&](int g) { return pairs_[groups_[of_pair][g].begin].a; });
    gather(of_block,
           [&](int g) { return pairs_[groups_[of_pair][groups_[of_leaf][g].begin].begin].a / tree_width; });
}

/// Makes the groups of a level from those below it. parent_of: of a group below; ascending.
void ContainedPairs::gather(Level level, const std::function<int(int)>& parent_of) {
    const std::vector<Group>& below = groups_[level - 1];
    for (int first = 0, last = 0; first < std::ssize(below); first = last) {
        while (last < std::ssize(below) && parent_of(last) == parent_of(first)) ++last;
        Group& group = groups_[level].emplace_back(Group{.begin = first, .end = last});
        RestBox box;
        for (int g = first; g < last; ++g) {
            box.extend(below[g].centre);
            group.ratio = std::max(group.ratio, below[g].ratio);
            group.others.push_back(below[g].tet);
            group.others.insert(group.others.end(), below[g].others.begin(), below[g].others.end());
        }
        group.centre = box.center();
        for (int g = first; g < last; ++g)
            group.radius = std::max(group.radius, (below[g].centre - group.centre).norm() + below[g].radius);
        std::ranges::sort(group.others);
        group.others.erase(std::unique(group.others.begin(), group.others.end()), group.others.end());
        group.tet = *std::ranges::max_element(
            group.others, {}, [&](int t) { return tets_[t].coordinates(group.centre).minCoeff(); });
        std::erase(group.others, group.tet);
    }
}

ContainedPairs::Field ContainedPairs::field(int t, const Nodes& x) const {
    const auto gradient = [&](int p) -> Eigen::Matrix3d {
        Eigen::Matrix3d edges;
        for (int k = 0; k < 3; ++k)
            edges.col(k) = (x.row(corner_tets_(p, k + 1)) - x.row(corner_tets_(p, 0))).transpose();
        return edges * inverse_edges_[p];
    };
    Field field;
    field.slopes.fill(Eigen::Matrix3d::Zero());
    field.at_centre.setZero();
    for (int a = 0; a < 4; ++a) {
        const Eigen::Matrix3d F = gradient(4 * t + a);
        field.at_centre += F / 4;
        for (int k = 0; k < 3; ++k) field.slopes[k] += tets_[t].slopes(a, k) * F;
    }
    double squares = 0;
    for (const Eigen::Matrix3d& slope : field.slopes) squares += slope.squaredNorm();
    field.steepness = std::sqrt(squares);
    return field;
}

/// Gradients change evenly in the motion, so that differences are the largest at its ends.
bool ContainedPairs::is_proved(const Group& group, std::span<const Field> begin, std::span<const Field> end,
                               double share) const {
    const auto gradient = [&](std::span<const Field> fields, int t) {
        return fields[t].at(group.centre - tets_[t].centre);
    };
    const auto is_finite = [&](int t) {
        return begin[t].at_centre.allFinite() && end[t].at_centre.allFinite() &&
               std::isfinite(begin[t].steepness + end[t].steepness);
    };
    if (!is_finite(group.tet) || !std::ranges::all_of(group.others, is_finite)) return false;
    const Eigen::Matrix3d at_begin = gradient(begin, group.tet), at_end = gradient(end, group.tet);
    double difference = group.radius * std::max(begin[group.tet].steepness, end[group.tet].steepness);
    for (const int t : group.others)
        difference =
            std::max({difference, (gradient(begin, t) - at_begin).norm() + group.radius * begin[t].steepness,
                      (gradient(end, t) - at_end).norm() + group.radius * end[t].steepness});
    return least_stretch(at_begin, at_end) - group.ratio * difference >= share;
}

void ContainedPairs::prove(const Nodes& begin, const Nodes& end, double share,
                           std::vector<LeafPair>& open) const {
    if (pairs_.empty()) return;
    const int count = tets_.size();
    std::vector<Field> at_begin(count), at_end(count);
    parallel_for(
        count, [&](int t) { at_begin[t] = field(t, begin), at_end[t] = field(t, end); }, 64);
    const std::vector<Group>& blocks = groups_[of_block];
    std::vector<std::vector<LeafPair>> found(blocks.size());
    parallel_for(
        static_cast<int>(blocks.size()),
        [&](int b) {
            if (is_proved(blocks[b], at_begin, at_end, share)) return;
            for (int l = blocks[b].begin; l < blocks[b].end; ++l) {
                const Group& leaf = groups_[of_leaf][l];
                if (is_proved(leaf, at_begin, at_end, share)) continue;
                for (int p = leaf.begin; p < leaf.end; ++p)
                    if (!is_proved(groups_[of_pair][p], at_begin, at_end, share))
                        found[b].push_back(pairs_[p]);
            }
        },
        4);
    for (const auto& pairs : found) open.insert(open.end(), pairs.begin(), pairs.end());
}

}  // namespace nbd
