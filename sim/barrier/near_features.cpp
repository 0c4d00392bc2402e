#include "sim/barrier/near_features.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "collision/base/stopwatch.hpp"
#include "meshing/parallel/parallel_for.hpp"
#include "sim/barrier/moving_features.hpp"

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

/// Two faces in a motion.
class NearFeatureSearch::MovingFaces {
 public:
    MovingFaces(const MovingSurface& s, const MovingSurface& t, FacePair faces) : s_(s), t_(t) {
        for (std::size_t k = 0; k < 6; ++k) {
            const MovingSurface& surface = k < 3 ? s : t;
            vertices_[k] = k < 3 ? s.F()(faces.a, k) : t.F()(faces.b, k - 3);
            begin_[k] = surface.begin(vertices_[k]);
            end_[k] = surface.end(vertices_[k]);
            if (&s == &t) rest_[k] = s.rest().row(vertices_[k]);
        }
    }
    /// Whether features of them may be candidates.
    bool may_press(double reach, double room) const {
        const double most_reach = this->most_reach(reach);
        const AxisGaps gaps(Extent(begin_[0], begin_[1], begin_[2]), Extent(end_[0], end_[1], end_[2]),
                            Extent(begin_[3], begin_[4], begin_[5]), Extent(end_[3], end_[4], end_[5]));
        if (gaps.in_motion > near_share * most_reach + room) return false;
        const double most = most_reach + room + relative_motion();
        return !(gaps.at_begin > most || gap_between_middles() > most);
    }
    bool have_common_vertex(FeatureKind kind, const PlacesInFaces& places) const {
        if (&s_ != &t_) return false;
        for (std::size_t k = 0; k < corners_of_a(kind); ++k)
            for (std::size_t l = corners_of_a(kind); l < 4; ++l)
                if (vertices_[places[k]] == vertices_[places[l]]) return true;
        return false;
    }
    MovingFeatures features(FeatureKind kind, const PlacesInFaces& places) const {
        MovingFeatures result{.kind = kind, .begin = {}, .end = {}};
        for (std::size_t k = 0; k < 4; ++k) {
            result.begin[k] = begin_[places[k]];
            result.end[k] = end_[places[k]];
        }
        return result;
    }
    /// The distance at which features press, metres: at most `reach`.
    double reach_of(FeatureKind kind, const PlacesInFaces& places, double reach) const {
        if (&s_ != &t_) return reach;
        return std::min(reach, rest_share * closest_points(kind, at_rest(places)).distance);
    }
    /// No less than that, at less cost: features are no farther apart than their corners.
    double most_reach_of(FeatureKind kind, const PlacesInFaces& places, double reach) const {
        if (&s_ != &t_) return reach;
        const std::array<Eigen::Vector3d, 4> rest = at_rest(places);
        double least = (rest[0] - rest[3]).squaredNorm();
        for (std::size_t k = 0; k < corners_of_a(kind); ++k)
            for (std::size_t l = corners_of_a(kind); l < 4; ++l)
                least = std::min(least, (rest[k] - rest[l]).squaredNorm());
        return std::min(reach, rest_share * std::sqrt(least));
    }

 private:
    std::array<Eigen::Vector3d, 4> at_rest(const PlacesInFaces& places) const {
        std::array<Eigen::Vector3d, 4> rest;
        for (std::size_t k = 0; k < 4; ++k) rest[k] = rest_[places[k]];
        return rest;
    }
    /// The largest distance at which features of them press: as most_reach_of().
    double most_reach(double reach) const {
        if (&s_ != &t_) return reach;
        double most = 0;
        for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t l = 3; l < 6; ++l) most = std::max(most, (rest_[k] - rest_[l]).squaredNorm());
        return std::min(reach, rest_share * std::sqrt(most));
    }
    /// The largest motion of a corner of one relative to a corner of the other.
    double relative_motion() const {
        double most = 0;
        for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t l = 3; l < 6; ++l)
                most = std::max(most, (end_[k] - begin_[k] - (end_[l] - begin_[l])).squaredNorm());
        return std::sqrt(most);
    }
    /// Less than their distance at the begin: the gap along the line of their middles.
    double gap_between_middles() const {
        const Eigen::Vector3d line =
            (begin_[3] + begin_[4] + begin_[5] - begin_[0] - begin_[1] - begin_[2]).normalized();
        double most_of_a = begin_[0].dot(line), least_of_b = begin_[3].dot(line);
        for (std::size_t k = 1; k < 3; ++k) {
            most_of_a = std::max(most_of_a, begin_[k].dot(line));
            least_of_b = std::min(least_of_b, begin_[k + 3].dot(line));
        }
        return least_of_b - most_of_a;
    }

    const MovingSurface &s_, &t_;
    std::array<int, 6> vertices_;
    std::array<Eigen::Vector3d, 6> begin_, end_, rest_;  // at rest: of one surface
};

