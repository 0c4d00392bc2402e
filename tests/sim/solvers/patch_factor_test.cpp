#include "sim/solvers/patch_factor.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/sim/solvers/twisted_bars.hpp"

namespace nbd {
namespace {

/// The nodes of couplings `first` on.
std::vector<char> coupled_nodes(const CoupledSystem& system, std::size_t first) {
    std::vector<char> inside(system.node_count(), 0);
    for (std::size_t c = first; c < system.couplings.size(); ++c)
        for (const CouplingTerm& term : system.terms_of(system.couplings[c]))
            inside[static_cast<std::size_t>(term.unknown / 3)] = 1;
    return inside;
}

/// Clears a residual on a patch, and holds what is left against the true one.
void expect_cleared(PatchFactor& patch, const test::TwistedBars& scene, const CouplingSum& couplings,
                    const std::vector<char>& inside) {
    const CoupledSystem system = scene.system();
    Eigen::VectorXd v = Eigen::VectorXd::LinSpaced(scene.b.size(), -1, 1), product(v.size());
    system.multiply(v, product);
    Eigen::VectorXd r = scene.b - product;
    const double before = r.norm();
    Eigen::VectorXd taken = Eigen::VectorXd::Zero(v.size());
    patch.take_residual(system, couplings, v, taken);
    for (Eigen::Index i = 0; i < v.size(); ++i)
        if (inside[static_cast<std::size_t>(i / 3)]) {
            EXPECT_NEAR(taken[i], -product[i], 1e-5 * before);
        } else {
            EXPECT_EQ(taken[i], 0);
        }
    patch.clear(system, r, v);
    system.multiply(v, product);
    EXPECT_LT((r - (scene.b - product)).norm(), 1e-5 * before);  // matrices are in single precision
    for (Eigen::Index i = 0; i < system.node_count(); ++i)
        EXPECT_TRUE(!inside[i] || r.segment<3>(3 * i).isZero(0)) << i;
}

TEST(PatchFactor, ClearsTheResidualOnItsNodes) {
    test::TwistedBars scene(1, 100);
    for (std::size_t c = 0; c < 12; ++c) scene.couplings[c].A.setZero();  // do not act
    const CoupledSystem system = scene.system();
    CouplingSum couplings;
    couplings.begin(system);
    couplings.update(system);
    PatchFactor patch(Ordering::quick);
    const std::vector<char> few = coupled_nodes(system, 12), none(few.size(), 0);
    patch.begin();
    patch.factorize(system, couplings, few);
    expect_cleared(patch, scene, couplings, few);

    std::vector<char> more = few;
    std::fill_n(more.begin(), 40, char{1});  // prescribed nodes, too
    patch.factorize(system, couplings, more);
    expect_cleared(patch, scene, couplings, more);
    patch.factorize(system, couplings, few);  // keeps the others
    expect_cleared(patch, scene, couplings, more);

    patch.begin();
    patch.factorize(system, couplings, few);
    expect_cleared(patch, scene, couplings, few);
    EXPECT_EQ(patch.node_count(), std::ranges::count(few, 1));

    const test::TwistedBars apart(1);
    CouplingSum nothing;
    nothing.begin(apart.system());
    nothing.update(apart.system());
    patch.begin();
    patch.factorize(apart.system(), nothing, none);
    EXPECT_TRUE(patch.empty());
    expect_cleared(patch, apart, nothing, none);
}

}  // namespace
}  // namespace nbd
