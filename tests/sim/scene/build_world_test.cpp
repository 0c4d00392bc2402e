// Worlds that are built from scenes, and the check of scenes against their data.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "sim/scene/scene.hpp"
#include "sim/scene/scene_check.hpp"
#include "tests/sim/scene/scene_text.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::with;

LoadedBody box() { return {std::make_shared<const Body>(test::box_body({1, 0.4, 0.3}, {4, 2, 2})), nullptr}; }

/// The world of a scene with one body.
World built(const std::string& scene, const LoadedBody& loaded) {
    return build_world(parse_scene(scene, ""), std::span(&loaded, 1));
}

/// A box whose tetrahedra with even numbers are a region of the body.
LoadedBody box_with_region() {
    Body body = test::box_body({1, 0.4, 0.3}, {4, 2, 2});
    MaterialRegion even{.name = "even", .material = body.material, .tets = {}};
    for (int t = 0; t < body.tets.T.rows(); t += 2) even.tets.push_back(t);
    even.material.young = 7e5;
    body.regions = {even};
    return {std::make_shared<const Body>(std::move(body)), nullptr};
}

TEST(BuildWorld, GivesRegionsTheirMaterials) {
    // The last region lies around the end of the box at x = 0.5, which the transform moves to x = 2.5.
    const World world = built(R"({"bodies": [{"body": "a.h5", "transform": {"translate": [2, 0, 0]},
        "material": {"young": 2e5, "poisson": 0.25, "rayleigh_mass": 0.7}, "regions": [
            {"group": "even", "material": {"poisson": 0.1}},
            {"region": {"box": {"min": [2.24, -1, -1], "max": [9, 9, 9]}}, "material": {"law": "st_venant_kirchhoff"}}
        ]}]})",
                              box_with_region());
    const ElasticBody& elastic = world.elastic(0);
    int ends = 0;
    for (int t = 0; t < elastic.element_count(); ++t) {
        const auto& [law, mu, lambda] = elastic.moduli(t);
        if (test::centre(elastic.rest(), t)[0] > 0.24) {
            ++ends;
            EXPECT_EQ(law, MaterialLaw::st_venant_kirchhoff);
            EXPECT_DOUBLE_EQ(mu, 2e5 / 2.5);
        } else {
            EXPECT_EQ(law, MaterialLaw::corotated);
            EXPECT_DOUBLE_EQ(mu, t % 2 == 0 ? 7e5 / 2.2 : 2e5 / 2.5);
        }
    }
    EXPECT_EQ(ends, elastic.element_count() / 4);
    EXPECT_EQ(elastic.material().rayleigh_mass, 0.7);
}

TEST(BuildWorld, RegionsWithoutAMaterialOfTheirOwnFollowTheScene) {
    Body body = *box_with_region().body;
    body.regions[0].material = body.material;
    const LoadedBody loaded{std::make_shared<const Body>(body), nullptr};
    const World world = built(
        R"({"bodies": [{"body": "a.h5", "material": {"young": 3e4, "law": "stable_neo_hookean"}}]})", loaded);
    for (int t = 0; t < world.elastic(0).element_count(); ++t) {
        EXPECT_EQ(world.elastic(0).young(t), 3e4);
        EXPECT_EQ(world.elastic(0).moduli(t).law, MaterialLaw::stable_neo_hookean);
    }
}

TEST(BuildWorld, TheLastRegionOfATetrahedronWins) {
    const World world = built(R"({"bodies": [{"body": "a.h5", "regions": [
        {"region": {"sphere": {"centre": [0, 0, 0], "radius": 9}}, "material": {"young": 3e4}},
        {"group": "even", "material": {"poisson": 0.1}}]}]})",
                              box_with_region());
    for (int t = 0; t < world.elastic(0).element_count(); ++t)
        EXPECT_EQ(world.elastic(0).young(t), t % 2 == 0 ? 7e5 : 3e4);
}

