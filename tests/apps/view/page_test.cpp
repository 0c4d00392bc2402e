#include "apps/view/page.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <random>
#include <sstream>

#include "apps/view/contact_finder.hpp"
#include "apps/view/make_view.hpp"
#include "apps/view/packed.hpp"
#include "apps/view/posed_view.hpp"
#include "tests/collision/models.hpp"
#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::error_of;

/// Numbers in columns of very different ranges; the last column is constant.
std::vector<float> random_numbers(int rows) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> share(0, 1);
    std::vector<float> numbers;
    for (int row = 0; row < rows; ++row)
        for (const float size : {1e-3f, 1.f, 1e6f, 0.f}) numbers.push_back(5 - size * share(random));
    return numbers;
}

TEST(Quantise, EveryNumberIsWithinHalfAStepOfItsColumn) {
    const std::vector<float> numbers = random_numbers(1000);
    const Quantised q = quantise(numbers, 4);
    ASSERT_EQ(q.values.size(), numbers.size());
    double worst = 0;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
        const double step = q.step[i % 4], error = std::abs(q.low[i % 4] + step * q.values[i] - numbers[i]);
        EXPECT_LE(error, 0.500001 * step) << i;
        if (step > 0) worst = std::max(worst, error / step);
    }
    EXPECT_GT(worst, 0.4);  // numbers were rounded
    EXPECT_EQ(q.step[3], 0);
    EXPECT_EQ(*std::max_element(q.values.begin(), q.values.end()), 65535);
}

TEST(Quantise, TakesAsManyStepsAsAsked) {
    const Quantised q = quantise(random_numbers(100), 4, 255);
    EXPECT_EQ(*std::max_element(q.values.begin(), q.values.end()), 255);
}

TEST(Quantise, RefusesNumbersThatAreNotFinite) {
    std::vector<float> numbers(6, 1.f);
    numbers[4] = NAN;
    EXPECT_EQ(error_of([&] { quantise(numbers, 3); }),
              "number 4 to be shown is nan; allowed: finite numbers");
}

TEST(Packed, TakesThePredictionThatLeavesTheLeast) {
    std::vector<std::uint16_t> falling, still, random;
    std::mt19937 draw(1);
    for (int frame = 0; frame < 50; ++frame)
        for (int i = 0; i < 300; ++i) {
            falling.push_back(1000 + (i * i) % 977 * 50 + (i * i) % 89 * frame);
            still.push_back((i * i * 7919) % 65521);
            random.push_back(draw());
        }
    EXPECT_EQ(pack(falling, 300, 3).time, 2);
    EXPECT_GE(pack(still, 300, 3).time, 1);
    EXPECT_LT(pack(falling, 300, 3).text.size(), 4000u);
    EXPECT_LT(pack(still, 300, 3).text.size(), 4000u);
    EXPECT_GT(pack(random, 300, 3).text.size(), 2 * 50u * 300);  // cannot be predicted
}

TEST(EvenFrames, HasTheFirstAndTheLast) {
    EXPECT_EQ(even_frames(5, 10), (std::vector{0, 1, 2, 3, 4}));
    EXPECT_EQ(even_frames(9, 3), (std::vector{0, 4, 8}));
    EXPECT_EQ(even_frames(101, 2), (std::vector{0, 100}));
    EXPECT_EQ(even_frames(7, 1), (std::vector{0}));
    const std::vector<int> many = even_frames(1000, 300);
    EXPECT_EQ(many.size(), 300u);
    EXPECT_EQ(std::ranges::adjacent_find(many, std::greater_equal()), many.end());  // none twice
}

/// One triangle that moves.
ViewScene triangle_scene() {
    ViewScene scene;
    scene.title = "a </script> b";
    scene.times = {0, 0.5};
    scene.numbers = {0, 1};
    scene.recorded_frames = 2;
    scene.pairs.resize(2);
    ViewBody body;
    body.name = "triangle";
    body.F.resize(1, 3);
    body.F << 0, 1, 2;
    body.nodes.resize(6, 3);
    body.nodes << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1;
    for (FaceMarks* marks : {&body.near, &body.intersecting, &body.missed})
        for (int frame = 0; frame < 2; ++frame) marks->add_frame({});
    scene.bodies.push_back(std::move(body));
    return scene;
}

std::string page_of(const ViewScene& scene) {
    std::ostringstream out;
    write_page(out, scene);
    return out.str();
}

