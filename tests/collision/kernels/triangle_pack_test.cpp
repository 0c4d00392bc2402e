#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>
#include <vector>

#include "collision/geometry/triangle_triangle.hpp"
#include "collision/kernels/kernels.hpp"
#include "collision/kernels/packs.hpp"
#include "collision/query/narrow_phase.hpp"
#include "tests/support/brute_force.hpp"
#include "tests/support/random_triangles.hpp"
#include "tests/support/shapes.hpp"

namespace nbd {
namespace {

struct Pair {
    Triangle s, t;
};

/// Random pairs of one kind and scale, one per lane of a pack.
std::vector<Pair> some_pairs(RandomTriangles& random, int kind, float scale) {
    std::vector<Pair> pairs(TrianglePack::lanes);
    for (auto& [s, t] : pairs) {
        s = kind == 1 ? random.grid_triangle(3) : random.triangle();
        t = kind == 0 ? random.triangle() : kind == 1 ? random.grid_triangle(3) : random.nearly_touching(s);
        for (Triangle* x : {&s, &t})
            for (Eigen::Vector3f* p : {&x->a, &x->b, &x->c}) *p *= scale;
    }
    return pairs;
}

TrianglePack packed(const std::vector<Pair>& pairs, Triangle Pair::*side) {
    TrianglePack pack;
    for (int lane = 0; lane < TrianglePack::lanes; ++lane) {
        const Triangle& x = pairs[lane].*side;
        const Eigen::Vector3f* corners[] = {&x.a, &x.b, &x.c};
        for (std::size_t k = 0; k < 3; ++k) {
            for (int axis = 0; axis < 3; ++axis) pack.corners[k][axis][lane] = (*corners[k])[axis];
        }
    }
    return pack;
}

TEST(TrianglePack, IsPackedFromItsCornersByAllForms) {
    std::mt19937 random(3);
    std::vector<float> points(4 * 48);
    for (float& x : points) x = shapes::uniform(random);
    const float* corners[3][16];
    for (auto& corner : corners)
        for (const float*& p : corner) p = points.data() + 4 * (random() % 48);
    for (const InstructionSet set : instruction_sets) {
        const Kernels* form = kernels_for(set);
        if (!form) continue;
        TrianglePack pack;
        form->pack_triangles(corners, pack);
        for (int c = 0; c < 3; ++c)
            for (int axis = 0; axis < 3; ++axis)
                for (int k = 0; k < 16; ++k) EXPECT_EQ(pack.corners[c][axis][k], corners[c][k][axis]);
    }
}

constexpr float scales[] = {1, 1e-3f, 1e4f, 1e-13f, 1e-20f, 1e13f, 1e30f};

TEST(TrianglePack, NeverGivesAWrongCertainVerdict) {
    RandomTriangles random(1);
    for (const float scale : scales)
        for (int kind = 0; kind < 3; ++kind) {
            int certain = 0, meeting_lanes = 0, apart_lanes = 0, separated_lanes = 0;
            constexpr int rounds = 400;
            for (int round = 0; round < rounds; ++round) {
                const std::vector<Pair> pairs = some_pairs(random, kind, scale);
                const TrianglePack s = packed(pairs, &Pair::s), t = packed(pairs, &Pair::t);
                const unsigned separated = kernels().separated_by_plane(s, t);
                const PackVerdict verdict = kernels().edges_meet_faces(s, t);
                meeting_lanes += std::popcount(verdict.meeting);
                apart_lanes += std::popcount(verdict.apart);
                separated_lanes += std::popcount(separated);
                EXPECT_EQ(verdict.meeting & (verdict.apart | separated), 0u);
                for (int lane = 0; lane < TrianglePack::lanes; ++lane) {
                    const auto& [a, b] = pairs[lane];
                    const bool truth = triangles_intersect(a, b);
                    const bool meeting = verdict.meeting >> lane & 1, apart = verdict.apart >> lane & 1;
                    ASSERT_FALSE(truth && (apart || (separated >> lane & 1))) << kind << ' ' << scale;
                    ASSERT_FALSE(!truth && meeting) << kind << ' ' << scale;
                    certain += meeting || apart;
                }
            }
            if (scale >= 1e-3f && scale <= 1e4f) {
                EXPECT_GT(meeting_lanes, rounds / 10) << kind;
                EXPECT_GT(apart_lanes, rounds / 10) << kind;
                EXPECT_GT(separated_lanes, rounds / 10) << kind;
            }
            // Random triangles are almost always certain unless numbers under- or overflow.
            if (kind == 0 && scale >= 1e-3f && scale <= 1e4f) {
                EXPECT_GT(certain, rounds * TrianglePack::lanes * 999 / 1000) << scale;
            }
        }
}

TEST(TrianglePack, KeepsExactlyTheIntersectingFaces) {
    RandomTriangles random(2);
    for (const int faces : {1, 5, 16, 17, 40}) {
        Vertices x(3 * faces + 3, 3);
        for (Eigen::Index i = 0; i < x.rows(); ++i) x.row(i) = random.grid_point(4).transpose();
        Faces F(faces + 1, 3);
        for (int f = 0; f <= faces; ++f) F.row(f) << 3 * f, 3 * f + 1, 3 * f + 2;
        const PosedFaces posed{&F, x};
        std::vector<FacePair> pairs;
        for (int f = 0; f <= faces; ++f)
            for (int g = 0; g <= faces; ++g) pairs.push_back({f, g});
        keep_intersecting(pairs, posed, posed);
        EXPECT_EQ(pairs, test::brute_force_intersecting(x, F, x, F));
    }
    std::vector<FacePair> none;
    keep_intersecting(none, {}, {});
    EXPECT_TRUE(none.empty());
}

TEST(TrianglePack, LeavesPairsWithNonFinitePositionsUndecided) {
    RandomTriangles random(3);
    std::vector<Pair> pairs = some_pairs(random, 0, 1);
    for (std::size_t lane = 0; lane < pairs.size(); ++lane) {
        Triangle& x = lane % 2 == 0 ? pairs[lane].s : pairs[lane].t;
        (lane % 3 == 0 ? x.a : lane % 3 == 1 ? x.b : x.c)[lane % 3] = NAN;
    }
    const TrianglePack s = packed(pairs, &Pair::s), t = packed(pairs, &Pair::t);
    EXPECT_EQ(kernels().separated_by_plane(s, t), 0u);
    EXPECT_EQ(kernels().edges_meet_faces(s, t).meeting, 0u);
    EXPECT_EQ(kernels().edges_meet_faces(s, t).apart, 0u);
}

}  // namespace
}  // namespace nbd
