
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "collision/base/counter_random.hpp"
#include "sim/contact/body_contact.hpp"
#include "sim/contact/contact_reduction.hpp"
#include "sim/patches/contact_shape.hpp"
#include "tests/sim/contact/find_contacts.hpp"
#include "tests/support/box_body.hpp"

namespace nbd {
namespace {

/// A box whose surface is this often subdivided.
Body fine_box(int levels) { return test::fine_box_body({1, 0.6, 0.3}, {3, 2, 1}, levels); }

ContactSamples samples_of(const Body& body, const Nodes& rest) {
    return contact_samples(body.surface.F, rest, vertex_areas(body.surface.F, rest), body.tets.X.rows());
}

TEST(ContactSamples, AreAllVerticesOfASurfaceThatIsNotMuchFinerThanItsNodes) {
    const Body body = fine_box(1);
    const Nodes rest = embedded(body.W, body.tets.X);
    const ContactSamples samples = samples_of(body, rest);
    EXPECT_EQ(std::ranges::count(samples.kept, true), rest.rows());
    EXPECT_EQ(samples.areas, vertex_areas(body.surface.F, rest));
}

TEST(ContactSamples, AreFewerOfFinerSurfacesAndStandForTheWholeArea) {
    for (const int levels : {3, 4}) {
        const Body body = fine_box(levels);
        const Nodes rest = embedded(body.W, body.tets.X);
        const ContactSamples samples = samples_of(body, rest);
        const double vertices = rest.rows(), per_cell = std::max(16.0, vertices / (4 * body.tets.X.rows()));
        const double kept = std::ranges::count(samples.kept, true);
        EXPECT_LT(kept, 8 * vertices / per_cell);
        EXPECT_GT(kept, 2 * vertices / per_cell);
        EXPECT_NEAR(samples.areas.sum(), vertex_areas(body.surface.F, rest).sum(), 1e-12);
        for (Eigen::Index v = 0; v < rest.rows(); ++v) EXPECT_EQ(samples.areas[v] > 0, samples.kept[v]);
        // None is far from the nearest of those kept.
        const double cell = std::sqrt(per_cell * vertex_areas(body.surface.F, rest).mean());
        for (Eigen::Index v = 0; v < rest.rows(); v += 7) {
            double nearest = 1;
            for (Eigen::Index k = 0; k < rest.rows(); ++k)
                if (samples.kept[k]) nearest = std::min(nearest, (rest.row(v) - rest.row(k)).norm());
            EXPECT_LT(nearest, cell);
        }
    }
}

TEST(ContactSamples, HaveTheTipsOfSpikes) {
    const Body body = fine_box(4);
    Nodes rest = embedded(body.W, body.tets.X);
    std::vector<Eigen::Index> tips;
    for (Eigen::Index v = 0; v < rest.rows(); v += 97)
        if (rest(v, 2) > 0.149 && std::abs(rest(v, 0)) < 0.45 && std::abs(rest(v, 1)) < 0.25) {
            rest(v, 2) += 0.01;
            tips.push_back(v);
        }
    ASSERT_GT(tips.size(), 3u);
    const ContactSamples samples = samples_of(body, rest);
    for (const Eigen::Index v : tips) EXPECT_TRUE(samples.kept[v]) << v;
}

TEST(ContactSamples, AreListedByThePatchesThatOwnThem) {
    const Body body = fine_box(4);
    const ContactShape shape(body.W, body.surface.F, body.tets.X);
    const ContactSamples samples = samples_of(body, embedded(body.W, body.tets.X));
    EXPECT_EQ(shape.sample_areas, samples.areas);
    std::ptrdiff_t listed = 0;
    for (int patch = 0; patch < shape.patches.count(); ++patch)
        for (const int vertex : shape.patch_samples[patch]) {
            EXPECT_TRUE(samples.kept[vertex]);
            EXPECT_TRUE(std::ranges::count(shape.patches.vertices[patch], vertex) == 1);
            ++listed;
        }
    EXPECT_EQ(listed, std::ranges::count(samples.kept, true));
}

/// Two such boxes, one above the other, tilted a little.
TEST(ContactSamples, PressAsHardAsAllVertices) {
    const Body body = fine_box(4);
    const auto shape = std::make_shared<const ContactShape>(body.W, body.surface.F, body.tets.X);
    constexpr double thickness = 0.02;
    Nodes above = body.tets.X.rowwise() + Eigen::RowVector3d(0.05, 0.02, 0.308);
    above.col(2) += 0.01 * above.col(0);
    const ContactSurface lower(shape, body.tets.X), upper(shape, above);
    const auto press = [&](ContactDetail detail, std::ptrdiff_t& vertices) {
        BodyContactFinder finder(0, 1);
        const std::vector<Contact> contacts = test::find_contacts(
            finder, lower, upper, {.reach = {.apart = thickness, .inside = thickness}, .detail = detail});
        double sum = 0;
        vertices = 0;
        for (const Contact& contact : contacts) {
            if (contact.a.count != 1) continue;
            ++vertices;
            sum +=
                contact.area * (thickness - contact.gap) * contact.normal[2] * (contact.a.body == 0 ? -1 : 1);
        }
        return sum;
    };
    std::ptrdiff_t all = 0, enough = 0;
    const double with_all = press(ContactDetail::all, all),
                 with_samples = press(ContactDetail::enough, enough);
    EXPECT_GT(with_all, 0);
    EXPECT_NEAR(with_samples, with_all, 0.1 * with_all);  // those that stand out press a little harder
    EXPECT_LT(enough, all / 2);
    EXPECT_GT(enough, 20);
}

TEST(ContactSamples, LeaveOutVerticesWithoutFaces) {
    const Body body = fine_box(4);
    Nodes rest = embedded(body.W, body.tets.X);
    const Eigen::Index before = rest.rows();
    rest.conservativeResize(before + 3, 3);
    rest.bottomRows(3) << 0.5, 0, 0, 0.5, 0.1, 0, 0.5, 0, 0.1;
    const Eigen::VectorXd areas = vertex_areas(body.surface.F, rest);
    const ContactSamples samples = contact_samples(body.surface.F, rest, areas, body.tets.X.rows());
    EXPECT_NEAR(samples.areas.sum(), areas.sum(), 1e-12);
    for (Eigen::Index v = before; v < rest.rows(); ++v) EXPECT_FALSE(samples.kept[v]);
}

/// Two boxes whose surfaces are finer than their tetrahedra, and contacts between them at random gaps.
class FineBoxes : public testing::Test {
 protected:
    ContactSurface surface() const {
        return {std::make_shared<const ContactShape>(body_.W, body_.surface.F, body_.tets.X), body_.tets.X};
    }