TEST(BuildWorld, RejectsRegionsWithoutTetrahedra) {
    const LoadedBody loaded = box_with_region();
    const auto error = [&](const std::string& region) {
        const std::string scene = R"({"bodies": [{"body": "a.h5", "regions": [)" + region + "]}]}";
        return test::error_of<std::invalid_argument>([&] { built(scene, loaded); });
    };
    EXPECT_EQ(error(R"({"group": "odd"})"),
              "bodies[0] (a): regions[0]: the body has no group \"odd\"; allowed: even");
    EXPECT_EQ(error(R"({"region": {"sphere": {"centre": [9, 9, 9], "radius": 0.1}}})"),
              "bodies[0] (a): regions[0]: the region holds no centre of a tetrahedron of the body");
}

/// A body that falls onto a plane and a ball while a pin holds one end, all moved by `by`.
World moved_world(const Eigen::Vector3d& by, const LoadedBody& loaded) {
    const auto at = [&](double x, double y, double z) {
        return fmt::format("[{}, {}, {}]", x + by.x(), y + by.y(), z + by.z());
    };
    return built(
        with(fmt::format(R"("transform": {{"translate": {}, "rotate": {{"axis": [0, 0, 1], "degrees": 30}}}},
                            "pins": [{{"sphere": {{"centre": {}, "radius": 0.25}}}}],
                            "grips": [{{"region": {{"box": {{"min": {}, "max": {}}}}}, "centre": {},
                                        "rotate": {{"axis": [0, 0, 1], "degrees": 10}}, "duration": 0.05}}],
                            "regions": [{{"region": {{"box": {{"min": {}, "max": {}}}}}, "material": {{"young": 3e4}}}}])",
                         at(0, 0, 0.16), at(-0.45, -0.25, 0.16), at(0.3, 0, -1), at(1, 1, 1),
                         at(0.4, 0.25, 0.16), at(0, -1, -1), at(1, 1, 1)),
             fmt::format(
                 R"("obstacles": [{{"plane": {{"point": {}}}}}, {{"sphere": {{"centre": {}, "radius": 0.2}},
                     "centre": {}, "motion": [{{"time": 0}}, {{"time": 0.1, "rotate": {{"axis": [0, 1, 0], "degrees": 20}}}}]}}])",
                 at(3, 2, 0), at(0, 0, -0.191), at(0.3, 0, -0.191))),
        loaded);
}

