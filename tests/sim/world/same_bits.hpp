// Whether a world moves by the same bits on any number of threads and from a snapshot.
#pragma once

#include <gtest/gtest.h>

#include "sim/world/world.hpp"
#include "tests/support/on_threads.hpp"

namespace nbd::test {

/// Runs worlds that `made` returns by steps of 5 ms, on one and four threads, and one from a snapshot in the
/// middle, and compares their first bodies.
template <class Made>
void expect_same_bits(const Made& made, int steps) {
    const auto run = [&](bool is_resumed) {
        World world = made();
        for (int step = 0; step < steps; ++step) {
            if (is_resumed && step == steps / 2) {
                const WorldSnapshot snapshot = world.snapshot();
                world = made();
                world.restore(snapshot);
            }
            EXPECT_EQ(world.step(5e-3).failure, "");
        }
        return world.state(0);
    };
    const BodyState one = on_threads(1, [&] { return run(false); });
    for (const BodyState& other :
         {on_threads(4, [&] { return run(false); }), on_threads(1, [&] { return run(true); })}) {
        EXPECT_EQ(one.x, other.x);
        EXPECT_EQ(one.v, other.v);
    }
}

}  // namespace nbd::test
