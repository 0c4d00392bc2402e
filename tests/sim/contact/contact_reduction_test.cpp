#include "sim/contact/contact_reduction.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <utility>

#include "collision/base/counter_random.hpp"
#include "meshing/body/make_body.hpp"
#include "tests/support/box_body.hpp"

namespace nbd {
namespace {

/// Two boxes whose surfaces are finer than their tetrahedra, and contacts between them at random gaps.
class FineBoxes : public testing::Test {
 protected:
    FineBoxes() : body_(test::box_body({1, 0.6, 0.3}, {3, 2, 1})) {
        const Subdivision fine = subdivide(body_.surface, SubdivisionScheme::midpoint, 3);
        body_.W = (fine.S * body_.W).eval();
        body_.surface = fine.mesh;
    }

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
    Body body_;
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
        some[c].normal = Eigen::Vector3d(0, static_cast<double>(c), 1).normalized();
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