TEST(Page, TheSameSceneGivesTheSameBytes) { EXPECT_EQ(page_of(triangle_scene()), page_of(triangle_scene())); }

TEST(Page, FetchesNothingAndKeepsNamesInsideTheirElement) {
    const std::string page = page_of(triangle_scene());
    for (const std::string reference : {" src=", " href=", "@import", "url("})
        EXPECT_EQ(page.find(reference, 0), std::string::npos) << reference;
    EXPECT_EQ(page.find("a </script>"), std::string::npos);
    EXPECT_NE(page.find("a \\u003c/script> b"), std::string::npos);
    EXPECT_NE(page.find("The MIT License"), std::string::npos);
    EXPECT_NE(page.find("Permission is hereby granted"), std::string::npos);
}

TEST(Page, RefusesPositionsThatAreNotFinite) {
    ViewScene scene = triangle_scene();
    scene.bodies[0].nodes(2, 1) = INFINITY;
    EXPECT_EQ(error_of([&] { page_of(scene); }), "number 7 to be shown is inf; allowed: finite numbers");
}

struct Sheet {
    Vertices X;
    Faces F;
};

/// A wavy sheet of 2 k k faces.
Sheet sheet(int k) {
    Sheet mesh{Vertices((k + 1) * (k + 1), 3), Faces(2 * k * k, 3)};
    for (int i = 0; i <= k; ++i)
        for (int j = 0; j <= k; ++j) {
            const auto s = static_cast<float>(i), t = static_cast<float>(j);
            mesh.X.row(i * (k + 1) + j) << s, t, std::sin(0.1f * s) + std::cos(0.2f * t);
        }
    for (int i = 0; i < k; ++i)
        for (int j = 0; j < k; ++j) {
            const int v = i * (k + 1) + j, f = 2 * (i * k + j);
            mesh.F.row(f) << v, v + k + 1, v + 1;
            mesh.F.row(f + 1) << v + 1, v + k + 1, v + k + 2;
        }
    return mesh;
}