TEST(BuildWorld, MovesAsNearZeroAThousandKilometresAway) {
    const Eigen::Vector3d far(1e6, -1e6, 2e5);
    World near_world = moved_world(Eigen::Vector3d::Zero(), box()), far_world = moved_world(far, box());
    EXPECT_EQ(near_world.origin(), Eigen::Vector3d::Zero());
    EXPECT_LT((far_world.origin() - far).cwiseAbs().maxCoeff(), 2);
    const Eigen::RowVector3d shift = (far - far_world.origin()).transpose();
    const Nodes start = near_world.state(0).x;
    int contacts = 0;
    for (int step = 0; step < 20; ++step) {
        const WorldReport a = near_world.step(5e-3), b = far_world.step(5e-3);
        ASSERT_EQ(a.failure + b.failure, "");
        EXPECT_EQ(a.contacts, b.contacts);
        contacts += a.contacts;
    }
    EXPECT_GT(contacts, 50);
    EXPECT_GT((near_world.state(0).x - start).cwiseAbs().maxCoeff(), 0.02);
    EXPECT_LT(((far_world.state(0).x.rowwise() - shift) - near_world.state(0).x).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(BuildWorld, PutsABodyThatCountsFromItsOwnOriginWhereItIs) {
    Body body = test::box_body({1, 0.4, 0.3}, {4, 2, 2});
    body.origin << 5e5, 5.4e6, 300;
    const LoadedBody loaded{std::make_shared<const Body>(std::move(body)), nullptr};
    const World world = built(
        R"({"bodies": [{"body": "a.h5", "transform": {"translate": [-500000, -5400000, -300]}}]})", loaded);
    EXPECT_EQ(world.origin(), Eigen::Vector3d::Zero());
    EXPECT_EQ(world.state(0).x, loaded.body->tets.X);
    const World away = built(R"({"bodies": [{"body": "a.h5"}]})", loaded);
    EXPECT_LT((away.state(0).x.colwise().mean().transpose() + away.origin() - loaded.body->origin).norm(),
              1e-6);
}

TEST(BuildWorld, PlacesBodiesPinsAndObstacles) {
    const SceneSpec spec = parse_scene(
        with(
            R"("transform": {"translate": [0, 0, 2], "rotate": {"axis": [0, 1, 0], "degrees": 90}, "scale": 2},
                "velocity": [0.5, 0, 0], "pins": [{"box": {"min": [-9, -9, 2.99], "max": [9, 9, 9]}}],
                "material": {"density": 500})",
            R"("obstacles": [{"plane": {}}])"),
        "");
    const LoadedBody loaded[] = {box()};
    World world = build_world(spec, loaded);
    ASSERT_EQ(world.body_count(), 1);
    EXPECT_NEAR(world.elastic(0).mass(), 0.12 * 8 * 500, 1e-9);
    const Nodes start = world.state(0).x;
    EXPECT_NEAR(start.col(2).maxCoeff(), 3, 1e-12);
    EXPECT_NEAR(start.col(2).minCoeff(), 1, 1e-12);
    EXPECT_NEAR(world.state(0).v.col(0).minCoeff(), 0.5, 1e-12);
    for (int i = 0; i < 20; ++i) ASSERT_EQ(world.step(spec.time.dt).failure, "");
    int pinned = 0;
    for (Eigen::Index i = 0; i < start.rows(); ++i) {
        if (start(i, 2) < 2.99) continue;
        ++pinned;
        EXPECT_LT((world.state(0).x.row(i) - start.row(i)).norm(), 1e-12);
    }
    EXPECT_EQ(pinned, 9);
    EXPECT_LT(world.state(0).x.col(2).minCoeff(), 0.999);  // the free part sags
}

TEST(BuildWorld, SpinsBodiesAboutTheirCentreOfMass) {
    const World world = built(
        with(
            R"("transform": {"translate": [3, 0, 0]}, "velocity": [1, 0, 0], "angular_velocity": [0, 0, 2])"),
        box());
    const BodyState& state = world.state(0);
    for (Eigen::Index i = 0; i < state.x.rows(); ++i)
        EXPECT_LT(
            (state.v.row(i) - Eigen::RowVector3d(1 - 2 * state.x(i, 1), 2 * (state.x(i, 0) - 3), 0)).norm(),
            1e-12);
}

TEST(BuildWorld, NamesTheBodyThatIsInvalid) {
    const auto message = [](const std::string& text, std::span<const LoadedBody> bodies) {
        return test::refusal([&] { build_world(parse_scene(text, ""), bodies); });
    };
    const LoadedBody loaded[] = {box()};
    EXPECT_EQ(message(with(""), {}), "scene: it has 1 bodies, but 0 were loaded");
    EXPECT_EQ(message(with(R"("pins": [{"sphere": {"centre": [9, 9, 9], "radius": 1}}])"), loaded),
              "bodies[0] (a): pins[0]: the region holds no node of the body");
    EXPECT_EQ(message(with(R"("bounds": "nbd", "tree": "t.h5")"), loaded),
              "bodies[0] (a): bounds \"nbd\" need a tree");
    EXPECT_EQ(message(with(""), loaded), "");
}

TEST(BuildWorld, SharesWhatIsMadeOfTheSameData) {
    const SceneSpec spec = parse_scene(
        R"({"bodies": [{"body": "a"}, {"body": "a", "transform": {"translate": [2, 0, 0]}},
                       {"body": "a", "transform": {"translate": [4, 0, 0], "scale": 2}},
                       {"body": "a", "transform": {"translate": [8, 0, 0]}, "material": {"density": 500}},
                       {"body": "a", "bounds": "exact", "transform": {"translate": [12, 0, 0]}}]})",
        "");
    LoadedBody loaded[] = {box(), box(), box(), box(), box()};
    for (LoadedBody& body : loaded) body.body = loaded[0].body;
    make_trees(spec, loaded);
    for (const int b : {1, 2, 3}) EXPECT_EQ(loaded[b].tree, loaded[0].tree);
    EXPECT_NE(loaded[4].tree, loaded[0].tree);
    EXPECT_TRUE(loaded[0].tree->affine);
    EXPECT_FALSE(loaded[4].tree->affine);
    const World world = build_world(spec, loaded);
    EXPECT_EQ(&world.elastic(1), &world.elastic(0));
    EXPECT_EQ(&world.shape(1), &world.shape(0));
    for (const int b : {2, 3}) {
        EXPECT_NE(&world.elastic(b), &world.elastic(0));
        EXPECT_NE(&world.shape(b), &world.shape(0));
    }
    EXPECT_EQ(&world.elastic(4), &world.elastic(0));
    EXPECT_EQ(&world.shape(4), &world.shape(0));
}

