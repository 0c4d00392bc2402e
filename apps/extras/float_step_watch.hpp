#pragma once

#include <string>

#include "collision/geometry/geometry.hpp"

namespace nbd {

/// Watches whether float32 can hold the shape of a body that is recorded.
class FloatStepWatch {
 public:
    /// name: of the file and the body, for the notice. edge: mean edge of its surface, metres.
    FloatStepWatch(std::string name, double edge);

    /// Tells once, by notice(), that a step of float32 at these positions is more than a thousandth of the
    /// mean edge. x: [N, 3], finite.
    void see(VerticesRef x);

 private:
    std::string name_;
    double edge_;
    bool has_told_ = false;
};

}  // namespace nbd
