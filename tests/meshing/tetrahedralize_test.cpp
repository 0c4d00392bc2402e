#include "meshing/tets/tetrahedralize.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <array>
#include <limits>
#include <thread>
#include <vector>

#include "meshing/formats/read_surface.hpp"
#include "meshing/tets/tet_quality.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

std::filesystem::path shared(const std::string& name) {
    return std::filesystem::path(NBD_SHARED_MESHES) / (name + ".obj");
}

/// A unit cube with n x n squares on each side.
TriMesh box(int n, double side = 1) { return test::box(side, side, side, n); }

void expect_keeps_surface(const TriMesh& surface, const TetMesh& tets) {
    ASSERT_GT(tets.T.rows(), 0);
    EXPECT_EQ(tets.X.topRows(surface.X.rows()), surface.X);
    EXPECT_EQ(test::sorted_faces(boundary_faces(tets)), test::sorted_faces(surface.F));
    EXPECT_GT(tet_quality(tets).volume_min, 0);
}

std::string error_of(const TriMesh& surface, const TetrahedralizeConfig& config = {}) {
    return test::error_of([&] { tetrahedralize(surface, config); });
}

TEST(Tetrahedralize, KeepsTheSurfaceBitForBitAtAnyScale) {
    for (const double side : {1e-5, 0.3, 7e6}) {
        const TriMesh surface = box(4, side);
        const auto result = tetrahedralize(surface);
        expect_keeps_surface(surface, result.tets);
        EXPECT_NEAR(tet_quality(result.tets).volume, side * side * side, 1e-12 * side * side * side);
        EXPECT_GT(result.tets.X.rows(), surface.X.rows());
    }
}

TEST(Tetrahedralize, GivesTheSameBitsEveryTime) {
    const TriMesh surface = box(6);
    const auto first = tetrahedralize(surface, {.nodes = 400});
    const auto second = tetrahedralize(surface, {.nodes = 400});
    EXPECT_EQ(first.tets.X, second.tets.X);
    EXPECT_EQ(first.tets.T, second.tets.T);
    EXPECT_EQ(first.grading, second.grading);
}

TEST(Tetrahedralize, CanBeCalledFromSeveralThreads) {
    const TriMesh surface = box(5);
    const TetMesh alone = tetrahedralize(surface).tets;
    std::array<TetMesh, 4> together;
    std::vector<std::thread> threads;
    for (TetMesh& tets : together) threads.emplace_back([&] { tets = tetrahedralize(surface).tets; });
    for (std::thread& thread : threads) thread.join();
    for (const TetMesh& tets : together) {
        EXPECT_EQ(tets.X, alone.X);
        EXPECT_EQ(tets.T, alone.T);
    }
}

TEST(Tetrahedralize, ReachesAGivenNumberOfNodes) {
    const TriMesh surface = box(8);  // 386 vertices
    for (const int nodes : {480, 600, 1000, 2000}) {
        const auto result = tetrahedralize(surface, {.nodes = nodes});
        expect_keeps_surface(surface, result.tets);
        EXPECT_NEAR(result.tets.X.rows(), nodes, 0.05 * nodes);
    }
}

TEST(Tetrahedralize, NamesTheAllowedRangeOfNodeNumbers) {
    const TriMesh surface = box(8);
    for (const int nodes : {1, 386, 20000, 2000000000}) {
        const std::string error = error_of(surface, {.nodes = nodes});
        EXPECT_TRUE(error.starts_with(
            std::to_string(nodes) + " nodes are not possible; allowed for a surface of 386 vertices: about "))
            << error;
    }
}

TEST(Tetrahedralize, LeavesNoSideEffectsOfGmsh) {
    rlimit before{}, after{};
    getrlimit(RLIMIT_STACK, &before);
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    tetrahedralize(box(3));
    TriMesh crossed = box(3);
    crossed.X.row(0) += Eigen::RowVector3d(0.5, 0.5, 2);  // a corner pulled through the opposite side
    const std::string error = error_of(crossed);
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    getrlimit(RLIMIT_STACK, &after);
    EXPECT_EQ(after.rlim_cur, before.rlim_cur);
    EXPECT_TRUE(error.starts_with("gmsh")) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos);
}

