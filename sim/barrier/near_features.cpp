#include "sim/barrier/near_features.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "collision/base/stopwatch.hpp"
#include "meshing/parallel/parallel_for.hpp"
#include "sim/barrier/feature_boxes.hpp"

namespace nbd {
namespace {

/// Room beyond the reach, as a multiple of it: a larger one makes more candidates, a smaller one more
/// queries.
constexpr double room_share = 2;

double longest_row(const Nodes& x) { return x.rowwise().norm().maxCoeff(); }

/// The faces of one surface that own the features of a pair.
Intersection owners(const FeaturePair& pair, const SurfaceTopology& topology) {
    const bool is_edges = pair.kind == FeatureKind::edge_edge;
    const int a = is_edges ? topology.owner_of_edge(pair.a) : topology.owner_of_vertex(pair.a),
              b = is_edges ? topology.owner_of_edge(pair.b) : pair.b;
    return {pair.surface_a, pair.surface_a, std::min(a, b), std::max(a, b)};
}

}  // namespace

/// Features of two faces in a motion; if both are of one surface, relative to its mean motion.
class NearFeatureSearch::MovingFaces {
 public:
    MovingFaces(const MovingSurface& s, const MovingSurface& t, FacePair faces) : is_one_(&s == &t) {
        const Eigen::Vector3d frame = is_one_ ? s.mean_motion() : Eigen::Vector3d::Zero();
        for (std::size_t k = 0; k < 6; ++k) {
            const MovingSurface& surface = k < 3 ? s : t;
            const int v = k < 3 ? s.F()(faces.a, k) : t.F()(faces.b, k - 3);
            vertices_[k] = v;
            rest_[k] = surface.rest().row(v);
            begin_[k] = surface.begin(v);
            end_[k] = surface.end(v).transpose() - frame;
            low_[k] = begin_[k].cwiseMin(end_[k]);
            high_[k] = begin_[k].cwiseMax(end_[k]);
        }
    }
    /// Whether the two faces stay farther apart.
    bool are_beyond(double distance) const {
        const auto ball = [&](std::size_t first) {
            const Eigen::Vector3d centre = (begin_[first] + begin_[first + 1] + begin_[first + 2]) / 3;
            double squared = 0;
            for (std::size_t k = first; k < first + 3; ++k)
                squared = std::max(squared, (begin_[k] - centre).squaredNorm());
            return std::pair(centre, std::sqrt(squared));
        };
        const auto [centre_a, radius_a] = ball(0);
        const auto [centre_b, radius_b] = ball(3);
        double most = 0;  // by which corners of the two approach each other
        for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t l = 3; l < 6; ++l)
                most = std::max(most, (end_[k] - begin_[k] - end_[l] + begin_[l]).squaredNorm());
        return (centre_a - centre_b).norm() - radius_a - radius_b - std::sqrt(most) > distance;
    }
    /// By how much the boxes of two features over the motion are apart.
    double apart(FeatureKind kind, const PlacesInFaces& places) const {
        PairBoxes boxes(kind);
        for (std::size_t k = 0; k < 4; ++k) {
            boxes.add(k, low_[places[k]].array());
            boxes.add(k, high_[places[k]].array());
        }
        return boxes.gaps().maxCoeff();
    }
    /// Less than the distance of two features at any time of the motion.
    double least_distance(FeatureKind kind, const PlacesInFaces& places) const {
        double most = 0;  // by which corners of the two approach each other
        for (std::size_t k = 0; k < corners_of_a(kind); ++k)
            for (std::size_t l = corners_of_a(kind); l < 4; ++l) {
                const std::size_t i = places[k], j = places[l];
                most = std::max(most, (end_[i] - begin_[i] - end_[j] + begin_[j]).squaredNorm());
            }
        return distance(kind, places, begin_) - std::sqrt(most);
    }
    /// The distance at which features press, metres: at most `reach`. 0: they have a common vertex.
    double reach_of(FeatureKind kind, const PlacesInFaces& places, double reach) const {
        if (!is_one_) return reach;
        for (std::size_t k = 0; k < corners_of_a(kind); ++k)
            for (std::size_t l = corners_of_a(kind); l < 4; ++l)
                if (vertices_[places[k]] == vertices_[places[l]]) return 0;
        return std::min(reach, rest_share * distance(kind, places, rest_));
    }

 private:
    static double distance(FeatureKind kind, const PlacesInFaces& places,
                           const std::array<Eigen::Vector3d, 6>& x) {
        return closest_points(kind, {x[places[0]], x[places[1]], x[places[2]], x[places[3]]}).distance;
    }

    bool is_one_;
    std::array<int, 6> vertices_;
    std::array<Eigen::Vector3d, 6> rest_, begin_, end_, low_, high_;
};

void NearFeatureSearch::begin(const std::vector<MovingSurface>& surfaces,
                              std::span<const Intersection> touching) {
    neighbours_.clear();
    references_.clear();
    touching_ = touching;
    for (std::size_t s = 0; s < surfaces.size(); ++s)
        if (!surfaces[s].is_obstacle() && !surfaces[s].proof()) neighbours_.emplace_back(surfaces, s);
}

