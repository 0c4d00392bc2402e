#include "training/files/surface_body.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace nbd {
namespace {

/// Three surface vertices on two nodes: the nodes themselves and the point a quarter of the way between them.
SurfaceEmbedding quarter() {
    SurfaceEmbedding W(3, 2);
    const std::vector<Eigen::Triplet<float>> entries{{0, 0, 1.f}, {1, 1, 1.f}, {2, 0, 0.75f}, {2, 1, 0.25f}};
    W.setFromTriplets(entries.begin(), entries.end());
    return W;
}

TEST(SurfaceBody, EmbedsPositionsAndModesAlike) {
    Vertices nodes(2, 3);
    nodes << 0, 0, 0, 4, 8, -4;
    Vertices x;
    apply_embedding(quarter(), nodes, x);
    EXPECT_EQ(x.row(1), nodes.row(1));
    EXPECT_EQ(x.row(2), Eigen::RowVector3f(1, 2, -1));

    Eigen::MatrixXf modes(6, 1);
    modes << 0, 0, 0, 4, 8, -4;
    const SurfaceBody body = make_surface_body(x, Faces{{0, 1, 2}}, quarter(), modes, "hash");
    EXPECT_EQ(body.U.transpose(), (Eigen::RowVectorXf(9) << 0, 0, 0, 4, 8, -4, 1, 2, -1).finished());
}

TEST(SurfaceBody, RejectsInvalidShapes) {
    const Faces F{{0, 1, 2}};
    const Vertices X = Vertices::Zero(3, 3), four = Vertices::Zero(4, 3);
    EXPECT_THROW(make_surface_body(four, F, quarter(), Eigen::MatrixXf::Zero(6, 1), ""),
                 std::invalid_argument);
    EXPECT_THROW(make_surface_body(X, F, quarter(), Eigen::MatrixXf::Zero(9, 1), ""), std::invalid_argument);
    Eigen::MatrixXf modes = Eigen::MatrixXf::Zero(6, 1);
    modes(3) = NAN;
    EXPECT_THROW(make_surface_body(X, F, quarter(), modes, ""), std::invalid_argument);
}

}  // namespace
}  // namespace nbd
