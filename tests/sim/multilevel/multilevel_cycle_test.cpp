#include "sim/multilevel/multilevel_cycle.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <utility>

#include "tests/support/box_mesh.hpp"
#include "tests/support/on_threads.hpp"

namespace nbd {
namespace {

/// A bent bar, held at an end, small ones, and stiff springs between it and them.
struct Scene {
    ElasticBody large{test::box_mesh({2, 0.4, 0.4}, {30, 6, 6}), {.young = 1e5}}, small;
    std::vector<StepSystem> systems;
    std::vector<int> first_unknown{0};
    std::vector<CouplingTerm> terms;
    std::vector<Coupling> couplings;

    /// cells: of the small bodies, along each edge.
    explicit Scene(int small_bodies = 1, int cells = 2)
        : small(test::box_mesh({0.4, 0.4, 0.4}, {cells, cells, cells}), {.young = 1e6}) {
        add(large);
        systems[0].prescribe({.nodes = {0, 1, 2, 3}, .v = Nodes::Zero(4, 3)});
        for (int b = 1; b <= small_bodies; ++b) {
            add(small);
            for (int k = 4; k < 20; ++k) connect(b, k);
        }
    }
    void add(const ElasticBody& body) {
        BodyState state{body.rest().X, Nodes::Zero(body.node_count(), 3)};
        state.x.col(1) = state.x.col(1).array() + 0.3 * state.x.col(0).array().square();
        systems.emplace_back(body);
        systems.back().assemble(StepStart(state), 0.01, {});
        first_unknown.push_back(first_unknown.back() + body.unknown_count());
    }
    /// A spring between the middle of nodes k and k + 1 of a small body and a node of the large one.
    void connect(int body, int k) {
        const int first = first_unknown[body], node = 20 * k + body - 1;
        terms.push_back({0, node, 3 * node, 1, false});
        terms.push_back({body, k, first + 3 * k, -0.5, false});
        terms.push_back({body, k + 1, first + 3 * (k + 1), -0.5, false});
        const Eigen::Vector3d n = Eigen::Vector3d(std::sin(k), std::cos(k), 0.3).normalized();
        const int end = terms.size();
        couplings.push_back({end - 3, end, 100 * n * n.transpose()});
    }
    CoupledSystem system() const { return {systems, first_unknown, terms, couplings}; }
};

/// The cycle of a scene, whose couplings act or not.
struct CoupledCycle {
    RestHierarchies hierarchies;
    CouplingSum couplings;
    MultilevelCycle cycle;