TEST(BuildWorld, HangsABodyOnItsOwnNodes) {
    const std::string text = R"({"bodies": [
        {"body": "a", "bounds": "affine", "transform": {"scale": 2, "rotate": {"degrees": 30}}},
        {"body": "b", "transform": {"translate": [0.3, 0.1, 0.65]},
         "velocity": [0, 0, -2]},
        {"body": "c", "bounds": "exact", "transform": {"translate": [5, 0, 0]}}]})";
    const SceneSpec spec = parse_scene(text, "");
    SceneSpec exact = spec;
    for (SceneBody& body : exact.bodies) body.bounds = BoundKind::exact;
    LoadedBody with_tree = box();  // a tree file of an earlier version, without affine bounds
    with_tree.tree = shared_exact_tree(with_tree.body->surface.X.cast<float>(), with_tree.body->surface.F);
    const LoadedBody loaded[] = {box(), with_tree, box()};
    World world = build_world(spec, loaded), expected = build_world(exact, loaded);
    int contacts = 0;
    for (int i = 0; i < 40; ++i) {
        const WorldReport report = world.step(spec.time.dt);
        ASSERT_EQ(report.failure, "");
        expected.step(spec.time.dt);
        contacts += report.contacts;
    }
    EXPECT_GT(contacts, 0);
    for (int b = 0; b < 3; ++b) EXPECT_EQ(world.state(b).x, expected.state(b).x);

    Body leaning = *box().body;
    leaning.W.coeffRef(4, 4) += 0.5;
    leaning.W.coeffRef(4, 5) -= 0.5;
    const LoadedBody outside{std::make_shared<const Body>(std::move(leaning)), nullptr};
    const std::string said = test::refusal([&] { built(with(R"("bounds": "affine")"), outside); });
    EXPECT_TRUE(said.starts_with("bodies[0] (a): vertex 4 has the weight -0.5; allowed: 0 or more")) << said;
    const SceneBody by_default = parse_scene(with(""), "").bodies.front();
    EXPECT_FALSE(scene_tree(by_default, outside)->affine) << "auto bounds are boxes then";
    EXPECT_TRUE(scene_tree(by_default, box())->affine);
}

TEST(CheckScene, ReportsEveryProblemOfBodiesAndObstacles) {
    const SceneReading reading = read_scene(
        R"({"bodies": [
            {"body": "a", "pins": [{"sphere": {"centre": [9, 9, 9], "radius": 1}},
                                   {"box": {"min": [0.4, -1, -1], "max": [1, 1, 1]}}],
             "grips": [{"region": {"box": {"min": [0.1, -1, -1], "max": [1, 1, 1]}}}]},
            {"body": "b", "transform": {"translate": [0.9, 0.1, 0.1]}},
            {"body": "c", "transform": {"scale": 0.2, "translate": [0, 0, 0.01]}},
            {"body": "d", "transform": {"translate": [0, 0, 5]}},
            {"body": "missing"},
            {"body": "e", "transform": {"translate": [0, 0, 9]}, "velocity": "fast"}],
          "obstacles": [{"plane": {"point": [0, 0, -0.1]}},
                        {"mesh": {"file": "/nowhere.obj"}},
                        {"sphere": {"centre": [0, 0, 6], "radius": 0.5}},
                        {"sphere": {"centre": [0, 0, 5], "radius": -1}}]})",
        "");
    const LoadedBody loaded = box();
    const LoadedBody bodies[] = {loaded, loaded, loaded, loaded, {}, loaded};
    EXPECT_EQ(
        check_scene(reading, bodies).problems,
        (std::vector<std::string>{
            "bodies[0].pins[0]: the region holds no node of the body",
            "bodies[0].grips[0]: contains nodes that pins[1] also holds at 0 s; allowed: to take them once they are "
            "released",
            "obstacles[1]: /nowhere.obj: no such file",
            "bodies[1]: overlaps bodies[0] at the start: 28 pairs of faces cross; \"resolve_start\": "
            "true moves bodies apart before the first step",
            "bodies[2]: lies inside bodies[0] or encloses it at the start; \"resolve_start\": true "
            "moves bodies apart before the first step",
            "bodies[0]: is 0.05 m deep in obstacles[0] at the start; bodies[0] is held, so place it at "
            "least 0.00022 m away",
        }));
}

