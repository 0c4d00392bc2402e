#include "sim/barrier/host_neighbours.hpp"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "meshing/parallel/parallel_for.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "sim/barrier/face_distance.hpp"

namespace nbd {
namespace {

void sort_uniquely(std::vector<int>& numbers) {
    std::ranges::sort(numbers);
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
}

std::vector<LeafPair> in_order(std::span<const LeafPair> pairs) {
    std::vector<LeafPair> result;
    for (const LeafPair& pair : pairs)
        if (pair.a <= pair.b) result.push_back(pair);
    return result;
}

std::size_t place_of(const std::vector<int>& ascending, int number) {
    return std::ranges::lower_bound(ascending, number) - ascending.begin();
}

double ratio(double longest, double distance) noexcept {
    return distance > 0 ? longest / distance : HostNeighbours::unknown;
}

}  // namespace

HostNeighbours::HostNeighbours(std::shared_ptr<const ContactShape> shape, const TetMesh& tets, Nodes rest,
                               const WideTree& tree, std::span<const LeafPair> near_leaves)
    : shape_(std::move(shape)),
      nodes_(tets.X),
      rest_(std::move(rest)),
      contained_(*shape_, tets, rest_, tree, in_order(near_leaves)) {
    find_hosts(tets);
    const std::vector<LeafPair> pairs = in_order(near_leaves);
    known_leaves_ = LeafPairSet(tree.blocks(), pairs);
    leaf_of_.resize(shape_->F.rows());
    for (int leaf = 0; leaf < tree.leaves(); ++leaf) {
        for (int k = 0; k < tree.faces_in[leaf]; ++k) {
            const int f = tree.faces[tree_width * leaf + k];
            leaf_of_[f] = leaf;
            faces_of_leaf_.items.push_back(f);
        }
        faces_of_leaf_.end_list();
    }
    std::vector<LeafPair> contained, others;
    for (std::size_t i = 0; i < pairs.size(); ++i)
        (contained_.is_contained()[i] ? contained : others).push_back(pairs[i]);
    std::ranges::sort(contained);
    const std::size_t of_leaves = others.size();
    std::vector<Measured> all(of_leaves + shape_->F.rows());
    parallel_for(
        all.size(),
        [&](int k) {
            const std::size_t i = k;
            all[i] = i < of_leaves ? measured(tree, others[i])
                                   : measured(static_cast<int>(i - of_leaves), contained);
        },
        16);
    add(std::move(all));
}

void HostNeighbours::add_neighbours(LeafPair leaves, std::vector<FacePair>& pairs) const {
    const auto neighbours_of = [&](int f) {
        std::vector<int> others;
        for (const int v : face(f))
            for (int i = shape_->topology.vertex_begin[v]; i < shape_->topology.vertex_begin[v + 1]; ++i)
                others.push_back(shape_->topology.vertex_faces[i]);
        sort_uniquely(others);
        return others;
    };
    for (const int f : faces_of_leaf_[leaves.a])
        for (const int g : neighbours_of(f))
            if (leaf_of_[g] == leaves.b && (leaves.a != leaves.b || f < g))
                pairs.push_back({std::min(f, g), std::max(f, g)});
}

void HostNeighbours::find_hosts(const TetMesh& tets) {
    const Embedding& W = shape_->W;
    const Tets T = corner_tets(tets);
    std::vector<std::vector<int>> tets_of(tets.X.rows());  // of each node
    for (int t = 0; t < T.rows(); ++t)
        for (const int node : T.row(t)) tets_of[node].push_back(t);
    std::vector<int> host_of_tet(T.rows(), none);
    const auto host_in = [&](int t) {
        if (host_of_tet[t] != none) return host_of_tet[t];
        std::array<int, 4> nodes;
        std::ranges::copy(T.row(t), nodes.begin());
        std::ranges::sort(nodes);
        Eigen::Matrix3d edges;
        for (int k = 0; k < 3; ++k)
            edges.col(k) = (tets.X.row(nodes[k + 1]) - tets.X.row(nodes[0])).transpose();
        Eigen::Vector3d centre = Eigen::Vector3d::Zero();
        for (const int node : nodes) centre += tets.X.row(node).transpose() / 4;
        hosts_.push_back({nodes, edges.inverse(), centre});
        return host_of_tet[t] = static_cast<int>(hosts_.size()) - 1;
    };
    host_of_.assign(W.rows(), none);
    is_carried_.assign(W.rows(), 0);
    for (int v = 0; v < W.rows(); ++v) {
        double heaviest = 0;
        int node = -1, count = 0;
        for (Embedding::InnerIterator entry(W, v); entry; ++entry) {
            count += entry.value() != 0;
            if (!(std::abs(entry.value()) > heaviest)) continue;
            heaviest = std::abs(entry.value());
            node = entry.col();
        }
        if (node < 0) continue;
        // Of the tetrahedra of the heaviest node, the first with most of the weights.
        int best = -1, most_nodes = 0;
        double most = 0;
        for (const int t : tets_of[node]) {
            double carried = 0;
            int nodes = 0;
            for (Embedding::InnerIterator entry(W, v); entry; ++entry)
                if (entry.value() != 0 && (T.row(t).array() == entry.col()).any()) {
                    carried += std::abs(entry.value());
                    ++nodes;
                }
            if (carried > most) {
                most = carried;
                most_nodes = nodes;
                best = t;
            }
        }
        if (best < 0) continue;
        host_of_[v] = host_in(best);
        is_carried_[v] = most_nodes == count;
    }
}

bool HostNeighbours::hang_on_one_host(FacePair faces) const noexcept {
    const int host = host_of_[shape_->F(faces.a, 0)];
    for (const int f : {faces.a, faces.b})
        for (const int v : face(f))
            if (host_of_[v] != host || !is_carried_[v]) return false;
    return true;
}

HostNeighbours::Spread::Spread(const HostNeighbours& rest, std::vector<int> vertices) {
    std::vector<int> candidates, nodes;
    const Embedding& W = rest.shape_->W;
    for (const int v : vertices) {
        candidates.push_back(rest.host_of_[v]);
        for (Embedding::InnerIterator entry(W, v); entry; ++entry)
            if (entry.value() != 0) nodes.push_back(entry.col());
    }
    sort_uniquely(candidates);
    sort_uniquely(nodes);
    if (candidates.front() == none) return;
    weights_.setZero(nodes.size(), vertices.size());
    for (std::size_t i = 0; i < vertices.size(); ++i)
        for (Embedding::InnerIterator entry(W, vertices[i]); entry; ++entry)
            if (entry.value() != 0) weights_(place_of(nodes, entry.col()), i) = entry.value();
    // The host with which the vertices are measured shortest.
    const Eigen::VectorXd mean = weights_.rowwise().mean();
    const Eigen::MatrixXd apart = (weights_.colwise() - mean).cwiseAbs();
    double least = unknown;
    Eigen::RowVectorXd distances(nodes.size()), best;
    for (const int h : candidates) {
        const Host& host = rest.hosts_[h];
        for (std::size_t k = 0; k < nodes.size(); ++k)
            distances[k] = std::ranges::binary_search(host.nodes, nodes[k])
                               ? 0
                               : (rest.nodes_.row(nodes[k]).transpose() - host.centre).norm();
        const double farthest = (distances * apart).maxCoeff();
        if (!(farthest < least)) continue;
        least = farthest;
        host_ = h;
        best = distances;
    }
    if (host_ == none) return;
    Eigen::Index kept = 0;
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        if (best[k] == 0) continue;
        others_.push_back(nodes[k]);
        weights_.row(kept++) = best[k] * weights_.row(k);
    }
    weights_.conservativeResize(kept, Eigen::NoChange);
    middle_ = weights_.rowwise().mean();
}