void NearFeatureSearch::begin(const std::vector<MovingSurface>& surfaces,
                              std::span<const Intersection> touching, const PairRules& rules) {
    rules_ = rules;
    neighbours_.clear();
    references_.clear();
    touching_ = touching;
    for (std::size_t s = 0; s < surfaces.size(); ++s)
        if (rules_.meet(surfaces[s].body(), surfaces[s].body()) && !surfaces[s].proof())
            neighbours_.emplace_back(surfaces, s);
}

void NearFeatureSearch::leave_out(std::vector<FeaturePair> pairs) {
    left_out_ = std::move(pairs);
    std::ranges::sort(left_out_);
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

/// By how much less far apart two features may stay, as far as gap_by_approach() tells, than in the
/// reference. In a later part of it, they begin at most as much nearer as they approach each other less.
/// Deviations of both, at the begin and in the ways from there, come on top.
double NearFeatureSearch::nearer(const FeaturePair& pair) const {
    const Deviation &a = deviations_[pair.surface_a], &b = deviations_[pair.surface_b];
    return pair.surface_a == pair.surface_b ? 6 * a.own : 3 * (a.whole + b.whole);
}

/// The room with which all that may come near in this motion would be among the candidates of the reference;
/// infinite if there is none. Fills the deviations.
double NearFeatureSearch::room_needed(const std::vector<MovingSurface>& surfaces, double reach) {
    constexpr double too_much = std::numeric_limits<double>::infinity();
    if (references_.empty() || reach != asked_reach_) return too_much;
    for (const MovingSurface& s : surfaces)
        if (!s.begin_points().allFinite() || !s.end_points().allFinite()) return too_much;
    const std::array<double, 2> near = shares(surfaces);
    deviations_.clear();
    double own = 0, most = 0, second = 0;  // the last two of two surfaces
    for (std::size_t s = 0; s < surfaces.size(); ++s) {
        deviations_.push_back(deviation(s, surfaces[s], near));
        own = std::max(own, deviations_[s].own);
        if (deviations_[s].whole > most)
            second = std::exchange(most, deviations_[s].whole);
        else
            second = std::max(second, deviations_[s].whole);
    }
    return std::max(6 * own, 3 * (most + second));
}

std::span<const NearFeatures> NearFeatureSearch::find(std::vector<MovingSurface>& surfaces, double reach) {
    costs_ = {};
    kept_.clear();
    const double needed = room_needed(surfaces, reach);
    if (room_ > 0 && needed <= room_) {
        keep_near(surfaces);
    } else {
        // Where motions change by more than that, another one will not be near this one either.
        room_ = needed <= room_share * reach ? room_share * reach : 0;
        ask_trees(surfaces, reach);
        if (room_ > 0)
            keep_near(surfaces);
        else
            keep(candidates_);
    }
    for (NeighbourWatch& watch : neighbours_) watch.find(surfaces, reach, kept_);
    for (int s = 0; s < std::ssize(surfaces); ++s)
        if (surfaces[s].proof() && rules_.meet(surfaces[s].body(), surfaces[s].body()))
            keep_near_unproved(surfaces, s, reach);
    std::erase_if(kept_, [&](const NearFeatures& near) {
        const auto& [kind, a, b, of_a, of_b] = near.pair;
        return !(near.reach > 0) || std::ranges::binary_search(left_out_, near.pair) ||
               (a == b && std::ranges::binary_search(touching_, owners(near.pair, surfaces[a].topology())));
    });
    std::ranges::sort(kept_);
    return kept_;
}

/// Makes this motion the reference, and finds its candidates.
void NearFeatureSearch::ask_trees(std::vector<MovingSurface>& surfaces, double reach) {
    asked_reach_ = reach;
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
        const std::span<const FacePair> pairs = timed(costs_.collision_us, "search", query);
        costs_.face_pairs += std::ssize(pairs);
        const QueryCounters& counted = a == b ? self_query_.counters() : pair_query_.counters();
        costs_.nodes_bounded += counted.nodes_bounded;
        costs_.nodes_out_of_range += counted.nodes_out_of_range;
        // Of many bodies, few come near each other.
        if (!pairs.empty()) collect(surfaces, a, b, pairs, reach, room_, candidates_);
    };
    const int count = surfaces.size();
    for (int a = 0; a < count; ++a) {
        MovingSurface& s = surfaces[a];
        if (rules_.meet(s.body(), s.body()) && !s.proof()) {
            const auto distance = static_cast<float>(near_share * reach + room_ + 2 * s.rounding());
            add(a, a, [&] { return self_query_.boxes_within(s.own_tree(), distance); });
        }
        for (int b = a + 1; b < count; ++b) {
            MovingSurface& t = surfaces[b];
            if (!rules_.meet(s.body(), t.body())) continue;
            const auto distance =
                static_cast<float>(near_share * reach + room_ + s.rounding() + t.rounding());
            add(a, b, [&] { return pair_query_.boxes_within(s.tree(), t.tree(), distance); });
        }
    }
}

