#include <gtest/gtest.h>

#include <cmath>

#include "collision/nbd_tree/nbd_bound.hpp"
#include "tests/collision/models.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

/// The network by the definition at the class, in double precision.
Eigen::Vector4d reference(const NbdModel& model, int node, const Eigen::VectorXf& zn) {
    const std::vector<float> weights = model.networks.weights();
    const float* w = weights.data() + node * model.networks.weight_count();
    const auto layer = [&](int out, const Eigen::VectorXd& x) -> Eigen::VectorXd {
        const Eigen::MatrixXd W = Eigen::Map<const Eigen::MatrixXf>(w, out, x.size()).cast<double>();
        w += out * x.size();
        const Eigen::VectorXd b = Eigen::Map<const Eigen::VectorXf>(w, out).cast<double>();
        w += out;
        return W * x + b;
    };
    const Eigen::VectorXd h1 = layer(model.networks.hidden(), zn.cast<double>()).cwiseMax(0);
    const Eigen::VectorXd h2 = layer(model.networks.hidden(), h1).cwiseMax(0);
    return layer(4, h2).cwiseProduct(model.out_scale.col(node).cast<double>()) +
           model.out_centre.col(node).cast<double>();
}

TEST(NbdSphere, AgreesWithTheNetworkForAnyWidths) {
    const auto s = shapes::torus(16, 10);
    const SphereTree tree = build_sphere_tree(s.X, s.F, {.depth = 3});
    for (const int modes : {1, 3, 30, 128})
        for (const int hidden : {1, 7, 32, 33, 128}) {
            const NbdModel model =
                shapes::random_model(tree, shapes::make_modes(s, modes, 60, 1).clustered, hidden, 2);
            check_nbd_model(model, tree, s.X.rows());
            std::mt19937 random(3);
            const Eigen::VectorXf zn =
                Eigen::VectorXf::NullaryExpr(modes, [&](Eigen::Index) { return shapes::uniform(random); });
            for (int node = 0; node < std::ssize(tree.nodes); ++node) {
                const Eigen::Vector4d delta = reference(model, node, zn);
                const Sphere& rest = tree.rest[node];
                const Sphere sphere = shapes::nbd_sphere(model, tree, node, shapes::fixed(zn));
                EXPECT_NEAR((sphere.c - rest.c - delta.head<3>().cast<float>()).norm(), 0, 4e-3)
                    << modes << ' ' << hidden;
                EXPECT_NEAR(sphere.r, std::max(0., rest.r + delta[3]), 4e-3) << modes << ' ' << hidden;
            }
        }
}

TEST(NbdSphere, MatchesTheKnownSphereOfKnownWeights) {
    // One mode: the first hidden unit passes max(z, 0), the second max(-z, 0), through both layers.
    const auto s = shapes::sphere(6, 8);
    const SphereTree tree = build_sphere_tree(s.X, s.F, {.depth = 1});
    NbdModel model = shapes::random_model(tree, shapes::make_modes(s, 1, 10, 1).clustered, 2, 2);
    std::vector<float> weights(3 * static_cast<std::size_t>(model.networks.weight_count()), 0.f);
    float* w = weights.data() + 2 * model.networks.weight_count();  // node 2
    w[0] = 1, w[1] = -1;                                            // W1 [2, 1]
    w[4] = 1, w[7] = 1;                                             // W2 [2, 2] after b1
    w[10] = 2, w[11 + 2] = 5, w[14 + 1] = 3;                        // W3 [4, 2] after b2
    model.networks = NbdNetworks(1, 2, weights);
    model.out_scale.setConstant(0.1f);
    model.out_centre.setConstant(0.01f);
    const auto at = [&](int node, float z) {
        return shapes::nbd_sphere(model, tree, node, shapes::fixed(Eigen::VectorXf::Constant(1, z)));
    };
    const Sphere& rest = tree.rest[2];
    EXPECT_NEAR((at(2, 0.5f).c - rest.c - Eigen::Vector3f(0.11f, 0.01f, 0.01f)).norm(), 0, 1e-5);
    EXPECT_NEAR(at(2, 0.5f).r, rest.r + 0.01f + 0.25f, 1e-5);
    EXPECT_NEAR((at(2, -0.5f).c - rest.c - Eigen::Vector3f(0.01f, 0.16f, 0.01f)).norm(), 0, 1e-5);
    EXPECT_NEAR(at(2, -0.5f).r, rest.r + 0.01f, 1e-6);
    EXPECT_NEAR(at(1, 0.5f).r, tree.rest[1].r + 0.01f, 1e-6);
}