TEST(BoxLevels, EachLevelBoundsTheWholeBodyAndNoMoreBoxesComeThanAskedFor) {
    const Sheet mesh = sheet(50);  // several clusters
    SurfaceEmbedding W(mesh.X.rows(), mesh.X.rows());
    W.setIdentity();
    PosedWideTree boxes(std::make_shared<const AffineModel>(mesh.F, mesh.X.rows(), W, mesh.X));
    const Vertices x = 2.f * mesh.X;
    boxes.begin_pose(x);
    const auto levels = box_levels(boxes, 100'000);
    ASSERT_EQ(levels.size(), 4u);
    EXPECT_EQ(levels[0].size(), 1u);
    std::size_t total = 1;
    for (std::size_t l = 1; l < levels.size(); ++l) {
        EXPECT_GT(levels[l].size(), levels[l - 1].size());
        total += levels[l].size();
        Box all = empty_box();
        for (const Box& box : levels[l]) all = joined(all, box);
        for (int c = 0; c < 3; ++c) {
            EXPECT_LE(all.lo[c], x.col(c).minCoeff());
            EXPECT_GE(all.hi[c], x.col(c).maxCoeff());
            EXPECT_NEAR(all.lo[c], x.col(c).minCoeff(), 1e-3);
            EXPECT_NEAR(all.hi[c], x.col(c).maxCoeff(), 1e-3);
        }
    }
    EXPECT_EQ(box_levels(boxes, total).size(), 4u);
    EXPECT_EQ(box_levels(boxes, total - 1).size(), 3u);
    EXPECT_EQ(box_levels(boxes, 1 + levels[1].size()).size(), 2u);
    EXPECT_EQ(box_levels(boxes, 0).size(), 1u);
}

TEST(PosedView, DrawsTheBoxesThatItsBoundsWalk) {
    const Sheet mesh = sheet(20);
    SurfaceEmbedding W(mesh.X.rows(), mesh.X.rows());
    W.setIdentity();
    CollisionTree tree = make_exact_tree(mesh.X, mesh.F);
    const auto bare = std::make_shared<const CollisionTree>(tree);
    hang_on_nodes(tree, W, mesh.X);
    const auto hung = std::make_shared<const CollisionTree>(std::move(tree));
    const auto kind_of = [&](std::shared_ptr<const CollisionTree> of, BoundKind kind) {
        PosedView body({.tree = std::move(of), .W = W, .bounds = kind});
        ViewBounds bounds = bounds_of(body);
        for (int frame = 1; frame <= 2; ++frame) {
            body.begin_pose(static_cast<float>(frame) * mesh.X);
            add_bounds(body, bounds);
        }
        EXPECT_TRUE(bounds.are_boxes || kind == BoundKind::exact);
        const int numbers = bounds.are_boxes ? 6 : 4;
        EXPECT_EQ(bounds.values.size(), static_cast<std::size_t>(2 * numbers * bounds.first_node.back()));
        EXPECT_GT(bounds.first_node.size(), 3u);
        return bounds.kind;
    };
    EXPECT_EQ(kind_of(hung, BoundKind::affine), "affine");
    EXPECT_EQ(kind_of(hung, BoundKind::automatic), "affine");
    EXPECT_EQ(kind_of(hung, BoundKind::boxes), "boxes");
    EXPECT_EQ(kind_of(hung, BoundKind::exact), "exact");
    EXPECT_EQ(kind_of(bare, BoundKind::automatic), "boxes");
    // A margin is for bounds that can miss, and `auto` may be others.
    PosedView with_margin({.tree = hung, .W = W, .bounds = BoundKind::automatic, .margin = 0.1f});
    EXPECT_EQ(with_margin.own().kind(), BoundKind::affine);
}

TEST(ContactFinder, CountsWhatSpheresThatMissMissBesideExactOnes) {
    const shapes::Surface s = shapes::torus(16, 10);
    CollisionTree made = shapes::full_tree(s, shapes::make_modes(s, 6, 40, 1));
    made.nbd->out_centre.row(3).setConstant(-100);  // spheres without a radius
    const auto tree = std::make_shared<const CollisionTree>(std::move(made));
    for (const BoundKind other : {BoundKind::exact, BoundKind::nbd}) {
        std::deque<PosedView> bodies;
        bodies.emplace_back(ViewTree{.tree = tree, .bounds = BoundKind::nbd, .margin = 0.f});
        bodies.emplace_back(ViewTree{.tree = tree, .bounds = other, .margin = 0.f});
        bodies[0].begin_pose(s.X);
        bodies[1].begin_pose(s.X.rowwise() + Eigen::RowVector3f(0.5f, 0.4f, 0.3f));
        std::vector<ViewBody> shown(2);
        const PairCounts counts = ContactFinder(0.01, false, {}, {}, bodies).add_frame(bodies, 0, shown);
        EXPECT_GT(counts.intersecting_missed, 10u) << name(other);
        EXPECT_LE(counts.intersecting_missed, counts.intersecting);
        EXPECT_GE(counts.near_missed, counts.intersecting_missed);
        EXPECT_FALSE(shown[0].missed.faces.empty());
    }
}

TEST(Page, OnlyOneOfARunThatGoesOnAsksForMore) {
    std::ostringstream live;
    write_page(live, triangle_scene(), LivePage{"some run", 7, 0.5});
    EXPECT_NE(live.str().find(R"("live":{"run":"some run","frames":7,"seconds":0.5})"), std::string::npos);
    EXPECT_NE(live.str().find("connect-src 'self'"), std::string::npos);
    EXPECT_EQ(page_of(triangle_scene()).find("connect-src"), std::string::npos);
    EXPECT_EQ(page_of(triangle_scene()).find(R"("live":)"), std::string::npos);
}

TEST(Page, FramesToAddHoldTheirNumbersThemselves) {
    const std::string text = frames_text(triangle_scene());
    EXPECT_NE(text.find(R"("times":[0.0,0.5],"numbers":[0,1])"), std::string::npos);
    EXPECT_NE(text.find(R"("text":")"), std::string::npos);
    for (const char* fixed : {R"("id":)", R"("faces":)", R"("start":)"})
        EXPECT_EQ(text.find(fixed), std::string::npos) << fixed;
}

TEST(FaceMarks, AreAscendingWithoutRepeats) {
    FaceMarks marks;
    marks.add_frame({5, 2, 5, 9, 2});
    marks.add_frame({});
    marks.add_frame({1});
    EXPECT_EQ(marks.counts, (std::vector<std::uint32_t>{3, 0, 1}));
    EXPECT_EQ(marks.faces, (std::vector<std::uint32_t>{2, 5, 9, 1}));
}

}  // namespace
}  // namespace nbd