double HostNeighbours::distance(const Face& a, const Face& b) const {
    return face_distance(a, b, [&](int v) { return at(v); });
}

/// At most the distance of two faces: the gap between them along the line through their middles; 0 where
/// these coincide.
double HostNeighbours::gap_between_middles(const Face& a, const Face& b) const {
    const Eigen::Vector3d way = at(b[0]) + at(b[1]) + at(b[2]) - at(a[0]) - at(a[1]) - at(a[2]);
    const double end_of_a = std::max({way.dot(at(a[0])), way.dot(at(a[1])), way.dot(at(a[2]))}),
                 begin_of_b = std::min({way.dot(at(b[0])), way.dot(at(b[1])), way.dot(at(b[2]))});
    return way.isZero(0) ? 0 : (begin_of_b - end_of_a) / way.norm();
}

/// contained: pairs of leaves whose faces are left out, ascending.
HostNeighbours::Measured HostNeighbours::measured(int f, const std::vector<LeafPair>& contained) const {
    const std::vector<int>&begin = shape_->topology.vertex_begin, &of_vertex = shape_->topology.vertex_faces;
    const Face a = face(f);
    std::vector<int> others;
    for (const int v : a)
        for (int i = begin[v]; i < begin[v + 1]; ++i)
            if (const int g = of_vertex[i]; g > f && !hang_on_one_host({f, g})) {
                const auto [low, high] = std::minmax({leaf_of_[f], leaf_of_[g]});
                if (!std::ranges::binary_search(contained, LeafPair{low, high})) others.push_back(g);
            }
    sort_uniquely(others);
    Measured result;
    if (others.empty()) return result;
    std::vector<int> vertices(a.begin(), a.end());
    for (const int g : others)
        for (const int v : face(g)) vertices.push_back(v);
    sort_uniquely(vertices);
    const Spread spread(*this, vertices);
    result.host = spread.host();
    result.group.others = spread.others();
    for (const int g : others) {
        const Face b = face(g);
        double longest = spread.host() == none ? unknown : 0;
        for (const int v : a)
            for (const int w : b)
                if (longest < unknown)
                    longest = std::max(longest, spread.between(place_of(vertices, v), place_of(vertices, w)));
        result.group.faces.push_back({{f, g}, ratio(longest, distance(a, b))});
    }
    return result;
}