/// Two features of faces: a candidate if they may_press(), or with room, if their approach may bring them
/// within their reach and the room.
NearFeatureSearch::Candidate NearFeatureSearch::candidate(const MovingFaces& faces, const FeaturePair& pair,
                                                          const PlacesInFaces& places, double reach,
                                                          double room) {
    constexpr Candidate none{};
    if (faces.have_common_vertex(pair.kind, places)) return none;
    const MovingFeatures features = faces.features(pair.kind, places);
    const double most_reach = faces.most_reach_of(pair.kind, places, reach);
    if (room == 0) {
        if (!features.may_press(most_reach)) return none;
        const double own_reach = faces.reach_of(pair.kind, places, reach);
        return own_reach == most_reach || features.may_press(own_reach) ? Candidate{{pair, own_reach}} : none;
    }
    if (features.axis_gaps().in_motion > near_share * most_reach + room) return none;
    const double apart = features.gap_by_approach();
    if (apart > most_reach + room) return none;
    const double own_reach = faces.reach_of(pair.kind, places, reach);
    return apart <= own_reach + room ? Candidate{{pair, own_reach}, apart} : none;
}

/// Appends the features of pairs of faces that are candidates.
void NearFeatureSearch::collect(std::vector<MovingSurface>& surfaces, int a, int b,
                                std::span<const FacePair> faces, double reach, double room,
                                std::vector<Candidate>& candidates) {
    constexpr std::size_t chunk = 256;  // pairs of faces
    surfaces[a].place_corners(faces, &FacePair::a);
    surfaces[b].place_corners(faces, &FacePair::b);
    const NumberedSurface s = surfaces[a].numbered(a), t = surfaces[b].numbered(b);
    const std::optional<HostProof>& proof = surfaces[a].proof();
    std::vector<std::vector<Candidate>> found((faces.size() + chunk - 1) / chunk);
    parallel_for(
        found.size(),
        [&](int i) {
            const std::size_t first = chunk * i;
            for (const FacePair& pair : faces.subspan(first, std::min(chunk, faces.size() - first))) {
                if (a == b && proof && proof->hang_on_one_host(pair)) continue;
                const MovingFaces moving(surfaces[a], surfaces[b], pair);
                if (!moving.may_press(reach, room)) continue;
                for_each_owned_pair(
                    s, t, pair, [&](const FeaturePair& features, const PlacesInFaces& places) {
                        const Candidate one = candidate(moving, features, places, reach, room);
                        if (one.near.reach > 0) found[i].push_back(one);
                    });
            }
        },
        1);
    for (const std::vector<Candidate>& some : found)
        candidates.insert(candidates.end(), some.begin(), some.end());
}

void NearFeatureSearch::keep(std::span<const Candidate> candidates) {
    for (const Candidate& candidate : candidates) kept_.push_back(candidate.near);
}

/// Of the candidates of the reference.
void NearFeatureSearch::keep_near(const std::vector<MovingSurface>& surfaces) {
    found_.clear();
    for (const Candidate& candidate : candidates_)
        if (candidate.apart - nearer(candidate.near.pair) <= candidate.near.reach)
            found_.push_back(candidate.near);
    keeps_.assign(found_.size(), 0);
    parallel_for(found_.size(), [&](int i) {
        keeps_[i] = moving_features(found_[i].pair, surfaces).may_press(found_[i].reach);
    });
    for (std::size_t i = 0; i < found_.size(); ++i)
        if (keeps_[i]) kept_.push_back(found_[i]);
}

/// Keeps what comes near on a surface with a HostProof.
void NearFeatureSearch::keep_near_unproved(std::vector<MovingSurface>& surfaces, int surface, double reach) {
    MovingSurface& s = surfaces[surface];
    const HostProof& proof = *s.proof();
    const auto distance = static_cast<float>(near_share * reach + 2 * s.rounding());
    const std::span<const FacePair> pairs = timed(costs_.collision_us, "search", [&] {
        return self_query_.boxes_within(s.own_tree(), distance, proof.known_leaves(), proof.open_leaves());
    });
    costs_.face_pairs += std::ssize(pairs);
    costs_.nodes_bounded += self_query_.counters().nodes_bounded;
    faces_.assign(pairs.begin(), pairs.end());
    faces_.insert(faces_.end(), proof.open_faces().begin(), proof.open_faces().end());
    unproved_.clear();
    collect(surfaces, surface, surface, faces_, reach, 0, unproved_);
    keep(unproved_);
}

}  // namespace nbd
