#include "sim/barrier/neighbour_watch.hpp"

#include <algorithm>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/barrier/moving_features.hpp"

namespace nbd {
namespace {

/// The reference pose is renewed where the surface is farther from it than this multiple of its motion.
constexpr double renewal = 4;

}  // namespace

NeighbourWatch::NeighbourWatch(const std::vector<MovingSurface>& surfaces, int surface) : surface_(surface) {
    const MovingSurface& own = surfaces[surface_];
    for (const FeaturePair& pair : neighbour_features(own.F(), own.topology(), surface)) {
        pairs_.push_back({pair, rest_share * rest_distance(pair, surfaces)});
    }
}

void NeighbourWatch::refer_to_begin(const std::vector<MovingSurface>& surfaces) {
    reference_ = about_mean(surfaces[surface_].begin_points());
    apart_.resize(pairs_.size());
    parallel_for(pairs_.size(), [&](int i) {
        const std::size_t p = i;
        MovingFeatures features = moving_features(pairs_[p].pair, surfaces);
        features.end = features.begin;
        apart_[p] = features.axis_gaps().at_begin;
    });
}

void NeighbourWatch::find(const std::vector<MovingSurface>& surfaces, double reach,
                          std::vector<NearFeatures>& near) {
    const MovingSurface& own = surfaces[surface_];
    const Nodes begin = about_mean(own.begin_points()), end = about_mean(own.end_points());
    const double motion = (end - begin).cwiseAbs().maxCoeff();
    const auto distance = [&] {
        return std::max((begin - reference_).cwiseAbs().maxCoeff(), (end - reference_).cwiseAbs().maxCoeff());
    };
    if (reference_.rows() == 0 || distance() > renewal * motion) refer_to_begin(surfaces);
    // Each of two features may have come nearer by `distance` along every axis.
    const double most = 2 * distance() + difference_rounding * (1 + own.begin_points().cwiseAbs().maxCoeff());
    looked_at_.clear();
    for (std::size_t i = 0; i < pairs_.size(); ++i)
        if (apart_[i] <= near_share * std::min(pairs_[i].reach, reach) + most) looked_at_.push_back(i);
    keeps_.assign(looked_at_.size(), 0);
    parallel_for(looked_at_.size(), [&](int k) {
        const NearFeatures& pair = pairs_[looked_at_[k]];
        keeps_[k] = moving_features(pair.pair, surfaces).may_press(std::min(pair.reach, reach));
    });
    for (std::size_t k = 0; k < looked_at_.size(); ++k) {
        if (!keeps_[k]) continue;
        const NearFeatures& pair = pairs_[looked_at_[k]];
        near.push_back({pair.pair, std::min(pair.reach, reach)});
    }
}

}  // namespace nbd