/// The shares of the reference motion that are nearest to the begin and to the end of this one.
std::array<double, 2> NearFeatureSearch::shares(const std::vector<MovingSurface>& surfaces) const {
    double along_begin = 0, along_end = 0, squared = 0;
    for (std::size_t s = 0; s < surfaces.size(); ++s) {
        const auto& [begin, way] = references_[s];
        along_begin += (surfaces[s].begin_points() - begin).cwiseProduct(way).sum();
        along_end += (surfaces[s].end_points() - begin).cwiseProduct(way).sum();
        squared += way.squaredNorm();
    }
    if (!(squared > 0)) return {0, 0};
    const double at_begin = std::clamp(along_begin / squared, 0.0, 1.0);
    return {at_begin, std::clamp(along_end / squared, at_begin, 1.0)};
}

NearFeatureSearch::Deviation NearFeatureSearch::deviation(std::size_t surface, const MovingSurface& moved,
                                                          const std::array<double, 2>& shares) const {
    const auto& [begin, way] = references_[surface];
    const double error = difference_rounding * std::max(moved.begin_points().cwiseAbs().maxCoeff(),
                                                        moved.end_points().cwiseAbs().maxCoeff());
    Deviation result;
    for (std::size_t end = 0; end < 2; ++end) {
        const Nodes off = (end == 0 ? moved.begin_points() : moved.end_points()) - begin - shares[end] * way;
        result.whole = std::max(result.whole, longest_row(off));
        if (!moved.is_obstacle() && !moved.proof())
            result.own = std::max(result.own, longest_row(about_mean(off)));
    }
    return {result.whole + error, result.own + error};
}

/// By how much less far apart two features may stay than in the reference. In a later part of it, they begin
/// at most as much nearer as they approach each other less. Deviations of both, at the begin and in the ways
/// from there, come on top.
double NearFeatureSearch::nearer(const FeaturePair& pair) const {
    const Deviation &a = deviations_[pair.surface_a], &b = deviations_[pair.surface_b];
    return pair.surface_a == pair.surface_b ? 6 * a.own : 3 * (a.whole + b.whole);
}

/// Whether all that may come near in this motion is among the candidates.
bool NearFeatureSearch::reference_holds(const std::vector<MovingSurface>& surfaces, double reach) {
    if (references_.empty() || reach != asked_reach_) return false;
    for (const MovingSurface& s : surfaces)
        if (!s.begin_points().allFinite() || !s.end_points().allFinite()) return false;
    const std::array<double, 2> near = shares(surfaces);
    deviations_.clear();
    double most = 0, second = 0;  // of two surfaces
    for (std::size_t s = 0; s < surfaces.size(); ++s) {
        deviations_.push_back(deviation(s, surfaces[s], near));
        if (6 * deviations_[s].own > room_) return false;
        if (deviations_[s].whole > most)
            second = std::exchange(most, deviations_[s].whole);
        else
            second = std::max(second, deviations_[s].whole);
    }
    return 3 * (most + second) <= room_;
}

std::span<const NearFeatures> NearFeatureSearch::find(std::vector<MovingSurface>& surfaces, double reach) {
    costs_ = {};
    if (!reference_holds(surfaces, reach)) ask_trees(surfaces, reach);
    keep_near(surfaces, reach);
    for (int s = 0; s < std::ssize(surfaces); ++s)
        if (surfaces[s].proof()) keep_near_unproved(surfaces, s, reach);
    std::erase_if(kept_, [&](const NearFeatures& near) {
        const auto& [kind, a, b, of_a, of_b] = near.pair;
        return !(near.reach > 0) ||
               (a == b && std::ranges::binary_search(touching_, owners(near.pair, surfaces[a].topology())));
    });
    std::ranges::sort(kept_);
    return kept_;
}

/// Makes this motion the reference, and finds its candidates.
void NearFeatureSearch::ask_trees(std::vector<MovingSurface>& surfaces, double reach) {
    asked_reach_ = reach;
    room_ = room_share * reach;
    found_.clear();
    references_.clear();
    deviations_.assign(surfaces.size(), {});
    bool is_finite = true;
    for (const MovingSurface& s : surfaces) {
        references_.push_back({s.begin_points(), s.end_points() - s.begin_points()});
        is_finite = is_finite && references_.back().begin.allFinite() && references_.back().way.allFinite();
    }
    if (!is_finite) references_.clear();  // serves no other motion
    candidates_.clear();
    const auto add = [&](int a, int b, const auto& query) {
        const std::span<const FacePair> pairs = timed(costs_.collision_us, query);
        costs_.face_pairs += std::ssize(pairs);
        const QueryCounters& counted = a == b ? self_query_.counters() : pair_query_.counters();
        costs_.nodes_bounded += counted.nodes_bounded;
        costs_.nodes_out_of_range += counted.nodes_out_of_range;
        collect(surfaces, a, b, pairs, reach + room_,
                [&](const MovingFaces& moving, FeatureKind kind, const PlacesInFaces& places) {
                    const double apart = moving.apart(kind, places);
                    if (apart > reach + room_) return Near{};
                    const double least = moving.least_distance(kind, places);
                    if (least > reach + room_) return Near{};
                    const Near near{.reach = moving.reach_of(kind, places, reach),
                                    .apart = std::max(apart, least)};
                    return near.apart <= near.reach + room_ ? near : Near{};
                });
    };
    const int count = surfaces.size();
    for (int a = 0; a < count; ++a) {
        MovingSurface& s = surfaces[a];
        if (!s.is_obstacle() && !s.proof()) {
            const auto distance = static_cast<float>(reach + room_ + 2 * s.rounding());
            add(a, a, [&] { return self_query_.boxes_within(s.own_tree(), distance); });
        }
        for (int b = a + 1; b < count; ++b) {
            MovingSurface& t = surfaces[b];
            if (s.is_obstacle() && t.is_obstacle()) continue;
            const auto distance = static_cast<float>(reach + room_ + s.rounding() + t.rounding());
            add(a, b, [&] { return pair_query_.boxes_within(s.tree(), t.tree(), distance); });
        }
    }
}

