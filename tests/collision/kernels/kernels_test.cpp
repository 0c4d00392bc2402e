#include "collision/kernels/kernels.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <string>
#include <vector>

#include "collision/geometry/box.hpp"
#include "collision/kernels/box_pack.hpp"
#include "tests/collision/models.hpp"
#include "tests/support/random_triangles.hpp"

namespace nbd {
namespace {

Box hull_of(const BoxPack& boxes, int count) {
    Box whole = empty_box();
    for (int k = 0; k < count; ++k) whole = joined(whole, boxes.box(k));
    return whole;
}

/// Every instruction set that the CPU supports gives the same bits as the plain kernels.
class KernelForms : public testing::TestWithParam<InstructionSet> {
 protected:
    void SetUp() override {
        form = kernels_for(GetParam());
        if (!form) GTEST_SKIP() << "the CPU does not support this instruction set";
    }
    float number() { return shapes::uniform(random); }

    /// Compares the pairs of boxes that the kernels find with those that tests of one box find.
    void expect_same_pairs(const BoxPack& s, const BoxPack& t, unsigned lanes) {
        const unsigned in_s = lanes & 0xffff, in_t = lanes >> 16;
        Box whole_s = empty_box(), whole_t = empty_box();
        for (int k = 0; k < 16; ++k) {
            if (in_s >> k & 1) whole_s = joined(whole_s, s.box(k));
            if (in_t >> k & 1) whole_t = joined(whole_t, t.box(k));
        }
        for (const float most : {0.f, 0.02f}) {
            std::uint16_t found[16] = {}, expected;
            const unsigned any =
                form->near_pairs(s, in_s, numbers(whole_s), t, in_t, numbers(whole_t), most, found);
            for (int i = 0; i < 16; ++i) {
                if (!(s.box(i).lo + s.box(i).hi).isFinite().all() || !std::isfinite(whole_t.hi.sum()))
                    continue;
                plain.near(&t, 1, numbers(s.box(i)), most, &expected);
                EXPECT_EQ(any >> i & 1 ? found[i] : 0, expected & (in_s >> i & 1 ? in_t : 0));
            }
        }
    }