    explicit CoupledCycle(const Scene& scene, bool acts = true) { begin(scene.system(), acts); }
    void begin(const CoupledSystem& system, bool acts = true) {
        cycle.begin(system, hierarchies);
        couplings.begin(system);
        if (acts) couplings.update(system);
        cycle.set_couplings(couplings);
    }
    void update(const CoupledSystem& system) {
        couplings.update(system);
        cycle.set_couplings(couplings);
    }
};

Eigen::VectorXf irregular(Eigen::Index size, double phase) {
    Eigen::VectorXf v(size);
    for (Eigen::Index i = 0; i < size; ++i)
        v[i] = static_cast<float>(std::sin(phase + 12.9898 * static_cast<double>(i * i % 7919)));
    return v;
}

/// Numbers of small bodies and of their cells along an edge.
class MultilevelCycleOf : public ::testing::TestWithParam<std::pair<int, int>> {
 protected:
    const Scene scene{GetParam().first, GetParam().second};
};

/// As a matrix G, it has a . G b = b . G a and a . G a > 0.
void expect_symmetric_and_positive(MultilevelCycle& cycle, Eigen::Index size) {
    const Eigen::VectorXf a = irregular(size, 0.3), b = irregular(size, 1.7);
    Eigen::VectorXf Ga(size), Gb(size);
    cycle.apply(a, Ga);
    cycle.apply(b, Gb);
    const auto dot = [](const Eigen::VectorXf& u, const Eigen::VectorXf& v) {
        return u.cast<double>().dot(v.cast<double>());
    };
    EXPECT_NEAR(dot(Ga, b), dot(Gb, a), 1e-4 * Ga.norm() * b.norm());
    EXPECT_GT(dot(Ga, a), 0);
    EXPECT_GT(dot(Gb, b), 0);
}

/// What it leaves is r - A z, with the couplings as they are in the scene.
void expect_residual_of_its_result(MultilevelCycle& cycle, const Scene& scene) {
    const Eigen::VectorXf r = irregular(scene.system().size(), 0.5);
    Eigen::VectorXf z(r.size()), residual(r.size());
    cycle.apply(r, z);
    cycle.take_residual(residual);
    Eigen::VectorXd product(r.size());
    scene.system().multiply(z.cast<double>(), product);
    EXPECT_LT((residual.cast<double>() - (r.cast<double>() - product)).norm(), 1e-5 * r.norm());
}

TEST_P(MultilevelCycleOf, IsSymmetricAndPositiveAndLeavesTheResidualOfItsResult) {
    for (const bool acts : {false, true}) {
        Scene scene = this->scene;
        CoupledCycle coupled(scene, acts);
        expect_symmetric_and_positive(coupled.cycle, scene.system().size());
        if (!acts)
            for (Coupling& coupling : scene.couplings) coupling.A.setZero();
        expect_residual_of_its_result(coupled.cycle, scene);
    }
}

TEST_P(MultilevelCycleOf, ReducesEveryKindOfError) {
    CoupledCycle coupled(scene);
    // The error e of an iteration v += G (b - A v) is (I - G A) e, in the norm of A.
    Eigen::VectorXd e = irregular(scene.system().size(), 0.1).cast<double>(), Ae(e.size());
    for (const StepSystem& s : scene.systems)
        for (int i = 0; i < s.body().node_count(); ++i)
            if (s.is_prescribed(i)) e.segment<3>(3 * i).setZero();
    Eigen::VectorXf z(e.size());
    double share = 0;
    for (int k = 0; k < 30; ++k) {  // leaves the kind that the cycle reduces least
        scene.system().multiply(e, Ae);
        const double before = std::sqrt(e.dot(Ae));
        coupled.cycle.apply((Ae / before).cast<float>(), z);
        e -= before * z.cast<double>();
        scene.system().multiply(e, Ae);
        share = std::sqrt(e.dot(Ae)) / before;
        e /= std::sqrt(e.dot(Ae));
    }
    EXPECT_LT(share, 0.97);  // the springs at the surface decide: 0.92 to 0.95
}

INSTANTIATE_TEST_SUITE_P(, MultilevelCycleOf,
                         ::testing::Values(std::pair(1, 2), std::pair(250, 2), std::pair(40, 6)),
                         [](const auto& info) { return fmt::format("{}SmallBodies", info.param.first); });

TEST(MultilevelCycle, FactorisesFewAggregatesOfManyBodies) {
    for (const auto& [bodies, cells] : {std::pair(40, 6), std::pair(100, 4)}) {
        const Scene scene(bodies, cells);
        RestHierarchies hierarchies;
        const StepSystem& small = scene.systems[1];
        const auto hierarchy =
            hierarchies.get(scene.small, small.mass_scale(), small.stiffness_scale(), small.prescribed());
        const std::size_t depth = hierarchy->depth(RestHierarchy::coarse_enough);
        EXPECT_GT(bodies * hierarchy->levels[depth - 1].A.rows(), 4 * RestHierarchy::coarse_enough)
            << "the test wants so many that the bodies are coarsened further";
        MultilevelCycle cycle;
        cycle.begin(scene.system(), hierarchies);
        EXPECT_LE(cycle.coarsest_rows(), 4 * RestHierarchy::coarse_enough);
    }
}

/// A cycle that follows most couplings but not all is still symmetric, and its residual that of its result.
TEST(MultilevelCycle, MayKeepCoarserLevelsOfFormerCouplings) {
    Scene scene;
    CoupledCycle coupled(scene);
    scene.couplings[3].A.setZero();
    coupled.update(scene.system());
    expect_symmetric_and_positive(coupled.cycle, scene.system().size());
    expect_residual_of_its_result(coupled.cycle, scene);
}

TEST(MultilevelCycle, FollowsOnceAFifthOfTheCouplingsAreOthersOrOfOtherStrength) {
    const Scene scene;
    const auto after = [&](int changed, double factor) {
        Scene other = scene;
        for (int c = 0; c < changed; ++c) other.couplings[c].A *= factor;
        CoupledCycle updated(scene), fresh(other);
        updated.update(other.system());
        const Eigen::VectorXf r = irregular(scene.system().size(), 0.6);
        Eigen::VectorXf z(r.size()), expected(r.size());
        updated.cycle.apply(r, z);
        fresh.cycle.apply(r, expected);
        return (z - expected).norm() / expected.norm();
    };
    ASSERT_EQ(scene.couplings.size(), 16u);
    EXPECT_GT(after(1, 0), 1e-4) << "kept those of before";
    EXPECT_LT(after(8, 0), 1e-5) << "has the present ones";
    EXPECT_GT(after(8, 1.5), 1e-4);
    EXPECT_LT(after(8, 3), 1e-5);
}

/// Couplings that acted before change nothing, so that a run that continues has the same bits.
TEST(MultilevelCycle, DependsOnTheCurrentCouplingsAlone) {
    Scene scene;
    CoupledCycle coupled(scene);
    const Eigen::VectorXf r = irregular(scene.system().size(), 0.4);
    Eigen::VectorXf with(r.size()), z(r.size()), expected(r.size());
    coupled.cycle.apply(r, with);
    std::vector<Coupling> none = scene.couplings;
    for (Coupling& coupling : none) coupling.A.setZero();
    const CoupledSystem uncoupled{scene.systems, scene.first_unknown, scene.terms, none};
    coupled.update(uncoupled);  // the places of the couplings are kept for the step
    coupled.begin(uncoupled);
    coupled.cycle.apply(r, z);
    CoupledCycle fresh(scene, false);
    fresh.cycle.apply(r, expected);
    EXPECT_EQ(z, expected);
    EXPECT_NE(z, with);
    coupled.begin(scene.system());
    coupled.begin({scene.systems, scene.first_unknown, {}, {}});
    coupled.cycle.apply(r, z);
    EXPECT_EQ(z, expected) << "where there are no couplings at all";
}

/// The numbers of such a matrix are far below one.
TEST(MultilevelCycle, SolvesTinyBodiesInShortSteps) {
    const ElasticBody tiny(test::box_mesh({0.002, 0.002, 0.002}, {2, 2, 2}), {.young = 1e4});
    std::vector<StepSystem> systems;
    systems.emplace_back(tiny);
    systems[0].assemble(StepStart({tiny.rest().X, Nodes::Zero(tiny.node_count(), 3)}), 1e-3, {});
    const std::vector<int> first{0, tiny.unknown_count()};
    RestHierarchies hierarchies;
    MultilevelCycle cycle;
    cycle.begin({systems, first, {}, {}}, hierarchies);
    cycle.set_couplings({});
    Eigen::VectorXd e = irregular(tiny.unknown_count(), 0.2).cast<double>(), Ae(e.size());
    Eigen::VectorXf z(e.size());
    for (int k = 0; k < 20; ++k) {
        systems[0].multiply(e, Ae);
        const double before = std::sqrt(e.dot(Ae));
        cycle.apply((Ae / before).cast<float>(), z);
        e -= before * z.cast<double>();
        systems[0].multiply(e, Ae);
        EXPECT_LT(std::sqrt(e.dot(Ae)), 0.9 * before);
        e /= std::sqrt(e.dot(Ae));
    }
}

TEST(RestHierarchies, ABodyAtThePlaceOfOneThatIsGoneHasItsOwn) {
    RestHierarchies hierarchies;
    const auto of = [&](const ElasticBody& body) {
        return hierarchies.get(body, 1, 1e-4, std::vector<char>(body.node_count(), 0));
    };
    const TetMesh box = test::box_mesh({1, 0.4, 0.4}, {5, 2, 2});
    std::optional<ElasticBody> place;
    place.emplace(box, Material{.young = 1e4});
    const ElasticBody* const address = &*place;
    const ElasticBody copy = *place;
    const auto soft = of(*place);
    EXPECT_EQ(of(*place), soft);
    EXPECT_EQ(of(copy), soft);
    place.emplace(box, Material{.young = 1e7});
    ASSERT_EQ(&*place, address);
    EXPECT_NE(of(*place), soft);
}

TEST(RestHierarchy, GoesDownToAFewAggregates) {
    const Scene scene;
    const RestHierarchy hierarchy(scene.large, 1, 1e-4, scene.systems[0].prescribed());
    const std::size_t depth = hierarchy.depth(RestHierarchy::coarse_enough);
    ASSERT_GT(depth, 1u);
    EXPECT_GT(hierarchy.levels[depth - 2].A.rows(), RestHierarchy::coarse_enough);
    EXPECT_EQ(hierarchy.depth(1), hierarchy.levels.size());
    EXPECT_LE(hierarchy.levels.back().A.rows(), 4);
    for (std::size_t k = depth; k <= hierarchy.levels.size(); ++k) {
        const RestLevel& level = hierarchy.levels[k - 1];
        EXPECT_LE(level.A.rows(), RestHierarchy::coarse_enough);
        EXPECT_EQ(level.to_factorize.rows(), level.A.rows()) << "every small level can be factorised";
    }
}

TEST(MultilevelCycle, GivesTheSameBitsOnAnyNumberOfThreads) {
    const Scene scene;
    struct Result {
        Eigen::VectorXf z, residual;
    } one, four;
    const auto run = [&](Result& result) {
        const Eigen::VectorXf r = irregular(scene.system().size(), 0.5);
        result = {.z = r, .residual = r};
        CoupledCycle coupled(scene);
        coupled.cycle.apply(r, result.z);
        coupled.cycle.take_residual(result.residual);
    };
    test::on_threads(1, [&] { run(one); });
    test::on_threads(4, [&] { run(four); });
    EXPECT_EQ(one.z, four.z);
    EXPECT_EQ(one.residual, four.residual);
}

}  // namespace
}  // namespace nbd
