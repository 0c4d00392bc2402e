#include "collision/bounds/certified/region_meter.hpp"

#include <atomic>
#include <cmath>
#include <utility>

#include "collision/base/requirement.hpp"
#include "collision/bounds/certified/squared_norm.hpp"

namespace nbd {
namespace {

/// The norm rounded up to float32; infinite for NaN.
float norm_rounded_up(double squared) noexcept {
    const auto norm = static_cast<float>(std::sqrt(squared) * (1 + 1e-6));
    return std::isnan(norm) ? std::numeric_limits<float>::infinity() : norm;
}

/// Raises `slot` to at least x; safe when other threads do the same.
void raise(float& slot, float x) noexcept {
    const std::atomic_ref<float> shared(slot);
    float there = shared.load(std::memory_order_relaxed);
    while (there < x && !shared.compare_exchange_weak(there, x, std::memory_order_relaxed)) {
    }
}

}  // namespace

RegionMeter::RegionMeter(std::shared_ptr<const TetRegions> regions, int tet_count)
    : regions_(std::move(regions)) {
    check_tet_regions(*regions_, tet_count);
    motions_.resize(static_cast<std::size_t>(regions_->count()));
}

std::span<const int> RegionMeter::samples_of(int region) const noexcept {
    const int* begin = regions_->sample_begin.data() + region;
    return std::span(regions_->samples)
        .subspan(static_cast<std::size_t>(begin[0]), static_cast<std::size_t>(begin[1] - begin[0]));
}

void RegionMeter::start(int region, const Eigen::Matrix3d& G) noexcept {
    RegionMotion& motion = motions_[static_cast<std::size_t>(region)];
    motion = {};
    if (const Eigen::Matrix3f rounded = G.cast<float>(); rounded.allFinite()) motion.G = rounded;
}

void RegionMeter::add(int first, int count, const LaneMatrix& F) noexcept {
    LaneMatrix off = F;
    std::array<RegionMotion*, lanes> motion = {};
    for (int l = 0; l < count; ++l) {
        const int region = regions_->of_tet[static_cast<std::size_t>(first + l)];
        motion[static_cast<std::size_t>(l)] = &motions_[static_cast<std::size_t>(region)];
        const float* G = motion[static_cast<std::size_t>(l)]->G.data();
        for (std::size_t k = 0; k < 9; ++k) off[k][l] -= static_cast<double>(G[k]);
    }
    const Lanes stretch = squared_norm_bound(F), deviation = squared_norm_bound(off);
    for (int l = 0; l < count; ++l) {
        raise(motion[static_cast<std::size_t>(l)]->stretch, norm_rounded_up(stretch[l]));
        raise(motion[static_cast<std::size_t>(l)]->deviation, norm_rounded_up(deviation[l]));
    }
}

void check_tet_regions(const TetRegions& regions, int tet_count) {
    constexpr Requirement require("regions of tetrahedra");
    require(regions.sample_begin.size() >= 2 && regions.sample_begin.front() == 0 &&
                std::cmp_equal(regions.sample_begin.back(), regions.samples.size()),
            "the ranges of ", regions.count(), " regions do not fit the number of samples, ",
            regions.samples.size());
    for (int r = 0; r < regions.count(); ++r)
        require(regions.sample_begin[static_cast<std::size_t>(r)] <
                    regions.sample_begin[static_cast<std::size_t>(r) + 1],
                "region ", r, " has no sample");
    for (const int t : regions.samples)
        require(t >= 0 && t < tet_count, "tetrahedron ", t, " is a sample, but the tetrahedron count is ",
                tet_count);
    require(std::cmp_equal(regions.of_tet.size(), tet_count), regions.of_tet.size(),
            " tetrahedra instead of ", tet_count);
    for (const int r : regions.of_tet)
        require(r >= 0 && r < regions.count(), "a tetrahedron refers to region ", r, " of ", regions.count());
}

}  // namespace nbd