/// Findings of one box, with its lowest face at this height over a plane.
SceneFindings findings_at(double height, const std::string& more = "") {
    const SceneReading reading =
        read_scene(fmt::format(R"({{"bodies": [{{"body": "a", "transform": {{"translate": [0, 0, {}]}}{}}}],
                    "obstacles": [{{"plane": {{}}}}]}})",
                               0.15 + height, more),
                   "");
    const LoadedBody loaded = box();
    const LoadedBody bodies[] = {loaded};
    const SceneFindings findings = check_scene(reading, bodies);
    // A run begins where there is no problem, and nowhere else.
    std::vector<StartMove> moves;
    World world = build_world(reading.spec, bodies, &moves);
    EXPECT_EQ(moves.size(), findings.notes.size()) << height;
    EXPECT_EQ(test::refusal([&] { world.check_start(); }).empty(), findings.problems.empty()) << height;
    return findings;
}

TEST(CheckScene, MovesBodiesThatTouchAsARunDoes) {
    for (const double height : {0.0, -1e-3, -5e-3}) {  // up to half a hundredth of the size
        const SceneFindings found = findings_at(height);
        EXPECT_EQ(found.problems, std::vector<std::string>{}) << height;
        EXPECT_EQ(found.warnings, std::vector<std::string>{}) << height;
        ASSERT_EQ(found.notes.size(), 1u) << height;
        EXPECT_TRUE(found.notes[0].starts_with(
            "bodies[0]: touched or overlapped something at the start and was moved by (0, 0, 0.00"))
            << found.notes[0];
    }
    EXPECT_TRUE(findings_at(0.01).notes.empty());
    EXPECT_EQ(findings_at(-0.02).problems,
              std::vector<std::string>{"bodies[0]: is 0.02 m deep in obstacles[0] at the start; "
                                       "\"resolve_start\": true moves bodies apart before the first step"});
}

TEST(CheckScene, AcceptsWhatIsHeldAndTouches) {
    const std::string below = R"(, "pins": [{"box": {"min": [-9, -9, -9], "max": [9, 9, 0.01]}}])";
    const SceneFindings found = findings_at(0, below);
    EXPECT_EQ(found.problems, std::vector<std::string>{});
    EXPECT_EQ(found.warnings, std::vector<std::string>{});
    EXPECT_EQ(found.notes, std::vector<std::string>{});
    EXPECT_EQ(
        findings_at(-5e-3, below).problems,
        std::vector<std::string>{"bodies[0]: is 0.005 m deep in obstacles[0] at the start; bodies[0] is "
                                 "held, so place it at least 0.0011 m away"});
}

TEST(RestWarnings, TellOfFacesThatIntersectAtRest) {
    Body body = test::box_body({1, 0.4, 0.3}, {4, 2, 2});
    const std::string scene = R"({"bodies": [{"body": "a", "name": "box"}]})";
    const auto warnings = [&] {
        const LoadedBody loaded{std::make_shared<const Body>(body), nullptr};
        World world = built(scene, loaded);
        return rest_warnings(parse_scene(scene, ""), world);
    };
    EXPECT_EQ(warnings(), std::vector<std::string>{});
    // The second corner of a face in the place of the first one.
    const int from = body.surface.F(0, 0), to = body.surface.F(0, 1);
    std::vector<Eigen::Triplet<double>> weights;
    for (int v = 0; v < body.W.rows(); ++v)
        for (Embedding::InnerIterator entry(body.W, v == to ? from : v); entry; ++entry)
            weights.emplace_back(v, entry.col(), entry.value());
    body.W.setFromTriplets(weights.begin(), weights.end());
    const std::vector<std::string> found = warnings();
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NE(found[0].find("bodies[0] (box): "), std::string::npos) << found[0];
    EXPECT_NE(found[0].find(" pairs of its faces intersect at rest, the first are "), std::string::npos)
        << found[0];
}

}  // namespace
}  // namespace nbd
