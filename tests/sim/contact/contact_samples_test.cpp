
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "meshing/body/make_body.hpp"
#include "sim/contact/body_contact.hpp"
#include "sim/patches/contact_shape.hpp"
#include "tests/support/box_body.hpp"

namespace nbd {
namespace {

/// A box whose surface is this often subdivided.
Body fine_box(int levels) {
    Body body = test::box_body({1, 0.6, 0.3}, {3, 2, 1});
    const Subdivision fine = subdivide(body.surface, SubdivisionScheme::midpoint, levels);
    body.W = (fine.S * body.W).eval();
    body.surface = fine.mesh;
    return body;
}

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
        const auto vertices = static_cast<double>(rest.rows()),
                   nodes = static_cast<double>(body.tets.X.rows()),
                   per_cell = std::max(16.0, vertices / (4 * nodes));
        const auto kept = static_cast<double>(std::ranges::count(samples.kept, true));
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
    const Nodes still = Nodes::Zero(body.tets.X.rows(), 3);
    constexpr double thickness = 0.02;
    Nodes above = body.tets.X.rowwise() + Eigen::RowVector3d(0.05, 0.02, 0.308);
    above.col(2) += 0.01 * above.col(0);
    const ContactSurface lower(shape, body.tets.X), upper(shape, above);
    std::vector<PatchPair> pairs;
    for (int i = 0; i < shape->patches.count(); ++i)
        for (int j = 0; j < shape->patches.count(); ++j)
            if (!shape->patches.faces[i].empty() && !shape->patches.faces[j].empty()) pairs.push_back({i, j});
    const auto press = [&](ContactDetail detail, std::ptrdiff_t& vertices) {
        PosedPatches a, b;
        a.begin(lower, Eigen::Vector3d(0, 0, 0.15), still, 0.005);
        b.begin(upper, Eigen::Vector3d(0, 0, 0.15), still, 0.005);
        std::vector<Contact> contacts;
        BodyContactFinder(0, 1).find(a, b, pairs, {.apart = thickness, .inside = thickness}, detail,
                                     std::numeric_limits<double>::infinity(), contacts);
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

}  // namespace
}  // namespace nbd