TEST(NbdSphere, AddsTheLinearPartToItsCentre) {
    const auto s = shapes::sphere(6, 8);
    const SphereTree tree = build_sphere_tree(s.X, s.F, {.depth = 1});
    NbdModel model = shapes::random_model(tree, shapes::make_modes(s, 3, 10, 1).clustered, 32, 2);
    const FixedVector zn = shapes::fixed(Eigen::Vector3f(0.5f, -1, 0.25f));
    const Sphere without = shapes::nbd_sphere(model, tree, 2, zn);
    Eigen::MatrixXf map = Eigen::MatrixXf::Zero(3, 9);
    map.col(6) << 1, 0, 0;
    map.col(8) << 0, 1, 4;
    model.centre_map = FixedMatrix(map);
    const Sphere with = shapes::nbd_sphere(model, tree, 2, zn);
    EXPECT_NEAR((with.c - without.c - Eigen::Vector3f(0.5f, 0, 0)).norm(), 0, 1e-6);
    EXPECT_EQ(with.r, without.r);
}

TEST(NbdSphere, NeverHasANegativeRadius) {
    const auto s = shapes::sphere(6, 8);
    const SphereTree tree = build_sphere_tree(s.X, s.F, {.depth = 1});
    NbdModel model = shapes::random_model(tree, shapes::make_modes(s, 3, 10, 1).clustered, 32, 2);
    model.out_centre.row(3).setConstant(-10);
    EXPECT_EQ(shapes::nbd_sphere(model, tree, 0, FixedVector(3)).r, 0);
}

TEST(CheckNbdModel, ReportsEachKindOfInvalidModel) {
    const auto s = shapes::sphere(6, 8);
    const SphereTree tree = build_sphere_tree(s.X, s.F, {.depth = 1});
    const NbdModel whole = shapes::random_model(tree, shapes::make_modes(s, 3, 10, 1).clustered, 8, 2);
    const auto error = [&](auto tamper) {
        NbdModel model = whole;
        tamper(model);
        return test::refusal([&] { check_nbd_model(model, tree, 50); });
    };
    using M = NbdModel;
    EXPECT_EQ(error([](M&) {}), "");
    EXPECT_EQ(error([](M& m) { m.modes.w[0] = -1; }), "modes: weight 0 is -1, allowed: finite and above 0");
    EXPECT_EQ(error([](M& m) { m.networks = {}; }), "NBD-Tree: has 0 networks of 0 inputs instead of 3 of 3");
    EXPECT_EQ(error([](M& m) {
                  m.networks = NbdNetworks(2, 1, std::vector<float>(3 * NbdNetworks::weight_count(2, 1)));
              }),
              "NBD-Tree: has 3 networks of 2 inputs instead of 3 of 3");
    EXPECT_EQ(error([](M& m) { m.z_scale.conservativeResize(2); }),
              "NBD-Tree: z_centre and z_scale have 3 and 2 entries instead of 3");
    EXPECT_EQ(error([](M& m) { m.z_centre[1] = INFINITY; }),
              "NBD-Tree: the scaling of the modal coordinates is not finite");
    EXPECT_EQ(error([](M& m) { m.out_scale.conservativeResize(4, 2); }),
              "NBD-Tree: the scaling of the outputs is 4 x 2 instead of 4 x 3");
    EXPECT_EQ(error([](M& m) { m.out_centre.conservativeResize(3, 3); }),
              "NBD-Tree: the scaling of the outputs is 3 x 3 instead of 4 x 3");
    EXPECT_EQ(error([](M& m) { m.centre_map = FixedMatrix(Eigen::MatrixXf::Zero(3, 9)); }), "");
    EXPECT_EQ(error([](M& m) { m.centre_map = FixedMatrix(Eigen::MatrixXf::Zero(3, 8)); }),
              "NBD-Tree: the linear part of the centres is 3 x 8 instead of 3 x 9");
    EXPECT_EQ(error([](M& m) { m.centre_map = FixedMatrix(Eigen::MatrixXf::Constant(3, 9, NAN)); }),
              "NBD-Tree: the linear part of the centres is not finite");
    EXPECT_EQ(error([](M& m) {
                  m.z_mean.setZero(3);
                  m.z_whitening.setZero(3, 3);
              }),
              "");
    EXPECT_EQ(error([](M& m) { m.z_mean.setZero(3); }),
              "NBD-Tree: the spread of the modal coordinates has a mean of 3 numbers and 0 x 0 more, "
              "allowed: 3 and 3 x 3, "
              "or none");
    EXPECT_EQ(error([](M& m) {
                  m.z_mean.setZero(3);
                  m.z_whitening.setConstant(3, 3, INFINITY);
              }),
              "NBD-Tree: the spread of the modal coordinates is not finite");
    EXPECT_EQ(error([](M& m) { m.out_centre(0, 0) = NAN; }),
              "NBD-Tree: the scaling of the outputs is not finite");
}

}  // namespace
}  // namespace nbd