    const Kernels& plain = *kernels_for(InstructionSet::plain);
    const Kernels* form = nullptr;
    std::mt19937 random{1};
};

TEST_P(KernelForms, FindTheSameNearBoxes) {
    constexpr int count = 3;
    BoxPack packs[count];
    int found = 0;
    for (int round = 0; round < 2000; ++round) {
        const auto box = [&](float size) {
            Box result{{number(), number(), number(), 0}, {}};
            result.hi = result.lo + size * Eigen::Array4f(number() + 1, number() + 1, number() + 1, 0);
            if (round % 50 == 0) result.hi[round % 3] = round % 100 == 0 ? NAN : INFINITY;
            return result;
        };
        for (int k = 0; k < count * BoxPack::lanes; ++k)
            packs[k / BoxPack::lanes].set(k % BoxPack::lanes, box(0.3f));
        const Box other = box(0.5f);
        const unsigned which = random();
        for (const float most : {0.f, 0.02f}) {
            std::uint16_t expected[count], masks[count];
            plain.near(packs, count, numbers(other), most, expected);
            form->near(packs, count, numbers(other), most, masks);
            EXPECT_EQ(std::memcmp(masks, expected, sizeof masks), 0);
            found += most == 0 && expected[0] != 0;
            for (const int of_packs : {1, 2}) {
                unsigned each_expected[32] = {}, each[32] = {};
                plain.near_each(packs, of_packs, packs + 1, which, most, each_expected);
                form->near_each(packs, of_packs, packs + 1, which, most, each);
                EXPECT_EQ(std::memcmp(each, each_expected, sizeof each), 0);
                for (int i = 0; i < 32; ++i) {
                    std::uint16_t halves[2] = {};
                    plain.near(packs, of_packs, numbers(packs[1 + i / 16].box(i % 16)), most, halves);
                    EXPECT_EQ(each[i], which >> i & 1 ? halves[0] | unsigned{halves[1]} << 16 : 0);
                }
            }
        }
        expect_same_pairs(packs[0], packs[1], which);
    }
    EXPECT_GT(found, 500);
}

TEST_P(KernelForms, BoundTriangles) {
    for (int round = 0; round < 200; ++round) {
        std::vector<float> points(4 * 48);
        for (float& x : points) x = number();
        std::array<std::uint8_t, 48> corners;
        for (std::uint8_t& corner : corners) corner = static_cast<std::uint8_t>(random() % 48);
        BoxPack boxes;
        form->triangle_boxes(points.data(), corners.data(), boxes);
        for (std::size_t k = 0; k < 16; ++k) {
            const auto corner = [&](std::size_t c) {
                return Eigen::Map<const Eigen::Vector3f>(points.data() + 4 * corners[16 * c + k]);
            };
            const Box expected = bounding_box(Triangle{corner(0), corner(1), corner(2)});
            const Box found = boxes.box(k);
            EXPECT_TRUE((found.lo == expected.lo).all() && (found.hi == expected.hi).all());
        }
    }
}

TEST_P(KernelForms, ClassifyTrianglePairsAlike) {
    RandomTriangles triangles(2);
    int certain = 0;
    for (int round = 0; round < 2000; ++round) {
        TrianglePack s, t;
        for (int lane = 0; lane < TrianglePack::lanes; ++lane) {
            const Triangle a = triangles.triangle(),
                           b = lane % 2 ? triangles.nearly_touching(a) : triangles.triangle();
            const Eigen::Vector3f* corners[2][3] = {{&a.a, &a.b, &a.c}, {&b.a, &b.b, &b.c}};
            const float scale = lane == 3                     ? 1e-20f
                                : lane == 5                   ? 1e13f
                                : lane == 7 && round % 9 == 0 ? NAN
                                                              : 1.f;
            for (int k = 0; k < 3; ++k)
                for (int axis = 0; axis < 3; ++axis) {
                    s.corners[k][axis][lane] = scale * (*corners[0][k])[axis];
                    t.corners[k][axis][lane] = scale * (*corners[1][k])[axis];
                }
        }
        EXPECT_EQ(form->separated_by_plane(s, t), plain.separated_by_plane(s, t));
        const PackVerdict verdict = plain.edges_meet_faces(s, t);
        EXPECT_EQ(form->edges_meet_faces(s, t), verdict);
        certain += verdict.meeting != 0 && verdict.apart != 0;
    }
    EXPECT_GT(certain, 1000);
}

TEST_P(KernelForms, RoundAlike) {
    for (const int count : {16, 32, 48, 160})
        for (const float size : {1.f, 1e-25f, 1e-31f, 1e-38f, 0.f, 3e38f, INFINITY, NAN}) {
            std::vector<float> x(count);
            for (float& number : x) number = this->number();
            x[4] = 0.999f, x[5] = 2.5f / 16384,
            x[6] = -3.5f / 16384;               // halfway between two fixed-point numbers
            if (count == 48) x[7] = -1.99999f;  // rounds to the most negative number
            for (float& number : x) number *= size;
            std::vector<std::int16_t> expected(x.size(), 1), fixed(x.size(), 2);
            const float scale = plain.fix(x.data(), count, expected.data()),
                        same = form->fix(x.data(), count, fixed.data());
            EXPECT_EQ(std::memcmp(&scale, &same, sizeof scale) == 0 || std::isnan(scale), true);
            EXPECT_EQ(std::isnan(scale), std::isnan(same));
            EXPECT_EQ(fixed, expected) << count << ' ' << size;
            if (size != 1) continue;
            EXPECT_EQ(fixed[5], count == 48 ? 1 : 2);
            EXPECT_EQ(fixed[6], count == 48 ? -2 : -4);
            if (count == 48) {
                EXPECT_EQ(fixed[7], -Kernels::max_fixed);
            }
        }
}

/// A layer with random weights.
struct RandomLayer {
    std::vector<std::int8_t> weights;
    std::vector<std::int32_t> sums;
    std::vector<float> scales, biases;
    ByteLayer layer;

    RandomLayer(std::mt19937& random, int quads, int outputs, bool relu)
        : weights(4 * quads * outputs),
          sums(outputs),
          scales(sums.size()),
          biases(sums.size()),
          layer{.weights = weights.data(),
                .sums = sums.data(),
                .scales = scales.data(),
                .biases = biases.data(),
                .quads = quads,
                .outputs = outputs,
                .relu = relu} {
        for (std::int8_t& w : weights) w = static_cast<std::int8_t>(127.9f * shapes::uniform(random));
        for (float& s : scales) s = 0.01f * shapes::uniform(random);
        for (float& b : biases) b = shapes::uniform(random);
        for (int o = 0; o < outputs; ++o)
            for (int i = 0; i < 4 * quads; ++i) sums[o] += weights[layer.at(o, i)];
    }

