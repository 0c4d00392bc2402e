// 06: Train learned bounds of a body, and query with them.
//
//     build/release/apps/examples/06_train_a_tree assets/block.mesh /tmp/poses.h5
//
// Training poses come from the simulator, go through a recording and become a calibrated tree. `nbdtree
// dataset`, `train` and `coverage` do the same on all cores, with options and reports.

#include <cstdio>
#include <exception>
#include <memory>

#include "collision/query/one_shot.hpp"
#include "collision/query/pair_query.hpp"
#include "meshing/body/make_body.hpp"
#include "meshing/formats/read_tets.hpp"
#include "sim/excitation/excitation.hpp"
#include "training/calibrate/calibrate.hpp"
#include "training/learn/train_tree.hpp"

// Trajectories in which the body is thrown, squeezed, shaken, ... are written to `path`.
static void record(const nbd::Body& body, int trajectories, const char* path) {
    const nbd::Excitation excitation(body, {.frames = 20, .seed = 1});
    nbd::RecordingWriter recording(path);
    for (int id = 0; id < trajectories; ++id) {
        const int handle = recording.begin_trajectory({.id = id,
                                                       .seed = 1,
                                                       .body_hash = nbd::body_hash(body),
                                                       .recipe = excitation.recipe(id),
                                                       .failure = {}},
                                                      body.tets.X.rows());
        const nbd::TrajectoryResult result = excitation.run(id, [&](const nbd::ExcitedFrame& frame) {
            recording.add_frame(handle, frame.time, frame.x.cast<float>());
        });
        recording.end_trajectory(handle, result.failure);
    }
    recording.finish();
}

int main(int argc, char** argv) try {
    if (argc != 3) {
        std::fprintf(stderr, "usage: %s TETRAHEDRA RECORDING\n", argv[0]);
        return 2;
    }
    const nbd::Body body = nbd::make_body("block", nbd::read_tets(argv[1]));
    record(body, 24, argv[2]);
    const nbd::RecordingReader recording(argv[2]);

    // Learned bounds need no vibration modes, so the body has none.
    const Eigen::MatrixXf no_modes(3 * body.tets.X.rows(), 0);
    const nbd::SurfaceBody surface = nbd::make_surface_body(
        body.surface.X.cast<float>(), body.surface.F, body.float_weights(), no_modes, nbd::body_hash(body));
    nbd::TreeFile file = nbd::train_tree(surface, recording,
                                         {.bounds = {nbd::BoundKind::learned_affine}, .tree = {.depth = 4}});
    nbd::calibrate(file, recording, {.miss_rate = 1e-2});  // margins that keep the rate on poses set aside
    const auto tree = std::make_shared<const nbd::CollisionTree>(file.tree);
    nbd::PosedTree a(tree, nbd::BoundKind::learned_affine), b(tree, nbd::BoundKind::learned_affine);

    // Two copies in poses that training has not seen, half of one inside the other.
    nbd::PairQuery query;
    nbd::Vertices nodes, x, y;
    std::size_t found = 0, exact = 0;
    const auto unseen = nbd::frames_of(recording, file.facts.split, nbd::FrameSet::held_out);
    for (const nbd::FrameId& id : unseen) {
        recording.read(id.trajectory, id.frame, 1, nodes);
        nbd::apply_embedding(surface.W, nodes, x);
        y = x.rowwise() + Eigen::RowVector3f(0.5f, 0.3f, 0.2f);
        a.begin_pose(x);
        b.begin_pose(y);
        found += query.intersecting(a, b).size();
        exact += nbd::intersecting_faces(x, surface.F, y, surface.F).size();
    }
    std::printf("%zu unseen poses: %zu of %zu face pairs found\n", unseen.size(), found, exact);
    return exact > 1000 && found <= exact && found > 0.98 * static_cast<double>(exact) ? 0 : 1;
} catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
