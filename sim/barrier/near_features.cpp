#include "sim/barrier/near_features.hpp"

#include <algorithm>

#include "collision/base/stopwatch.hpp"
#include "meshing/parallel/parallel_for.hpp"
#include "sim/barrier/feature_boxes.hpp"

namespace nbd {

void NearFeatureSearch::begin(const std::vector<MovingSurface>& surfaces) {
    neighbours_.clear();
    for (std::size_t s = 0; s < surfaces.size(); ++s)
        if (!surfaces[s].is_obstacle()) neighbours_.emplace_back(surfaces, s);
}

std::span<const NearFeatures> NearFeatureSearch::find(std::vector<MovingSurface>& surfaces, double reach) {
    found_.clear();
    costs_ = {};
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
            const auto distance = static_cast<float>(reach + 2 * s.rounding());
            add(a, a, [&] { return self_query_.boxes_within(s.own_tree(), distance); });
        }
        for (int b = a + 1; b < count; ++b) {
            MovingSurface& t = surfaces[b];
            if (s.is_obstacle() && t.is_obstacle()) continue;
            const auto distance = static_cast<float>(reach + s.rounding() + t.rounding());
            add(a, b, [&] { return pair_query_.boxes_within(s.tree(), t.tree(), distance); });
        }
    }
    keep_near(surfaces, reach);
    return kept_;
}

void NearFeatureSearch::keep_near(const std::vector<MovingSurface>& surfaces, double reach) {
    keeps_.assign(found_.size(), 0);
    parallel_for(found_.size(), [&](int i) {
        NearFeatures& near = found_[i];
        near.reach = reach;
        const double apart = boxes_apart(near.pair, surfaces);
        if (apart > reach) return;
        if (near.pair.surface_a == near.pair.surface_b)
            near.reach = std::min(reach, rest_share * rest_distance(near.pair, surfaces));
        keeps_[i] = apart <= near.reach;
    });
    kept_.clear();
    for (std::size_t i = 0; i < found_.size(); ++i)
        if (keeps_[i]) kept_.push_back(found_[i]);
    for (NeighbourWatch& watch : neighbours_) watch.find(surfaces, reach, kept_);
    std::ranges::sort(kept_);
}

}  // namespace nbd
