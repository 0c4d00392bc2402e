#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "collision/base/aligned_vector.hpp"

namespace nbd {

/// What was computed of some parts of a body in the present pose, one T a part. They lie in the order in
/// which they were added, so that a query that looks at few parts touches little memory. Allocates only if a
/// pose adds more than any before it.
template <class T>
class PoseCache {
 public:
    explicit PoseCache(int parts) : places_(parts) {}

    void begin_pose() noexcept {
        in_use_ = 0;
        if (++pose_ != 0) return;
        std::ranges::fill(places_, Place{});  // the counter wrapped around: mark all as old
        pose_ = 1;
    }

    bool has(int part) const noexcept { return places_[part].pose == pose_; }
    /// Only of a part that was added in this pose. Valid until the next one is.
    const T& operator[](int part) const noexcept { return values_[places_[part].at]; }
    /// Adds a part, to be filled in: its contents are unspecified. Throws std::bad_alloc, and has not added
    /// it then.
    T& add(int part) {
        if (values_.size() == static_cast<std::size_t>(in_use_)) values_.emplace_back();
        places_[part] = {pose_, in_use_};
        return values_[in_use_++];
    }

    /// Makes room for poses that add all parts.
    void reserve() { values_.reserve(places_.size()); }

 private:
    struct Place {
        std::uint32_t pose = 0;  // in which the part was added last
        int at = 0;              // index into values_
    };

    std::vector<Place> places_;
    AlignedVector<T> values_;
    int in_use_ = 0;
    std::uint32_t pose_ = 1;
};

}  // namespace nbd
