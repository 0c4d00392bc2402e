#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>

#include "apps/bench/pairs/bench_body.hpp"

namespace nbd {

/// A body in a pose. Both arrays last, at the same place, until the next update().
struct BenchPose {
    VerticesRef x;      // [n, 3] its surface
    VerticesRef nodes;  // [N, 3] the tet nodes that carry it
};

/// One way to tell which faces of two copies of a body intersect, pose after pose. The benchmark times both
/// steps.
class PairMethod {
 public:
    virtual ~PairMethod() = default;

    /// What the new poses cost before anything is asked.
    virtual void update(const BenchPose& a, const BenchPose& b) = 0;

    /// Face pairs that intersect, sorted by (a, b), without repeats. Valid until the next call.
    virtual std::span<const FacePair> query() = 0;
};

/// A method by name, and how to set it up for a body.
struct PairMethodEntry {
    std::string name;
    bool exact = true;         // finds all pairs, always
    bool reads_nodes = false;  // and not the surface, whose positions it makes where it needs them
    std::function<std::unique_ptr<PairMethod>(const BenchBody&)> make;  // the body lasts as long as it
    bool answers = true;  // false: it only shows what something costs
};

}  // namespace nbd