TEST(Tetrahedralize, RejectsInputThatGmshAcceptsSilentlyOrCrashesOn) {
    TriMesh flipped = box(3);
    flipped.F.col(0).swap(flipped.F.col(1));
    EXPECT_NE(error_of(flipped).find("did not keep the surface's triangles"), std::string::npos)
        << error_of(flipped);

    TriMesh nested = box(4);
    const TriMesh inner = box(1, 0.2);
    nested.X.conservativeResize(nested.X.rows() + 8, 3);
    nested.X.bottomRows(8) = inner.X.rowwise() + Eigen::RowVector3d(0.4, 0.4, 0.4);
    nested.F.conservativeResize(nested.F.rows() + 12, 3);
    nested.F.bottomRows(12) = inner.F.array() + int(nested.X.rows() - 8);
    EXPECT_NE(error_of(nested), "") << "a box within a box, both outward";
    nested.F.bottomRows(12).col(0).swap(nested.F.bottomRows(12).col(1));
    EXPECT_EQ(error_of(nested), "") << "a cavity";

    TriMesh open = box(3);
    open.F.conservativeResize(open.F.rows() - 1, 3);
    EXPECT_TRUE(error_of(open).starts_with("gmsh cannot fill the surface: ")) << error_of(open);

    TriMesh loose = box(3);
    loose.X.conservativeResize(loose.X.rows() + 1, 3);
    loose.X.row(loose.X.rows() - 1).setConstant(0.4);
    EXPECT_NE(error_of(loose), "");

    TriMesh infinite = box(3);
    infinite.X(7, 1) = std::numeric_limits<double>::infinity();
    EXPECT_TRUE(error_of(infinite).starts_with("vertex 7 is not finite: (")) << error_of(infinite);

    TriMesh beyond = box(3);
    beyond.F(5, 2) = 99;
    EXPECT_EQ(error_of(beyond), "face 5 refers to vertex 99, but the surface has 56 vertices");

    EXPECT_EQ(error_of(TriMesh{}), "a closed surface has at least 4 faces");
}

TEST(Tetrahedralize, RejectsAnInvalidConfig) {
    EXPECT_EQ(error_of(box(2), {.nodes = -1}), "nodes is -1; allowed: 0 or more");
    EXPECT_EQ(error_of(box(2), {.tolerance = 0}), "tolerance is 0; allowed: between 0 and 1");
    EXPECT_EQ(error_of(box(2), {.grading = 3}), "grading is 3; allowed: 0 to 2");
}

class PaperMesh : public testing::TestWithParam<std::pair<const char*, int>> {};

TEST_P(PaperMesh, ReachesThePapersNumberOfNodes) {
    const auto [name, nodes] = GetParam();
    if (!std::filesystem::exists(shared(name))) GTEST_SKIP() << shared(name) << " does not exist";
    const TriMesh surface = read_surface(shared(name));
    const auto result = tetrahedralize(surface, {.nodes = nodes});
    expect_keeps_surface(surface, result.tets);
    EXPECT_NEAR(result.tets.X.rows(), nodes, 0.01 * nodes);
    EXPECT_GT(tet_quality(result.tets).radius_ratio_min, 0.1);
}

INSTANTIATE_TEST_SUITE_P(Table1, PaperMesh,
                         testing::Values(std::pair("armadillo", 10518), std::pair("bunny", 5988)),
                         [](const auto& info) { return std::string(info.param.first); });

class SharedMesh : public testing::TestWithParam<const char*> {};

TEST_P(SharedMesh, IsFilledWithoutChangingItsSurface) {
    if (!std::filesystem::exists(shared(GetParam()))) GTEST_SKIP() << shared(GetParam()) << " does not exist";
    const TriMesh surface = read_surface(shared(GetParam()));
    const auto result = tetrahedralize(surface);
    expect_keeps_surface(surface, result.tets);
    EXPECT_GT(tet_quality(result.tets).radius_ratio_mean, 0.7);
}

INSTANTIATE_TEST_SUITE_P(All, SharedMesh, testing::Values("spot", "scorpion", "gear", "ring"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace nbd
