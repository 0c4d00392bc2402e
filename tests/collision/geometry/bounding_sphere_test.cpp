#include "collision/geometry/bounding_sphere.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <numeric>
#include <vector>

namespace nbd {
namespace {

TEST(BoundingSphere, ContainsEveryListedVertexAtAnyScale) {
    std::srand(1);
    for (const float scale : {1e-3f, 1.f, 1e4f}) {
        const Vertices x = Vertices::Random(500, 3) * scale;
        std::vector<int> all(500);
        std::iota(all.begin(), all.end(), 0);
        const Sphere s = bounding_sphere(x, all);
        for (int v = 0; v < x.rows(); ++v)
            EXPECT_LE((x.row(v).transpose() - s.c).cast<double>().norm(), s.r) << "vertex " << v;
    }
}

TEST(BoundingSphere, IsCentredAtTheMeanOfTheVertices) {
    Vertices x(3, 3);
    x << 0, 0, 0, 3, 0, 0, 0, 3, 0;
    const Sphere s = bounding_sphere(x, std::vector<int>{0, 1, 2});
    EXPECT_NEAR((s.c - Eigen::Vector3f(1, 1, 0)).norm(), 0, 1e-6);
    EXPECT_NEAR(s.r, std::sqrt(5.f), 1e-5);
}

}  // namespace
}  // namespace nbd
