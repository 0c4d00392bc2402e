// 05: Drop a deformable body on a floor.
//
//     build/release/apps/examples/05_drop_a_body assets/block.mesh
//
// Reads tetrahedra, makes a body of them, puts it into a world with a floor and takes steps. To start from a
// surface instead, fill it with tetrahedralize() (meshing/tets). `nbdtree simulate` does all this from a
// scene file.

#include <cstdio>
#include <exception>
#include <memory>

#include "meshing/body/make_body.hpp"
#include "meshing/formats/read_tets.hpp"
#include "sim/world/world.hpp"

int main(int argc, char** argv) try {
    if (argc != 2) {
        std::fprintf(stderr, "usage: %s TETRAHEDRA\n", argv[0]);
        return 2;
    }
    // The collision surface is the boundary of the tetrahedra. Soft rubber: Young's modulus in Pa, density in
    // kg/m3.
    const nbd::Body body =
        nbd::make_body("block", nbd::read_tets(argv[1]), {.young = 2e5, .poisson = 0.4, .density = 1000});
    const auto elastic = std::make_shared<const nbd::ElasticBody>(body);
    std::printf("%d nodes, %d tetrahedra, %.0f kg\n", elastic->node_count(), elastic->element_count(),
                elastic->mass());

    nbd::World world(nbd::WorldConfig{});  // gravity is (0, 0, -9.81) m/s2
    nbd::Obstacle floor;
    floor.shape = nbd::PlaneShape{.point = {0, 0, 0}, .normal = Eigen::Vector3d::UnitZ()};
    world.add_obstacle(floor);
    nbd::WorldBody entry{.elastic = elastic, .W = body.W, .F = body.surface.F};
    // The lowest node starts half a metre above the floor, at rest.
    entry.state.x = body.tets.X;
    entry.state.x.col(2).array() += 0.5 - body.tets.X.col(2).minCoeff();
    entry.state.v = nbd::Nodes::Zero(body.tets.X.rows(), 3);
    world.add_body(std::move(entry));

    std::puts("  time  contacts  kinetic J  elastic J  gravity J  lowest m");
    double first = 0, last = 0, lowest = 1;
    int contacts = 0;
    for (int step = 1; step <= 100; ++step) {
        const nbd::WorldReport report = world.step(0.01);
        if (!report.failure.empty()) throw std::runtime_error(report.failure);
        const double height = world.state(0).x.col(2).minCoeff();
        last = report.kinetic_energy + report.elastic_energy + report.gravity_energy;
        if (step == 1) first = last;
        lowest = std::min(lowest, height);
        contacts = std::max(contacts, report.contacts);
        if (step % 10 == 0)
            std::printf("%6.2f  %8d  %9.1f  %9.1f  %9.1f  %8.4f\n", report.time, report.contacts,
                        report.kinetic_energy, report.elastic_energy, report.gravity_energy, height);
    }
    // It has hit the floor, has not sunk into it, and impact and damping have taken energy out.
    return contacts > 10 && lowest > -0.01 && last < first ? 0 : 1;
} catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
