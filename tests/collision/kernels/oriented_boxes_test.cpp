#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <random>
#include <vector>

#include "collision/kernels/kernels.hpp"
#include "collision/kernels/packs.hpp"
#include "tests/support/shapes.hpp"

namespace nbd {
namespace {

/// Sixteen boxes in a rest frame, moved by an affine map x = A X + b.
class MovedBoxes {
 public:
    MovedBoxes(std::mt19937& random, float thinnest, const Eigen::Matrix3f& A, const Eigen::Vector3f& b)
        : A_(A), b_(b) {
        std::vector<std::int16_t> r(3 * 16);
        std::vector<std::uint16_t> carrier(16 * 16);
        std::vector<std::int32_t> places(16);
        std::vector<float> nodes(3 * 16 + 1), moments(6), scratch(3 * 16);
        Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
        for (std::size_t i = 0; i < 16; ++i) {
            // Opposite points, so that their mean is zero.
            Eigen::Vector3f p;
            for (std::size_t a = 0; a < 3; ++a) {
                r[16 * a + i] = static_cast<std::int16_t>(
                    i % 2 == 0 ? 30000 * shapes::uniform(random) : -static_cast<float>(r[16 * a + i - 1]));
                p[a] = r[16 * a + i];
            }
            sum += (p * p.transpose()).cast<double>();
            places[i] = 3 * i;
            Eigen::Map<Eigen::Vector3f>(nodes.data() + 3 * i) = A * p + b;
            for (std::size_t k = 0; k < 16; ++k) carrier[16 * i + k] = static_cast<std::uint16_t>(i);
        }
        const Eigen::Matrix3f G = sum.inverse().cast<float>();
        moments = {G(0, 0), G(0, 1), G(0, 2), G(1, 1), G(1, 2), G(2, 2)};
        for (int k = 0; k < 16; ++k) {
            const Eigen::Quaternionf turn =
                Eigen::Quaternionf(shapes::uniform(random), shapes::uniform(random), shapes::uniform(random),
                                   shapes::uniform(random))
                    .normalized();
            const float half[3] = {4000, 2500, thinnest};
            for (int a = 0; a < 3; ++a) {
                rest_.centre[a][k] = 15000 * shapes::uniform(random);
                for (int side = 0; side < 3; ++side)
                    rest_.side[side][a][k] = turn.toRotationMatrix()(a, side) * half[side];
            }
        }
        const float reach[3] = {40000, 40000, 40000};
        const AffinePart part{places.data(), 16, true, carrier.data(), 16, r.data(), moments.data(), reach};
        kernels().affine_map(part, rest_, nodes.data(), 64 * 0x1p-24f, scratch.data(), boxes_, &oriented);
    }

    /// A point of box k. along: -1 to 1 along each side.
    Eigen::Vector3f point(int k, const Eigen::Vector3f& along) const {
        Eigen::Vector3f X;
        for (int a = 0; a < 3; ++a)
            X[a] = rest_.centre[a][k] + along[0] * rest_.side[0][a][k] + along[1] * rest_.side[1][a][k] +
                   along[2] * rest_.side[2][a][k];
        return A_ * X + b_;
    }

    OrientedBoxes oriented;

 private:
    Eigen::Matrix3f A_;
    Eigen::Vector3f b_;
    RestBoxes rest_;
    BoxPack boxes_;
};

class Slabs : public testing::Test {
 protected:
    Eigen::Vector3f point() {
        return {shapes::uniform(random), shapes::uniform(random), shapes::uniform(random)};
    }
    Eigen::Matrix3f map() {
        Eigen::Matrix3f A;
        for (int c = 0; c < 3; ++c) A.col(c) = 1e-4f * (Eigen::Vector3f::Unit(c) + 0.7f * point());
        return A;
    }