    /// Evaluates the layer in double precision.
    Eigen::VectorXd of(const Eigen::VectorXd& x) const {
        Eigen::VectorXd y(layer.outputs);
        for (int o = 0; o < layer.outputs; ++o) {
            double sum = 0;
            for (int i = 0; i < 4 * layer.quads; ++i) sum += x[i] * weights[layer.at(o, i)];
            const std::size_t k = o;
            y[o] = sum * double{scales[k]} + double{biases[k]};
            if (layer.relu) y[o] = std::max(y[o], 0.);
        }
        return y;
    }
};

TEST_P(KernelForms, GiveTheSameBitsForNetworksOfAnyWidth) {
    for (const int quads : {4, 8, 12, 32, 256})
        for (const int width : {16, 32, 48, 128})
            for (const float scale : {0x1p-13f, 0.f, NAN}) {
                std::vector<std::int16_t> x(4 * quads);
                for (std::int16_t& i : x) i = static_cast<std::int16_t>(16384 * number());
                std::vector<RandomLayer> layers;
                for (int n = 0; n < 2; ++n) {
                    layers.emplace_back(random, quads, width, true);
                    layers.emplace_back(random, width / 4, width, true);
                    layers.emplace_back(random, width / 4, 16, false);
                }
                ByteLayer both[2][3];
                for (std::size_t k = 0; k < 6; ++k) both[k / 3][k % 3] = layers[k].layer;
                for (const int count : {1, 2}) {
                    float expected[2][16] = {}, results[2][16] = {};
                    plain.networks(both, count, {}, x.data(), scale, expected, nullptr);
                    form->networks(both, count, {}, x.data(), scale, results, nullptr);
                    for (int n = 0; n < count; ++n) {
                        Eigen::VectorXd y =
                            double{scale} *
                            Eigen::Map<Eigen::Vector<std::int16_t, Eigen::Dynamic>>(x.data(), 4 * quads)
                                .cast<double>();
                        for (int l = 0; l < 3; ++l) y = layers[3 * n + l].of(y);
                        for (int o = 0; o < 16; ++o) {
                            EXPECT_TRUE(results[n][o] == expected[n][o] || std::isnan(scale));
                            EXPECT_EQ(std::isnan(results[n][o]), std::isnan(scale));
                            EXPECT_EQ(std::isnan(expected[n][o]), std::isnan(scale));
                            if (!std::isnan(scale)) {
                                // Allows for rounding the hidden layers to 8 bits.
                                EXPECT_NEAR(expected[n][o], y[o], 0.01 + 0.02 * y.cwiseAbs().maxCoeff());
                            }
                        }
                    }
                }
            }
}

TEST_P(KernelForms, GiveTheSameBitsForProductsOfAnySize) {
    for (const int rows : {32, 96, 128, 160, 1536})
        for (const int columns : {1, 2, 3, 4, 5, 11}) {
            std::vector<std::int16_t> M(rows * columns), x(rows);
            for (std::int16_t& i : M) i = static_cast<std::int16_t>(16383 * number());
            for (std::int16_t& i : x) i = static_cast<std::int16_t>(16384 * number());
            std::vector<float> scales(columns), expected(scales), results(scales);
            for (float& s : scales) s = number();
            const FixedColumns all{M.data(), scales.data(), rows, columns};
            plain.products(all, x.data(), 0x1p-14f, expected.data());
            form->products(all, x.data(), 0x1p-14f, results.data());
            EXPECT_EQ(results, expected) << rows << ' ' << columns;
        }
}

TEST_P(KernelForms, DoNotOverflowForTheLargestNumbers) {
    constexpr int inputs = Kernels::max_inputs;
    for (const int sign : {1, -1}) {
        RandomLayer first(random, inputs / 4, 16, true), second(random, 4, 16, true),
            third(random, 4, 16, false);
        std::ranges::fill(first.weights, static_cast<std::int8_t>(127));
        std::ranges::fill(first.sums, 127 * inputs);
        const ByteLayer both[2][3] = {{first.layer, second.layer, third.layer},
                                      {first.layer, second.layer, third.layer}};
        const std::vector<std::int16_t> x(inputs, static_cast<std::int16_t>(sign * Kernels::max_fixed)),
            M(4 * inputs, static_cast<std::int16_t>(1 - Kernels::max_fixed));
        const std::vector<float> scales(4, 1.f);
        const FixedColumns columns{M.data(), scales.data(), inputs, 4};
        float expected[2][16], results[2][16], expected_products[4], products[4];
        plain.networks(both, 2, columns, x.data(), 0x1p-20f, expected, expected_products);
        form->networks(both, 2, columns, x.data(), 0x1p-20f, results, products);
        for (int o = 0; o < 16; ++o) EXPECT_EQ(results[1][o], expected[1][o]);
        for (int c = 0; c < 4; ++c) {
            EXPECT_EQ(products[c], expected_products[c]);
            EXPECT_FLOAT_EQ(products[c], 0x1p-20f * -sign * 16384 * 16383 * inputs);
        }
    }
}

TEST_P(KernelForms, GiveTheSameAffineBoxes) {
    for (int round = 0; round < 300; ++round) {
        const int count = 16 * (1 + round % 5), carriers = 1 + round % 9, total = 200;
        std::vector<float> nodes(3 * total + 1), moments(6), reach(3), scratch(3 * 80);
        std::vector<std::int32_t> places;
        std::vector<std::uint16_t> carrier;
        std::vector<std::int16_t> rest;
        for (float& x : nodes) x = 100 + number();
        for (float& x : moments) x = 1e-10f * number();
        for (float& x : reach) x = 32767;
        for (int i = 0; i < count; ++i) places.push_back(3 * static_cast<int>(random() % total));
        for (int i = 0; i < 16 * carriers; ++i)
            carrier.push_back(static_cast<std::uint16_t>(random() % static_cast<unsigned>(count)));
        for (int i = 0; i < 3 * count; ++i) rest.push_back(static_cast<std::int16_t>(32767 * number()));
        RestBoxes boxes;
        for (float* x = boxes.centre[0]; x < boxes.centre[0] + 3 * 16; ++x) *x = 20000 * number();
        for (float* x = boxes.side[0][0]; x < boxes.side[0][0] + 9 * 16; ++x) *x = 5000 * number();
        const AffinePart part{places.data(), count,       round % 2 == 0, carrier.data(),
                              carriers,      rest.data(), moments.data(), reach.data()};
        BoxPack expected, found;
        OrientedBoxes oriented_expected[2], oriented[2];
        for (int i = 0; i < 2; ++i) {
            for (float& x : nodes) x += 0.1f * number();
            plain.affine_map(part, boxes, nodes.data(), 4e-6f, scratch.data(), expected,
                             &oriented_expected[i]);
            form->affine_map(part, boxes, nodes.data(), 4e-6f, scratch.data(), found, &oriented[i]);
            EXPECT_EQ(std::memcmp(&expected, &found, sizeof found), 0) << "round " << round;
            EXPECT_EQ(std::memcmp(&oriented_expected[i], &oriented[i], sizeof oriented[i]), 0)
                << "round " << round;
        }
        const int boxes_in_hull = 1 + round % 16;
        Box hull;
        form->hull(expected, boxes_in_hull, numbers(hull));
        const Box own = hull_of(expected, boxes_in_hull);
        EXPECT_TRUE((hull.lo == own.lo).all() && (hull.hi == own.hi).all()) << boxes_in_hull;
        std::uint16_t masks_expected[16], masks[16];
        for (int i = 0; i < 16; ++i) masks_expected[i] = masks[i] = static_cast<std::uint16_t>(random());
        const float distance = round % 2 == 0 ? 0 : 0.1f;
        const auto which = static_cast<unsigned>(random()) & 0xffff;
        plain.clear_parted(oriented[0], oriented[1], distance, which, masks_expected);
        form->clear_parted(oriented[0], oriented[1], distance, which, masks);
        EXPECT_EQ(std::memcmp(masks, masks_expected, sizeof masks), 0);
    }
}

INSTANTIATE_TEST_SUITE_P(Kernels, KernelForms,
                         testing::Values(InstructionSet::avx2, InstructionSet::avx512, InstructionSet::neon),
                         [](const auto& info) {
                             std::string title = name(info.param);
                             title.front() = static_cast<char>(std::toupper(title.front()));
                             return title;
                         });

TEST(Kernels, AreTheFastestThatTheCpuSupports) {
    ASSERT_NE(kernels_for(InstructionSet::plain), nullptr);
    for (const InstructionSet set : instruction_sets)
        if (const Kernels* form = kernels_for(set)) {
            EXPECT_EQ(form->instructions, set);
            EXPECT_GE(kernels().instructions, set);
        }
}

}  // namespace
}  // namespace nbd
