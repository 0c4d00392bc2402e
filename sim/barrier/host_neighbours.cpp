#include "sim/barrier/host_neighbours.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "collision/continuous/feature_pair.hpp"
#include "meshing/parallel/parallel_for.hpp"

namespace nbd {

HostNeighbours::Hull::Hull(const Host& a, const Host& b, const Nodes& X) {
    std::vector<int> nodes;
    std::ranges::set_intersection(a.nodes, b.nodes, std::back_inserter(nodes));
    origin_ = X.row(nodes.front());
    for (const int node : std::span(nodes).subspan(1)) {
        Eigen::Vector3d along = X.row(node).transpose() - origin_;
        for (int k = 0; k < dimension_; ++k) along -= axes_.col(k).dot(along) * axes_.col(k);
        axes_.col(dimension_++) = along.normalized();
    }
}

HostNeighbours::Hull::Place HostNeighbours::Hull::place(const Eigen::Vector3d& x) const {
    Eigen::Vector3d along = Eigen::Vector3d::Zero(), left = x - origin_;
    for (int k = 0; k < dimension_; ++k) {
        along[k] = axes_.col(k).dot(left);
        left -= along[k] * axes_.col(k);
    }
    return {along, left.norm()};
}

Eigen::Vector3d HostNeighbours::Hull::nearest(const Eigen::Vector3d& x) const {
    return origin_ + axes_ * place(x).along;
}

double HostNeighbours::Hull::way(const Eigen::Vector3d& x, const Eigen::Vector3d& y) const {
    const Place from = place(x), to = place(y);
    const double off = from.off + to.off;
    return std::sqrt((from.along - to.along).squaredNorm() + off * off);
}

HostNeighbours::HostNeighbours(std::shared_ptr<const ContactShape> shape, const TetMesh& tets, Nodes rest,
                               const WideTree& tree, std::span<const LeafPair> near_leaves)
    : shape_(std::move(shape)), rest_(std::move(rest)) {
    find_hosts(tets);
    find_touching(tets.X);
    find_faces();
    std::vector<LeafPair> pairs;
    for (const LeafPair& pair : near_leaves)
        if (pair.a <= pair.b) pairs.push_back(pair);
    std::vector<Measured> all(pairs.size());
    parallel_for(
        pairs.size(), [&](int i) { all[i] = measured(tree, pairs[i]); }, 16);
    const int last = hosts_.size();
    for (Measured& m : all)
        if (m.host == none) m.host = last;
    std::ranges::sort(all, [](const Measured& x, const Measured& y) {
        if (x.host != y.host) return x.host < y.host;
        if (x.near.ratio != y.near.ratio) return x.near.ratio > y.near.ratio;
        return x.near.leaves < y.near.leaves;
    });
    leaves_begin_.assign(last + 2, 0);
    for (Measured& m : all) {
        ++leaves_begin_[m.host + 1];
        leaves_.push_back(std::move(m.near));
    }
    for (int h = 0; h <= last; ++h) leaves_begin_[h + 1] += leaves_begin_[h];
    known_leaves_ = LeafPairSet(tree.blocks(), pairs);
    find_related();
}

void HostNeighbours::find_hosts(const TetMesh& tets) {
    const Embedding& W = shape_->W;
    std::vector<std::vector<int>> tets_of(tets.X.rows());  // of each node
    for (int t = 0; t < tets.T.rows(); ++t)
        for (const int node : tets.T.row(t)) tets_of[node].push_back(t);
    const auto sorted_nodes = [&](int t) {
        std::array<int, 4> nodes;
        std::ranges::copy(tets.T.row(t), nodes.begin());
        std::ranges::sort(nodes);
        return nodes;
    };
    std::vector<int> host_of_tet(tets.T.rows(), none);
    const auto host_in = [&](int t, const std::array<int, 4>& nodes) {
        if (host_of_tet[t] != none) return host_of_tet[t];
        Eigen::Matrix3d edges;
        for (int k = 0; k < 3; ++k)
            edges.col(k) = (tets.X.row(nodes[k + 1]) - tets.X.row(nodes[0])).transpose();
        Eigen::Vector3d centre = Eigen::Vector3d::Zero();
        for (const int node : nodes) centre += tets.X.row(node).transpose() / 4;
        hosts_.push_back({nodes, edges.inverse(), centre, {}, {}});
        return host_of_tet[t] = static_cast<int>(hosts_.size()) - 1;
    };
    host_of_.assign(W.rows(), none);
    std::vector<int> nodes;
    for (int v = 0; v < W.rows(); ++v) {
        nodes.clear();
        for (Embedding::InnerIterator entry(W, v); entry; ++entry)
            if (entry.value() != 0) nodes.push_back(entry.col());
        if (nodes.empty()) continue;
        // A vertex on a face, an edge or a node takes the first of their tetrahedra.
        for (const int t : tets_of[nodes.front()])
            if (const auto of_tet = sorted_nodes(t); std::ranges::includes(of_tet, nodes)) {
                host_of_[v] = host_in(t, of_tet);
                break;
            }
    }
}

void HostNeighbours::find_touching(const Nodes& X) {
    std::vector<std::vector<int>> of_node(X.rows());
    for (int h = 0; h < std::ssize(hosts_); ++h)
        for (const int node : hosts_[h].nodes) of_node[node].push_back(h);
    for (int h = 0; h < std::ssize(hosts_); ++h) {
        std::vector<int>& touching = hosts_[h].touching;
        for (const int node : hosts_[h].nodes)
            touching.insert(touching.end(), of_node[node].begin(), of_node[node].end());
        std::ranges::sort(touching);
        const auto repeats = std::ranges::unique(touching);
        touching.erase(repeats.begin(), repeats.end());
        std::erase(touching, h);
        hulls_begin_.push_back(hulls_.size());
        for (const int other : touching) hulls_.emplace_back(hosts_[h], hosts_[other], X);
    }
}

bool HostNeighbours::touch(int host_a, int host_b) const noexcept {
    if (host_a == none || host_b == none) return false;
    return host_a == host_b || std::ranges::binary_search(hosts_[host_a].touching, host_b);
}

/// Of hosts that touch.
const HostNeighbours::Hull& HostNeighbours::hull(int host_a, int host_b) const {
    const std::vector<int>& touching = hosts_[host_a].touching;
    return hulls_[hulls_begin_[host_a] + (std::ranges::lower_bound(touching, host_b) - touching.begin())];
}

/// Of the hosts that touch both of two that do not touch, the one nearest to their middle; `none`: no host
/// does.
int HostNeighbours::host_between(int a, int b) const {
    const Eigen::Vector3d middle = (hosts_[a].centre + hosts_[b].centre) / 2;
    double least = unknown;
    int best = none;
    for (const int host : hosts_[a].touching)
        if (const double off = (hosts_[host].centre - middle).squaredNorm(); off < least && touch(host, b)) {
            least = off;
            best = host;
        }
    return best;
}

/// How far a vertex is from what its host and another one have in common.
double HostNeighbours::way_to(int vertex, int host) const {
    const int own = host_of_[vertex];
    if (own == host) return 0;
    return touch(own, host) ? hull(own, host).distance(at(vertex)) : unknown;
}

/// Of the ways from v to w over hosts that touch `host`, a short one.
double HostNeighbours::way(int v, int w, int host) const {
    const int a = host_of_[v], b = host_of_[w];
    if (a == b) return a == host ? 0 : (at(v) - at(w)).norm();
    const double by_host = way_to(v, host) + way_to(w, host);
    return touch(a, b) ? std::min(by_host, hull(a, b).way(at(v), at(w))) : by_host;
}

double HostNeighbours::way(const Face& a, const Face& b, int host) const {
    double longest = 0;
    for (const int v : a)
        for (const int w : b)
            if (v != w) longest = std::max(longest, way(v, w, host));
    return longest;
}

double HostNeighbours::distance(const Face& a, const Face& b) const {
    double least = unknown;
    const auto vertices = [&](const Face& s, const Face& t) {
        for (const int v : s)
            if (v != t[0] && v != t[1] && v != t[2])
                least = std::min(least, closest_point_triangle(at(v), at(t[0]), at(t[1]), at(t[2])).distance);
    };
    vertices(a, b);
    vertices(b, a);
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) {
            const std::array<int, 4> e{a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3]};
            if (e[0] == e[2] || e[0] == e[3] || e[1] == e[2] || e[1] == e[3]) continue;
            least = std::min(least, closest_edge_edge(at(e[0]), at(e[1]), at(e[2]), at(e[3])).distance);
        }
    return least;
}

