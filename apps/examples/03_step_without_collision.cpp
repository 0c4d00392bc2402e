// 03: How far may a body move before it comes too near an obstacle, or itself?
//
//     build/release/apps/examples/03_step_without_collision
//
// FeatureQuery looks at all vertices and faces and all edges that may meet while the bodies move straight. A
// ball falls through another here, from 2.5 m above it, and stops where 1 mm and a tenth of the gap are left.

#include <cstdio>

#include "apps/examples/ball.hpp"
#include "collision/continuous/feature_query.hpp"

int main() {
    const Surface s = ball(1);
    const nbd::Nodes x = s.x.cast<double>(), above = x.rowwise() + Eigen::RowVector3d(0.3, 0, 2.5);
    std::vector<nbd::MovingBody> bodies;
    bodies.emplace_back(above, s.F);
    bodies.emplace_back(x, s.F, nbd::BodyRole::obstacle);
    bodies[0].move(above, above.rowwise() - Eigen::RowVector3d(0, 0, 5));
    const nbd::FreeStep step = nbd::FeatureQuery().collision_free_step(bodies, 1e-3);
    const nbd::Nodes stopped = bodies[0].at(step.share);
    std::printf("%.4f of the step, up to a height of %.4f m\n", step.share, stopped.col(2).mean());
    return step.limit && step.share > 0.09 && step.share < 0.1 ? 0 : 1;
}
