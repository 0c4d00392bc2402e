#include "sim/barrier/near_features.hpp"

#include <algorithm>
#include <utility>

#include "collision/base/stopwatch.hpp"
#include "meshing/parallel/parallel_for.hpp"
#include "sim/barrier/feature_boxes.hpp"

namespace nbd {
namespace {

/// Room beyond the reach, as a multiple of it: a larger one makes more candidates, a smaller one more
/// queries.
constexpr double room_share = 1;

/// The largest distance by which a point leaves its box along an axis.
double outside(const Nodes& x, const Nodes& low, const Nodes& high) {
    return std::max({(low - x).maxCoeff(), (x - high).maxCoeff(), 0.0});
}

}  // namespace

void NearFeatureSearch::begin(const std::vector<MovingSurface>& surfaces) {
    neighbours_.clear();
    references_.clear();
    for (std::size_t s = 0; s < surfaces.size(); ++s)
        if (!surfaces[s].is_obstacle()) neighbours_.emplace_back(surfaces, s);
}

NearFeatureSearch::Deviation NearFeatureSearch::deviation(std::size_t surface,
                                                          const MovingSurface& moved) const {
    const Reference& reference = references_[surface];
    const double error = difference_rounding *
                         std::max(moved.begin().cwiseAbs().maxCoeff(), moved.end().cwiseAbs().maxCoeff());
    Deviation result;
    for (const Nodes* x : {&moved.begin(), &moved.end()}) {
        result.whole = std::max(result.whole, outside(*x, reference.low, reference.high));
        if (moved.is_obstacle()) continue;
        result.own = std::max(result.own, outside(about_mean(*x), reference.own_low, reference.own_high));
    }
    return {result.whole + error, result.own + error};
}

/// Whether all that may come near in this motion is among the candidates.
bool NearFeatureSearch::reference_holds(const std::vector<MovingSurface>& surfaces, double reach) {
    if (references_.empty() || reach != asked_reach_) return false;
    deviations_.clear();
    double most = 0, second = 0;  // of two surfaces
    for (std::size_t s = 0; s < surfaces.size(); ++s) {
        if (!surfaces[s].begin().allFinite() || !surfaces[s].end().allFinite()) return false;
        deviations_.push_back(deviation(s, surfaces[s]));
        if (2 * deviations_[s].own > room_) return false;
        if (deviations_[s].whole > most)
            second = std::exchange(most, deviations_[s].whole);
        else
            second = std::max(second, deviations_[s].whole);
    }
    return most + second <= room_;
}

std::span<const NearFeatures> NearFeatureSearch::find(std::vector<MovingSurface>& surfaces, double reach) {
    costs_ = {};
    if (!reference_holds(surfaces, reach)) ask_trees(surfaces, reach);
    keep_near(surfaces, reach);
    return kept_;
}

/// Makes this motion the reference, and finds its candidates.
void NearFeatureSearch::ask_trees(std::vector<MovingSurface>& surfaces, double reach) {
    asked_reach_ = reach;
    room_ = room_share * reach;
    found_.clear();
    references_.clear();
    deviations_.assign(surfaces.size(), {});
    for (const MovingSurface& s : surfaces) {
        Reference reference;
        reference.low = s.begin().cwiseMin(s.end());
        reference.high = s.begin().cwiseMax(s.end());
        if (!s.is_obstacle()) {
            const Nodes begin = about_mean(s.begin()), end = about_mean(s.end());
            reference.own_low = begin.cwiseMin(end);
            reference.own_high = begin.cwiseMax(end);
        }
        references_.push_back(std::move(reference));
    }
    const auto add = [&](int a, int b, const auto& query) {
        const std::span<const FacePair> pairs = timed(costs_.collision_us, query);
        costs_.face_pairs += std::ssize(pairs);
        const auto numbered = [&](int s) { return surfaces[s].numbered(s); };
        for (const FacePair& faces : pairs)
            for_each_owned_pair(numbered(a), numbered(b), faces,
                                [&](const FeaturePair& pair) { found_.push_back({pair}); });
    };
    const int count = surfaces.size();
    for (int a = 0; a < count; ++a) {
        MovingSurface& s = surfaces[a];
        if (!s.is_obstacle()) {
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
    std::vector<double> apart(found_.size());
    parallel_for(found_.size(), [&](int i) {
        NearFeatures& near = found_[i];
        near.reach = reach;
        apart[i] = boxes_apart(near.pair, surfaces);
        if (apart[i] <= reach + room_ && near.pair.surface_a == near.pair.surface_b)
            near.reach = std::min(reach, rest_share * rest_distance(near.pair, surfaces));
    });
    candidates_.clear();
    for (std::size_t i = 0; i < found_.size(); ++i)
        if (apart[i] <= found_[i].reach + room_) candidates_.push_back({found_[i], apart[i]});
}

void NearFeatureSearch::keep_near(const std::vector<MovingSurface>& surfaces, double reach) {
    found_.clear();
    for (const Candidate& candidate : candidates_) {
        const FeaturePair& pair = candidate.near.pair;
        const double nearer = pair.surface_a == pair.surface_b
                                  ? 2 * deviations_[pair.surface_a].own
                                  : deviations_[pair.surface_a].whole + deviations_[pair.surface_b].whole;
        if (candidate.apart - nearer <= candidate.near.reach) found_.push_back(candidate.near);
    }
    keeps_.assign(found_.size(), 0);
    parallel_for(found_.size(),
                 [&](int i) { keeps_[i] = boxes_apart(found_[i].pair, surfaces) <= found_[i].reach; });
    kept_.clear();
    for (std::size_t i = 0; i < found_.size(); ++i)
        if (keeps_[i]) kept_.push_back(found_[i]);
    for (NeighbourWatch& watch : neighbours_) watch.find(surfaces, reach, kept_);
    std::ranges::sort(kept_);
}

}  // namespace nbd
