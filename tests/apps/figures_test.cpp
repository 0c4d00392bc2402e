#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <set>

#include "collision/tree/posed_tree.hpp"
#include "meshing/body/body.hpp"
#include "tests/apps/small_files.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"
#include "tests/support/file_damage.hpp"
#include "training/files/recording.hpp"
#include "training/files/split.hpp"
#include "training/files/tree_file.hpp"

namespace nbd::test {
namespace {

/// With the figures of one tree as those of two bodies.
class FiguresTest : public SmallFiles {
 protected:
    static void SetUpTestSuite() {
        SmallFiles::SetUpTestSuite();
        make("figures -o figures --body ONE tree.h5 data.h5 --body TWO tree.h5 data.h5 -q");
    }
};

TEST_F(FiguresTest, WritesEveryFigureAsTableAndPictures) {
    std::set<std::string> expected{"bounds.csv"};
    for (const std::string stem : {"figure6", "figure7", "figure8_ONE", "figure8_TWO"}) {
        expected.insert(stem + ".png");
        EXPECT_EQ(bytes("figures/" + stem + ".png").substr(1, 3), "PNG");
    }
    EXPECT_EQ(listing(folder() / "figures"), expected);

    // The table of each body equals the output of `evaluate`.
    std::string margins = "0";
    for (int percent = 1; percent <= 25; ++percent)
        margins += ",0." + std::string(percent < 10 ? "0" : "") + std::to_string(percent);
    make("evaluate tree.h5 data.h5 --bounds nbd,bd --margins " + margins + " --csv table.csv -q");
    const auto ours = lines(bytes("figures/bounds.csv")), evaluated = lines(bytes("table.csv"));
    ASSERT_EQ(ours.size(), 2 * evaluated.size() - 1);
    EXPECT_EQ(ours[0], "body," + evaluated[0]);
    for (std::size_t i = 1; i < evaluated.size(); ++i) EXPECT_EQ(ours[i], "\"ONE\"," + evaluated[i]);
}

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

TEST_F(FiguresTest, TellsWhatADirectCountTells) {
    constexpr std::array counted{BoundKind::bd, BoundKind::nbd};
    int compared = 0;
    double most_outside = 0;
    for (const std::string& line : lines(bytes("figures/bounds.csv"))) {
        const auto row = cells(line);  // body, frames, bound, margin, depth, radius_error, inflation, ...
        const auto kind = std::ranges::find(counted, row[2], [](BoundKind k) { return name(k); });
        if (row[0] != "\"ONE\"" || kind == counted.end() || (row[3] != "0" && row[3] != "0.02")) continue;
        SCOPED_TRACE(line);
        const DirectCount count(folder(), *kind, std::stof(row[3]), std::stoi(row[4]));
        EXPECT_NEAR(std::stod(row[6]), count.inflation, 1e-4);
        EXPECT_NEAR(std::stod(row[8]), count.outside, 0.5 / std::stod(row[12]));
        most_outside = std::max(most_outside, count.outside);
        ++compared;
    }
    EXPECT_EQ(compared, 2 * 2 * 3);  // bounds, margins, depths
    EXPECT_GT(most_outside, 0);
}

TEST_F(FiguresTest, ReportsOnATreeInASelfContainedFile) {
    make("evaluate tree.h5 data.h5 --html report.html -q");
    const std::string page = bytes("report.html");
    EXPECT_TRUE(page.starts_with("<!DOCTYPE html>"));
    EXPECT_TRUE(page.ends_with("</html>\n"));
    for (const char* shown : {"<h1>tree: bounds of a collision tree</h1>", "nbd bounds",
                              "nbdtree evaluate tree.h5 data.h5 --html report.html"})
        EXPECT_NE(page.find(shown), std::string::npos) << shown;
    EXPECT_EQ(page.find("As calibrated"), std::string::npos);  // the tree is not calibrated
    std::size_t pictures = 0;
    for (std::size_t at = page.find(" src=\""); at != std::string::npos; at = page.find(" src=\"", at + 1)) {
        EXPECT_EQ(page.substr(at + 6, 11), "data:image/");
        ++pictures;
    }
    EXPECT_EQ(pictures, 3u);
    for (const char* elsewhere : {"href=", "url(", "<script"})
        EXPECT_EQ(page.find(elsewhere), std::string::npos);
}

TEST_F(FiguresTest, RemapsARecordingToAFinerSurfaceOfTheSameTetrahedra) {
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

TEST_F(FiguresTest, RejectsInvalidNamesAndUnreadableFiles) {
    const auto refused = [](const std::string& bodies, int status, const std::string& says) {
        const std::string said = error("figures -o none -q " + bodies, status);
        EXPECT_NE(said.find(says), std::string::npos) << said;
        EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
    };
    refused("--body a/b tree.h5 data.h5", 2, "the name is 'a/b'; allowed: letters, digits, - and _");
    refused("--body BOX none.h5 data.h5", 1, "none.h5");
    refused("--body A tree.h5 data.h5 --body A tree.h5 data.h5", 2, "the name 'A' is used twice");
    EXPECT_FALSE(std::filesystem::exists(folder() / "none"));
}

}  // namespace
}  // namespace nbd::test