    std::mt19937 random{7};
};

TEST_F(Slabs, NeverPartBoxesThatAreNear) {
    for (int round = 0; round < 3000; ++round) {
        const float thinnest = round % 3 == 0 ? 0 : 800 * shapes::uniform(random);
        const MovedBoxes s(random, thinnest, map(), 5 * point());
        const int i = random() % 16, k = random() % 16;
        const float distance = round % 2 == 0 ? 0 : 0.5f;
        // A point of box k of t, often a corner, comes to lie within the distance of one of box i of s.
        const auto corner = [&] {
            const Eigen::Vector3f p = point();
            return round % 5 == 0 ? p : Eigen::Vector3f(p.array().sign());
        };
        const Eigen::Vector3f touched = s.point(i, corner()) + 0.99999f * distance * point().normalized();
        const Eigen::Vector3f along = corner();
        const Eigen::Matrix3f A =
            round % 4 == 0 ? Eigen::Matrix3f(1e-4f * Eigen::Matrix3f::Identity()) : map();
        std::mt19937 same = random;
        const MovedBoxes at_origin(same, thinnest, A, Eigen::Vector3f::Zero());
        const MovedBoxes t(random, thinnest, A, touched - at_origin.point(k, along));
        std::uint16_t masks[16] = {};
        masks[i] = 0xffff;
        kernels().clear_parted(s.oriented, t.oriented, distance, 1u << i, masks);
        ASSERT_TRUE(masks[i] >> k & 1) << "round " << round;
    }
}

TEST_F(Slabs, PartObliquePlatesWhoseBoxesOverlap) {
    // Plates turned in all ways, some thicknesses apart: boxes along the axes around them overlap.
    const Eigen::Matrix3f A =
        1e-4f * Eigen::AngleAxisf(0.785f, Eigen::Vector3f(1, 1, 0).normalized()).matrix();
    int parted = 0, boxes = 0;
    for (int round = 0; round < 100; ++round) {
        std::mt19937 same = random;
        const MovedBoxes s(random, 20, A, Eigen::Vector3f::Zero());
        for (int i = 0; i < 16; ++i) {
            const Eigen::Vector3f normal(s.oriented.normal[0][i], s.oriented.normal[1][i],
                                         s.oriented.normal[2][i]);
            for (const float gap : {0.002f, 0.008f}) {
                std::mt19937 again = same;
                const MovedBoxes t(again, 20, A, gap * normal);
                std::uint16_t masks[16] = {};
                masks[i] = 0xffff;
                kernels().clear_parted(s.oriented, t.oriented, 0, 1u << i, masks);
                const bool is_parted = !(masks[i] >> i & 1);
                if (gap < 0.004f)
                    ASSERT_FALSE(is_parted);
                else
                    parted += is_parted;
                boxes += gap > 0.004f;
            }
        }
        random.discard(1);
    }
    EXPECT_EQ(parted, boxes);
}

TEST_F(Slabs, KeepBoxesWithoutANormal) {
    // A map to a point, and ones so large that numbers overflow, here and there.
    for (const float size : {0.f, 1e33f, 1e16f}) {
        const Eigen::Vector3f far = Eigen::Vector3f::Constant(size == 1e16f ? 3e38f : 0);
        const MovedBoxes s(random, 100, size * Eigen::Matrix3f::Identity(), Eigen::Vector3f::Zero()),
            t(random, 100, size * Eigen::Matrix3f::Identity(), far);
        std::uint16_t masks[16];
        std::fill(std::begin(masks), std::end(masks), std::uint16_t{0xffff});
        kernels().clear_parted(s.oriented, t.oriented, 0, 0xffff, masks);
        for (const std::uint16_t mask : masks) EXPECT_EQ(mask, 0xffff);
    }
}

TEST_F(Slabs, KeepBoxesWhoseCoordinateAlongANormalOverflowsOnTheWay) {
    // (3e38, 3e38, -3e38) lies 1.7e38 along (1, 1, 1), but the sum of its first two products is infinite.
    OrientedBoxes s{}, t{};
    for (int k = 0; k < 16; ++k) {
        for (int a = 0; a < 3; ++a) {
            s.normal[a][k] = 0.57735f;
            t.centre[a][k] = a < 2 ? 3e38f : -3e38f;
        }
        s.lo[k] = 1e38f;
        s.hi[k] = 2e38f;
    }
    std::uint16_t mask[16] = {0xffff};
    kernels().clear_parted(s, t, 0, 1, mask);
    EXPECT_EQ(mask[0], 0xffff);
}

}  // namespace
}  // namespace nbd
