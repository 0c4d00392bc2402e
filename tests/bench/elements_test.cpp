#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <map>
#include <utility>
#include <vector>

#include "apps/bench/elements/element_study.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

Eigen::Matrix3d corner_edges(const TetMesh& mesh, Eigen::Index t) {
    const Eigen::Matrix<double, 4, 3> corners = mesh.X(mesh.T.row(t), Eigen::all);
    return corners.bottomRows<3>().rowwise() - corners.row(0);
}

/// One tetrahedron, whose edges all have different lengths.
TetMesh skewed_tet() {
    TetMesh tet{Nodes(4, 3), Tets(1, 4)};
    tet.X << 0.1, 0, 0, 1.2, 0.1, 0, 0.3, 0.9, -0.1, 0.2, 0.3, 1.1;
    tet.T << 0, 1, 2, 3;
    return tet;
}

TEST(QuadraticMesh, SplitsTetrahedraIntoEightEqualVolumes) {
    const TetMesh coarse = test::box_mesh({1, 0.7, 0.4}, {3, 3, 3}, 0.3);
    const TetMesh middle = make_quadratic(coarse);
    const TetMesh fine = split(middle);
    ASSERT_EQ(fine.T.rows(), 8 * coarse.T.rows());
    EXPECT_EQ(fine.X, middle.X);
    for (Eigen::Index t = 0; t < fine.T.rows(); ++t)
        EXPECT_NEAR(corner_edges(fine, t).determinant(), corner_edges(coarse, t / 8).determinant() / 8,
                    1e-15);
    EXPECT_EQ(boundary_faces(fine).rows(),
              4 * boundary_faces(coarse).rows());  // children fit their neighbours
}

/// Each of the three diagonals of the octahedron in the middle is the shortest one once.
TEST(QuadraticMesh, CutsTheMiddleAlongItsShortestDiagonal) {
    constexpr std::array<std::array<int, 2>, 3> diagonals{{{4, 9}, {5, 8}, {6, 7}}};
    std::array<int, 3> chosen{};
    for (const std::array<int, 4>& order : {std::array{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}}) {
        TetMesh tet = skewed_tet();
        for (int k = 0; k < 4; ++k) tet.T(0, k) = order[k];
        const TetMesh middle = make_quadratic(tet);
        const ElementNodes middle_nodes = nodes_of_tets(middle);
        const TetMesh fine = split(middle);
        for (Eigen::Index t = 0; t < 8; ++t)
            EXPECT_NEAR(corner_edges(fine, t).determinant(), corner_edges(tet, 0).determinant() / 8, 1e-15);
        const auto length = [&](const std::array<int, 2>& d) {
            return (middle.X.row(middle_nodes(0, d[0])) - middle.X.row(middle_nodes(0, d[1]))).norm();
        };
        const auto shortest = std::ranges::min_element(diagonals, {}, length);
        ++chosen[shortest - diagonals.begin()];
        int around = 0;
        for (Eigen::Index t = 0; t < 8; ++t)
            around += (fine.T.row(t).array() == middle_nodes(0, (*shortest)[0])).any() &&
                      (fine.T.row(t).array() == middle_nodes(0, (*shortest)[1])).any();
        EXPECT_EQ(around, 4);
    }
    EXPECT_EQ(chosen, (std::array{1, 1, 1}));
}

/// A cantilever of few tetrahedra.
Body cantilever() {
    Body body;
    body.name = "cantilever";
    body.tets = test::box_mesh({1, 0.2, 0.2}, {6, 1, 1});
    return body;
}

TEST(ElementStudy, BringsBothElementsToOneSolution) {
    Output out;
    out.quiet = true;
    const std::vector<ElementRow> rows = study_elements(cantilever(), {.levels = 2, .repeats = 1}, out);
    ASSERT_EQ(rows.size(), 7U);
    std::map<int, std::vector<const ElementRow*>> by_kind;
    for (const ElementRow& row : rows)
        if (!row.reference) by_kind[row.nodes_per_tet].push_back(&row);
    for (const auto& [kind, sequence] : by_kind)
        for (std::size_t k = 1; k < sequence.size(); ++k) {
            EXPECT_LT(sequence[k]->displacement, 0.7 * sequence[k - 1]->displacement) << kind << ' ' << k;
            EXPECT_LT(sequence[k]->energy, 0.9 * sequence[k - 1]->energy) << kind << ' ' << k;
        }
    // On the same nodes quadratic tetrahedra bend better.
    EXPECT_EQ(by_kind[4][1]->unknowns, by_kind[10][0]->unknowns);
    EXPECT_LT(by_kind[10][0]->displacement, 0.5 * by_kind[4][1]->displacement);
    EXPECT_TRUE(rows.back().reference);
    EXPECT_LT(rows.back().displacement, by_kind[10][1]->displacement);
}

TEST(ElementStudy, RefusesBodiesThatItCannotSplitOrHold) {
    Output out;
    Body body = cantilever();
    body.tets = test::box_mesh({1, 1, 1}, {20, 20, 20});
    EXPECT_EQ(test::error_of([&] { study_elements(body, {}, out); }),
              "cantilever: 48000 tetrahedra; allowed: at most 20000");
    body = cantilever();
    const TetMesh whole = body.tets;
    body.tets.X.conservativeResize(2 * whole.X.rows(), 3);
    body.tets.X.bottomRows(whole.X.rows()) = whole.X.rowwise() + Eigen::RowVector3d(2, 0, 0);
    body.tets.T.conservativeResize(2 * whole.T.rows(), 4);
    body.tets.T.bottomRows(whole.T.rows()) = whole.T.array() + int(whole.X.rows());
    EXPECT_TRUE(test::error_of([&] {
                    study_elements(body, {}, out);
                }).starts_with("cantilever: no equilibrium of 56 nodes: "));
}

TEST(EqualError, InterpolatesCostsInLogarithms) {
    const auto row = [](int kind, double error, int cost) {
        return ElementRow{.body = "b",
                          .nodes_per_tet = kind,
                          .unknowns = cost,
                          .nonzeros = 10 * cost,
                          .displacement = error,
                          .assembly = 1e-3 * cost};
    };
    const std::vector<ElementRow> rows{row(4, 0.4, 100), row(4, 0.1, 10'000), row(10, 0.2, 500),
                                       row(10, 0.05, 2000), row(10, 0.5, 50)};
    const auto within = equal_error(rows, rows[2], &ElementRow::displacement),
               beyond = equal_error(rows, rows[3], &ElementRow::displacement);
    ASSERT_TRUE(within && beyond);
    EXPECT_NEAR(within->unknowns, 2, 1e-12);  // 1000 of linear ones
    EXPECT_NEAR(within->nonzeros, 2, 1e-12);
    EXPECT_NEAR(within->milliseconds, 2, 1e-12);
    EXPECT_FALSE(within->at_least);
    EXPECT_NEAR(beyond->unknowns, 5, 1e-12);
    EXPECT_TRUE(beyond->at_least);
    EXPECT_FALSE(equal_error(rows, rows[4], &ElementRow::displacement));
}

}  // namespace
}  // namespace nbd
