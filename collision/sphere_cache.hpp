#pragma once

#include <cstdint>
#include <vector>

#include "collision/bound.hpp"

namespace nbd {

/// The spheres of one pose, each computed when first asked for.
class SphereCache {
 public:
    /// rest: what the nodes have until the first pose. margin: radii are multiplied by 1 + margin.
    SphereCache(const std::vector<Sphere>& rest, float margin)
        : spheres_(rest), poses_(rest.size(), 0), factor_(1 + margin) {}

    void begin_pose() noexcept {
        ++pose_;
        bounded_ = 0;
    }

    template <Bound B>
    const Sphere& get(int node, B& bounds) noexcept {
        const auto i = static_cast<std::size_t>(node);
        if (poses_[i] != pose_) {
            spheres_[i] = bounds.bound(node);
            spheres_[i].r *= factor_;
            poses_[i] = pose_;
            ++bounded_;
        }
        return spheres_[i];
    }

    /// Nodes computed in this pose.
    int bounded() const noexcept { return bounded_; }

 private:
    std::vector<Sphere> spheres_;
    std::vector<std::uint64_t> poses_;  // the pose each sphere belongs to
    std::uint64_t pose_ = 0;
    float factor_;
    int bounded_ = 0;
};

}  // namespace nbd