/// Appends to the candidates the features of pairs of faces for which measure(moving, kind, places) gives a
/// reach; none of faces that stay farther apart than `distance`.
template <class Measure>
void NearFeatureSearch::collect(const std::vector<MovingSurface>& surfaces, int a, int b,
                                std::span<const FacePair> faces, double distance, const Measure& measure) {
    const NumberedSurface s = surfaces[a].numbered(a), t = surfaces[b].numbered(b);
    near_bits_.assign(faces.size(), 0);  // in the order of for_each_owned_pair()
    parallel_for(faces.size(), [&](int i) {
        if (a == b && surfaces[a].proof() && surfaces[a].proof()->hang_on_one_host(faces[i])) return;
        const MovingFaces moving(surfaces[a], surfaces[b], faces[i]);
        if (moving.are_beyond(distance)) return;
        int bit = 0;
        for_each_owned_pair(s, t, faces[i], [&](const FeaturePair& pair, const PlacesInFaces& places) {
            if (measure(moving, pair.kind, places).reach > 0) near_bits_[i] |= 1u << bit;
            ++bit;
        });
    });
    for (std::size_t i = 0; i < faces.size(); ++i) {
        if (near_bits_[i] == 0) continue;
        const MovingFaces moving(surfaces[a], surfaces[b], faces[i]);
        int bit = 0;
        for_each_owned_pair(s, t, faces[i], [&](const FeaturePair& pair, const PlacesInFaces& places) {
            if ((near_bits_[i] >> bit++ & 1) == 0) return;
            const Near near = measure(moving, pair.kind, places);
            candidates_.push_back({{pair, near.reach}, near.apart});
        });
    }
}

void NearFeatureSearch::keep_near(const std::vector<MovingSurface>& surfaces, double reach) {
    found_.clear();
    for (const Candidate& candidate : candidates_) {
        if (candidate.apart - nearer(candidate.near.pair) <= candidate.near.reach)
            found_.push_back(candidate.near);
    }
    keeps_.assign(found_.size(), 0);
    parallel_for(found_.size(),
                 [&](int i) { keeps_[i] = may_come_within(found_[i].reach, found_[i].pair, surfaces); });
    kept_.clear();
    for (std::size_t i = 0; i < found_.size(); ++i)
        if (keeps_[i]) kept_.push_back(found_[i]);
    for (NeighbourWatch& watch : neighbours_) watch.find(surfaces, reach, kept_);
}

/// Keeps what comes within its reach on a surface with a HostProof.
void NearFeatureSearch::keep_near_unproved(std::vector<MovingSurface>& surfaces, int surface, double reach) {
    MovingSurface& s = surfaces[surface];
    const HostProof& proof = *s.proof();
    const auto distance = static_cast<float>(reach + 2 * s.rounding());
    const std::span<const FacePair> pairs = timed(costs_.collision_us, [&] {
        return self_query_.boxes_within(s.own_tree(), distance, proof.known_leaves(), proof.open_leaves());
    });
    costs_.face_pairs += std::ssize(pairs);
    costs_.nodes_bounded += self_query_.counters().nodes_bounded;
    faces_.assign(pairs.begin(), pairs.end());
    faces_.insert(faces_.end(), proof.open_faces().begin(), proof.open_faces().end());
    const std::size_t others = candidates_.size();
    collect(surfaces, surface, surface, faces_, reach,
            [&](const MovingFaces& moving, FeatureKind kind, const PlacesInFaces& places) {
                const double apart = moving.apart(kind, places);
                if (apart > reach) return Near{};
                const double least = moving.least_distance(kind, places);
                if (least > reach) return Near{};
                const Near near{.reach = moving.reach_of(kind, places, reach), .apart = apart};
                return std::max(apart, least) <= near.reach ? near : Near{};
            });
    for (std::size_t i = others; i < candidates_.size(); ++i) kept_.push_back(candidates_[i].near);
    candidates_.resize(others);
}

}  // namespace nbd
