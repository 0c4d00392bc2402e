#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "collision/tree/posed_tree.hpp"
#include "meshing/body/body.hpp"
#include "tests/apps/small_files.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"
#include "training/files/recording.hpp"
#include "training/files/split.hpp"
#include "training/files/tree_file.hpp"

namespace nbd::test {
namespace {

using EvaluateTest = SmallFiles;

/// The share of vertices outside of the spheres of one depth and the mean of r / r_exact - 1, counted here
/// over all test frames.
struct DirectCount {
    double outside = 0, inflation = 0;

    DirectCount(const std::filesystem::path& folder, BoundKind kind, float margin, int depth) {
        const TreeFile file = load_tree(folder / "tree.h5");
        const Body body = load_body(folder / "box.h5");
        const RecordingReader data(folder / "data.h5");
        PosedTree posed(std::make_shared<const CollisionTree>(file.tree), kind, margin);
        Vertices nodes;
        long vertices = 0, spheres = 0;
        for (const FrameId& frame : frames_of(data, file.facts.split, FrameSet::random_test)) {
            data.read(frame.trajectory, frame.frame, 1, nodes);
            const Vertices x = body.W.cast<float>() * nodes;
            posed.begin_pose(x);
            for (int i = (1 << depth) - 1; i < (2 << depth) - 1; ++i) {
                const auto listed = file.tree.spheres.node_vertices(i);
                const Sphere s = posed.sphere(i);
                Eigen::RowVector3f mean = Eigen::RowVector3f::Zero();
                for (const int v : listed) mean += x.row(v) / static_cast<float>(listed.size());
                float exact = 0;
                for (const int v : listed) {
                    exact = std::max(exact, (x.row(v) - mean).norm());
                    outside += (x.row(v).transpose() - s.c).norm() > s.r;
                }
                inflation += s.r / exact - 1;
                vertices += listed.size();
                ++spheres;
            }
        }
        outside /= static_cast<double>(vertices);
        inflation /= static_cast<double>(spheres);
    }
};

TEST_F(EvaluateTest, TellsWhatADirectCountTells) {
    make("evaluate tree.h5 data.h5 --bounds bd,nbd --margins 0,0.02,0.05 --csv bounds.csv -q");
    constexpr std::array counted{BoundKind::bd, BoundKind::nbd};
    int compared = 0;
    double most_outside = 0;
    for (const std::string& line : lines(bytes("bounds.csv"))) {
        const auto row = cells(line);  // frames, bound, margin, depth, radius_error, inflation, ...
        const auto kind = std::ranges::find(counted, row[1], [](BoundKind k) { return name(k); });
        if (kind == counted.end() || (row[2] != "0" && row[2] != "0.02")) continue;
        SCOPED_TRACE(line);
        const DirectCount count(folder(), *kind, std::stof(row[2]), std::stoi(row[3]));
        EXPECT_NEAR(std::stod(row[5]), count.inflation, 1e-4);
        EXPECT_NEAR(std::stod(row[7]), count.outside, 0.5 / std::stod(row[11]));
        most_outside = std::max(most_outside, count.outside);
        ++compared;
    }
    EXPECT_EQ(compared, 2 * 2 * 3);  // bounds, margins, depths
    EXPECT_GT(most_outside, 0);
}

TEST_F(EvaluateTest, RemapsARecordingToAFinerSurfaceOfTheSameTetrahedra) {
    make("mesh box.obj -o fine.h5 --elements linear --subdivide 1 -q");
    make("modes fine.h5 -m 8 -q");
    make("remap data.h5 --from box.h5 --to fine.h5 -o fine_data.h5 -q");
    make(
        "train fine.h5 fine_data.h5 -o fine_tree.h5 --depth 2 -m 8 -k 16 --epochs 5 --held-out 0 "
        "--calibration 0 -q");
    // The finer surface moves with the same tetrahedra, so the same pose has more touching face pairs.
    EXPECT_GT(result("collide fine_tree.h5@fine_data.h5:1:30 tree.h5@data.h5:1:30")["face_pairs"],
              result("collide tree.h5@data.h5:1:30 tree.h5@data.h5:1:30")["face_pairs"]);

    write("other.obj", obj_file(box(0.3, 0.1, 0.1, 3)));
    make("mesh other.obj -o other_tets.h5 -q");
    expect_refused({{"remap data.h5 --from box.h5 --to other_tets.h5 -o no.h5", 1,
                     "other_tets.h5: its tetrahedra are not those of box.h5"}});
}

}  // namespace
}  // namespace nbd::test