/// Along an axis, or from one's middle to the other's.
double HostNeighbours::least_distance(const Face& a, const Face& b) const {
    const std::array x{at(a[0]), at(a[1]), at(a[2])}, y{at(b[0]), at(b[1]), at(b[2])};
    const Eigen::Vector3d way = y[0] + y[1] + y[2] - x[0] - x[1] - x[2];
    const auto gap = [&](const auto& height) {
        const auto [least_x, most_x] = std::minmax({height(x[0]), height(x[1]), height(x[2])});
        const auto [least_y, most_y] = std::minmax({height(y[0]), height(y[1]), height(y[2])});
        return std::max(least_y - most_x, least_x - most_y);
    };
    double most = std::max(gap([&](const Eigen::Vector3d& p) { return way.dot(p); }) / way.norm(), 0.0);
    for (int k = 0; k < 3; ++k) most = std::max(most, gap([&](const Eigen::Vector3d& p) { return p[k]; }));
    return most;
}

void HostNeighbours::find_faces() {
    struct Found {
        int host;
        NearFaces near;
    };
    const int count = shape_->F.rows(), last = hosts_.size();
    const std::vector<int>&begin = shape_->topology.vertex_begin, &of_vertex = shape_->topology.vertex_faces;
    std::vector<std::vector<Found>> found(count);
    parallel_for(
        count,
        [&](int f) {
            const Face a = face(f);
            std::vector<int> others;
            for (const int v : a)
                for (int i = begin[v]; i < begin[v + 1]; ++i)
                    if (of_vertex[i] > f) others.push_back(of_vertex[i]);
            std::ranges::sort(others);
            const auto repeats = std::ranges::unique(others);
            others.erase(repeats.begin(), repeats.end());
            for (const int g : others) {
                const Face b = face(g);
                const HostsOfFaces hosts(*this, a, b);
                if (hosts.size() == 1 && *hosts.begin() != none) continue;
                Found best{last, {{f, g}, unknown}};
                for (const int host : hosts) {
                    if (!hosts.all_touch(*this, host)) continue;
                    if (const double longest = way(a, b, host); longest < best.near.ratio)
                        best = {host, {{f, g}, longest}};
                }
                if (best.host != last) best.near.ratio /= distance(a, b);
                found[f].push_back(best);
            }
        },
        64);
    std::vector<Found> all;
    for (const std::vector<Found>& some : found) all.insert(all.end(), some.begin(), some.end());
    std::ranges::sort(all, [](const Found& x, const Found& y) {
        if (x.host != y.host) return x.host < y.host;
        if (x.near.ratio != y.near.ratio) return x.near.ratio > y.near.ratio;
        return x.near.faces < y.near.faces;
    });
    faces_begin_.assign(last + 2, 0);
    for (const Found& f : all) {
        ++faces_begin_[f.host + 1];
        near_faces_.push_back(f.near);
    }
    for (int h = 0; h <= last; ++h) faces_begin_[h + 1] += faces_begin_[h];
}