    /// One contact of each vertex of body 4 with a face of body 7, and the other way round.
    std::vector<Contact> contacts() const {
        std::vector<Contact> contacts;
        CounterRandom random(5, 0);
        for (const int body : {4, 7})
            for (int v = 0; v < body_.W.rows(); ++v) {
                const auto corners = body_.surface.F.row(v % body_.surface.F.rows());
                contacts.push_back({.a = {.body = body, .count = 1, .vertices = {v}, .weights = {1}},
                                    .b = {.body = 11 - body,
                                          .count = 3,
                                          .vertices = {corners[0], corners[1], corners[2]},
                                          .weights = {0.5, 0.3, 0.2}},
                                    .normal = Eigen::Vector3d::UnitZ(),
                                    .gap = thickness * (1.4 * random.unit() - 0.2),
                                    .area = 1 + random.unit()});
            }
        return contacts;
    }

    static double area(std::span<const Contact> contacts) {
        double sum = 0;
        for (const Contact& contact : contacts) sum += contact.area;
        return sum;
    }
    /// Proportional to the force of contacts at rest.
    static double pressing(std::span<const Contact> contacts) {
        double sum = 0;
        for (const Contact& contact : contacts) sum += contact.area * std::max(thickness - contact.gap, 0.0);
        return sum;
    }

    static constexpr double thickness = 0.01;

 private:
    Body body_ = fine_box(3);
};

TEST_F(FineBoxes, KeepTheAreaAndTheForceOfFewerContacts) {
    const ContactSurface a = surface(), b = surface();
    const std::vector<Contact> all = contacts();
    std::vector<Contact> kept = all;
    ContactReduction reduction;
    reduction.reduce(kept, 0, 4, a, b, thickness, 3);
    EXPECT_LT(kept.size(), all.size() / 2);
    EXPECT_GT(kept.size(), 20u);
    EXPECT_NEAR(area(kept), area(all), 1e-9 * area(all));
    EXPECT_NEAR(pressing(kept), pressing(all), 1e-9 * pressing(all));
    EXPECT_TRUE(std::ranges::is_sorted(kept, {}, [](const Contact& c) {
        return std::pair(c.a.body, c.a.vertices[0]);
    })) << "the order stays";
    std::vector<Contact> again = all;
    reduction.reduce(again, 0, 4, a, b, thickness, 3);
    ASSERT_EQ(again.size(), kept.size());
    for (std::size_t c = 0; c < kept.size(); ++c) {
        EXPECT_EQ(again[c].a.vertices, kept[c].a.vertices);
        EXPECT_EQ(again[c].gap, kept[c].gap);
    }
}

TEST_F(FineBoxes, KeepTheDeepestContactAmongTheOthers) {
    const ContactSurface a = surface(), b = surface();
    std::vector<Contact> all = contacts(), kept = all;
    const auto deepest = std::ranges::min_element(all, {}, &Contact::gap);
    ContactReduction().reduce(kept, 0, 4, a, b, thickness, 1);
    EXPECT_TRUE(std::ranges::any_of(kept, [&](const Contact& c) {
        return c.a.body == deepest->a.body && c.a.vertices == deepest->a.vertices;
    }));
}

TEST_F(FineBoxes, KeepTheDeepestOfContactsAtOnePlace) {
    const ContactSurface a = surface(), b = surface();
    std::vector<Contact> some(5, contacts().front());
    const std::vector<double> gaps{0.004, 0.009, -0.003, 0.001, 0.006};
    for (std::size_t c = 0; c < some.size(); ++c) {
        some[c].gap = gaps[c];
        some[c].normal = Eigen::Vector3d(0, c, 1).normalized();
    }
    const Eigen::Vector3d deepest = some[2].normal;
    ContactReduction().reduce(some, 0, 4, a, b, thickness, 3);
    ASSERT_EQ(some.size(), 1u);
    EXPECT_EQ(some[0].normal, deepest);
}

TEST_F(FineBoxes, KeepContactsBeforeTheFirstAndGroupsThatAreSmall) {
    const ContactSurface a = surface(), b = surface();
    const std::vector<Contact> all = contacts();
    std::vector<Contact> kept = all;
    ContactReduction reduction;
    reduction.reduce(kept, 0, 4, a, b, thickness, 100000);
    ASSERT_EQ(kept.size(), all.size());
    for (std::size_t c = 0; c < all.size(); ++c) EXPECT_EQ(kept[c].gap, all[c].gap);
    reduction.reduce(kept, 100, 4, a, b, thickness, 1);
    ASSERT_GT(kept.size(), 100u);
    EXPECT_LT(kept.size(), all.size() / 2);
    for (std::size_t c = 0; c < 100; ++c) EXPECT_EQ(kept[c].area, all[c].area);
}

}  // namespace
}  // namespace nbd
