#include "sim/patches/contact_samples.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "meshing/body/make_body.hpp"
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
    return contact_samples(body.surface.F, rest, vertex_areas(body.surface.F, rest),
                           static_cast<int>(body.tets.X.rows()));
}

TEST(ContactSamples, AreAllVerticesOfASurfaceThatIsNotMuchFinerThanItsNodes) {
    const Body body = fine_box(1);
    const Nodes rest = embedded(body.W, body.tets.X);
    const ContactSamples samples = samples_of(body, rest);
    EXPECT_EQ(std::ranges::count(samples.kept, true), rest.rows());
    EXPECT_EQ(samples.areas, vertex_areas(body.surface.F, rest));
}

TEST(ContactSamples, AreFewerOfFinerSurfacesAndStandForTheWholeArea) {
    const Body body = fine_box(4);
    const Nodes rest = embedded(body.W, body.tets.X);
    const ContactSamples samples = samples_of(body, rest);
    const auto kept = std::ranges::count(samples.kept, true);
    EXPECT_LT(kept, rest.rows() / 2);
    EXPECT_GT(kept, rest.rows() / 8);
    EXPECT_NEAR(samples.areas.sum(), vertex_areas(body.surface.F, rest).sum(), 1e-12);
    for (Eigen::Index v = 0; v < rest.rows(); ++v)
        EXPECT_EQ(samples.areas[v] > 0, samples.kept[static_cast<std::size_t>(v)]);
    // None is far from the nearest of those kept.
    const double cell = 4 * std::sqrt(vertex_areas(body.surface.F, rest).mean());
    for (Eigen::Index v = 0; v < rest.rows(); v += 7) {
        double nearest = 1;
        for (Eigen::Index k = 0; k < rest.rows(); ++k)
            if (samples.kept[static_cast<std::size_t>(k)])
                nearest = std::min(nearest, (rest.row(v) - rest.row(k)).norm());
        EXPECT_LT(nearest, cell);
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
    for (const Eigen::Index v : tips) EXPECT_TRUE(samples.kept[static_cast<std::size_t>(v)]) << v;
}

TEST(ContactSamples, AreListedByThePatchesThatOwnThem) {
    const Body body = fine_box(4);
    const ContactShape shape(body.W, body.surface.F, body.tets.X);
    const ContactSamples samples = samples_of(body, embedded(body.W, body.tets.X));
    EXPECT_EQ(shape.sample_areas, samples.areas);
    std::ptrdiff_t listed = 0;
    for (int patch = 0; patch < shape.patches.count(); ++patch)
        for (const int vertex : shape.patch_samples[patch]) {
            EXPECT_TRUE(samples.kept[static_cast<std::size_t>(vertex)]);
            EXPECT_TRUE(std::ranges::count(shape.patches.vertices[patch], vertex) == 1);
            ++listed;
        }
    EXPECT_EQ(listed, std::ranges::count(samples.kept, true));
}

}  // namespace
}  // namespace nbd