void HostNeighbours::find_related() {
    for (int h = 0; h < std::ssize(hosts_); ++h) {
        std::vector<int>& related = hosts_[h].related;
        for (const NearLeaves& near : near_leaves(h))
            related.insert(related.end(), near.others.begin(), near.others.end());
        for (const NearFaces& near : near_faces(h)) {
            const HostsOfFaces of(*this, face(near.faces.a), face(near.faces.b));
            related.insert(related.end(), of.begin(), of.end());
        }
        std::ranges::sort(related);
        const auto repeats = std::ranges::unique(related);
        related.erase(repeats.begin(), repeats.end());
        std::erase(related, h);
    }
}

HostNeighbours::Measured HostNeighbours::measured(const WideTree& tree, LeafPair pair) const {
    Measured result{none, {pair, unknown}};
    std::vector<int> vertices, candidates;
    for (const int leaf : {pair.a, pair.b})
        for (const int v : tree.leaf_vertices(leaf)) {
            vertices.push_back(v);
            if (std::ranges::find(candidates, host_of_[v]) == candidates.end())
                candidates.push_back(host_of_[v]);
        }
    if (std::ranges::find(candidates, none) != candidates.end()) return result;
    // The host from which no vertex is far.
    std::vector<double> ways(vertices.size()), best;
    double least = unknown;
    for (const int host : candidates) {
        double farthest = 0;
        for (std::size_t i = 0; i < vertices.size() && farthest < least; ++i)
            farthest = std::max(farthest, ways[i] = way_to(vertices[i], host));
        if (!(farthest < least)) continue;
        least = farthest;
        result.host = host;
        best = ways;
    }
    if (result.host == none) {
        // No host touches all others: one in their middle reaches them by hosts between.
        Eigen::Vector3d middle = Eigen::Vector3d::Zero();
        for (const int v : vertices) middle += at(v) / static_cast<double>(vertices.size());
        const int host = *std::ranges::min_element(
            candidates, {}, [&](int h) { return (hosts_[h].centre - middle).squaredNorm(); });
        std::vector<int> between;  // of the candidates
        for (const int other : candidates) {
            between.push_back(touch(host, other) ? host : host_between(other, host));
            if (between.back() == none) return result;
        }
        for (std::size_t i = 0; i < vertices.size(); ++i) {
            const int own = host_of_[vertices[i]];
            const int by = between[std::ranges::find(candidates, own) - candidates.begin()];
            if (by == host) {
                ways[i] = way_to(vertices[i], host);
                continue;
            }
            const Eigen::Vector3d x = at(vertices[i]), on_hull = hull(own, by).nearest(x);
            ways[i] = (x - on_hull).norm() + hull(by, host).distance(on_hull);
        }
        for (const int by : between)
            if (std::ranges::find(candidates, by) == candidates.end()) candidates.push_back(by);
        result.host = host;
        best = ways;
    }
    std::erase(candidates, result.host);
    result.near.others = candidates;
    result.near.ratio = common_ratio;
    if (candidates.empty()) return result;
    // D of a pair of vertices, by their places.
    const auto way_between = [&](std::size_t i, std::size_t j) {
        const int v = vertices[i], w = vertices[j], of_v = host_of_[v], of_w = host_of_[w];
        if (of_v == of_w) return of_v == result.host ? 0 : (at(v) - at(w)).norm();
        const double by_host = best[i] + best[j];
        return touch(of_v, of_w) ? std::min(by_host, hull(of_v, of_w).way(at(v), at(w))) : by_host;
    };
    struct Part {
        Face face;
        std::array<std::size_t, 3> places;
        double way = 0;
    };
    const auto parts = [&](int leaf, std::size_t first) {
        std::vector<Part> all(tree.faces_in[leaf]);
        for (std::size_t k = 0; k < all.size(); ++k)
            for (std::size_t c = 0; c < 3; ++c) {
                const std::size_t i = first + tree.corners[leaf][c * tree_width + k];
                all[k].face[c] = vertices[i];
                all[k].places[c] = i;
                all[k].way = std::max(all[k].way, best[i]);
            }
        return all;
    };
    const std::vector<Part> s = parts(pair.a, 0), t = parts(pair.b, tree.leaf_vertices(pair.a).size());
    for (std::size_t i = 0; i < s.size(); ++i)
        for (std::size_t j = pair.a == pair.b ? i + 1 : 0; j < t.size(); ++j) {
            const Face &a = s[i].face, &b = t[j].face;
            const double apart = common_ratio * least_distance(a, b);
            if (s[i].way + t[j].way <= apart ||
                std::ranges::any_of(a, [&](int v) { return v == b[0] || v == b[1] || v == b[2]; }))
                continue;
            double longest = 0;
            for (const std::size_t v : s[i].places)
                for (const std::size_t w : t[j].places) longest = std::max(longest, way_between(v, w));
            if (!(longest > apart)) continue;
            const FacePair faces{tree.faces[tree_width * pair.a + i], tree.faces[tree_width * pair.b + j]};
            if (const double ratio = longest / distance(a, b); !(ratio <= common_ratio))
                result.near.faces.push_back({faces, ratio});
        }
    std::ranges::sort(result.near.faces, [](const NearFaces& x, const NearFaces& y) {
        return x.ratio != y.ratio ? x.ratio > y.ratio : x.faces < y.faces;
    });
    if (!result.near.faces.empty()) result.near.ratio = result.near.faces.front().ratio;
    return result;
}

}  // namespace nbd