HostNeighbours::Measured HostNeighbours::measured(const WideTree& tree, LeafPair pair) const {
    Measured result;
    result.group.leaves = pair;
    std::vector<int> vertices;
    for (const int leaf : {pair.a, pair.b})
        for (const int v : tree.leaf_vertices(leaf)) vertices.push_back(v);
    const Spread spread(*this, vertices);
    result.host = spread.host();
    if (spread.host() == none) return result;
    result.group.others = spread.others();
    if (spread.others().empty()) return result;
    struct Part {
        Face face;
        std::array<std::size_t, 3> places;
        double from_middle = 0;
        Eigen::AlignedBox3d box{};  // at rest
    };
    std::vector<double> from_middle(vertices.size());
    for (std::size_t i = 0; i < vertices.size(); ++i) from_middle[i] = spread.from_middle(i);
    const auto parts = [&](int leaf, std::size_t first) {
        std::vector<Part> all(tree.faces_in[leaf]);
        for (std::size_t k = 0; k < all.size(); ++k)
            for (std::size_t c = 0; c < 3; ++c) {
                const std::size_t i = first + tree.corners[leaf][c * tree_width + k];
                all[k].face[c] = vertices[i];
                all[k].places[c] = i;
                all[k].from_middle = std::max(all[k].from_middle, from_middle[i]);
                all[k].box.extend(at(vertices[i]));
            }
        return all;
    };
    const std::vector<Part> s = parts(pair.a, 0), t = parts(pair.b, tree.leaf_vertices(pair.a).size());
    for (std::size_t i = 0; i < s.size(); ++i)
        for (std::size_t j = pair.a == pair.b ? i + 1 : 0; j < t.size(); ++j) {
            const Face &a = s[i].face, &b = t[j].face;
            // Along an axis: less than their distance.
            const double apart =
                common_ratio *
                (s[i].box.min() - t[j].box.max()).cwiseMax(t[j].box.min() - s[i].box.max()).maxCoeff();
            if (s[i].from_middle + t[j].from_middle <= apart ||
                std::ranges::any_of(a, [&](int v) { return v == b[0] || v == b[1] || v == b[2]; }))
                continue;
            double longest = 0;
            for (const std::size_t v : s[i].places)
                for (const std::size_t w : t[j].places) longest = std::max(longest, spread.between(v, w));
            if (longest <= std::max({0.0, apart, common_ratio * gap_between_middles(a, b)})) continue;
            const FacePair faces{tree.faces[tree_width * pair.a + i], tree.faces[tree_width * pair.b + j]};
            if (const double r = ratio(longest, distance(a, b)); r > common_ratio)
                result.group.faces.push_back({faces, r});
        }
    return result;
}

/// Sorts them, and lists the nodes of their hosts.
void HostNeighbours::add(std::vector<Measured> all) {
    std::erase_if(all, [](const Measured& m) { return !m.group.leaves && m.group.faces.empty(); });
    const int last = hosts_.size();
    for (auto& [host, group] : all) {
        std::ranges::sort(group.faces, [](const NearFaces& x, const NearFaces& y) {
            return x.ratio != y.ratio ? x.ratio > y.ratio : x.faces < y.faces;
        });
        if (host == none)
            host = last;
        else
            group.ratio = std::max(group.leaves ? common_ratio : 0,
                                   group.faces.empty() ? 0 : group.faces.front().ratio);
    }
    std::ranges::stable_sort(all, [](const Measured& x, const Measured& y) {
        return x.host != y.host ? x.host < y.host : x.group.ratio > y.group.ratio;
    });
    begin_.assign(last + 2, 0);
    for (auto& [host, group] : all) {
        ++begin_[host + 1];
        groups_.push_back(std::move(group));
    }
    for (int h = 0; h <= last; ++h) begin_[h + 1] += begin_[h];
    for (int h = 0; h < last; ++h) {
        Host& host = hosts_[h];
        const std::span groups_of_h(groups_.data() + begin_[h], begin_[h + 1] - begin_[h]);
        for (const Group& group : groups_of_h)
            host.others.insert(host.others.end(), group.others.begin(), group.others.end());
        sort_uniquely(host.others);
        for (const int node : host.others)
            host.distances.push_back((nodes_.row(node).transpose() - host.centre).norm());
        for (Group& group : groups_of_h)
            for (int& other : group.others) other = static_cast<int>(place_of(host.others, other));
    }
}

}  // namespace nbd
