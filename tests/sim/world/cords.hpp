#pragma once

#include <Eigen/Core>
#include <utility>

#include "meshing/body/rigid_body.hpp"
#include "sim/world/world.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/sim/world/box_model.hpp"

// Helpers of the tests of ropes, tendons and muscles.
namespace nbd::test {

inline Model rigid_block(const Eigen::Vector3d& size) {
    TriMesh surface = box(size[0], size[1], size[2], 2);
    surface.X.rowwise() -= size.transpose() / 2;
    return Model(make_rigid_body("block", std::move(surface), 1000), true);
}

inline WorldConfig without_gravity(TimeIntegrator integrator = TimeIntegrator::second_order) {
    return {.gravity = Eigen::Vector3d::Zero(), .step = {.integrator = integrator}};
}

inline CordJoint pulled(const Eigen::Vector3d& from, const Eigen::Vector3d& to, Keyed<double> tension) {
    CordJoint cord{.from = from, .to = to};
    cord.tension = std::move(tension);
    return cord;
}

inline Keyed<double> constant(double value) { return {{0.0}, {value}}; }

}  // namespace nbd::test
