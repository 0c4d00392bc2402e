#include "sim/barrier/host_proof.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <ostream>
#include <set>
#include <vector>

#include "collision/base/counter_random.hpp"
#include "collision/geometry/triangle_triangle.hpp"
#include "meshing/body/embed.hpp"
#include "meshing/surface/quadratic_tets.hpp"
#include "sim/barrier/intersections.hpp"
#include "sim/barrier/near_features.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/support/box_body.hpp"
#include "tests/support/box_mesh.hpp"

namespace nbd {
namespace {

/// Each vertex half way to the mean of those around it.
Embedding smoothed(const Embedding& W, const Faces& F) {
    std::vector<std::set<int>> around(W.rows());
    for (Eigen::Index f = 0; f < F.rows(); ++f)
        for (int k = 0; k < 3; ++k) around[F(f, k)].insert({F(f, (k + 1) % 3), F(f, (k + 2) % 3)});
    std::vector<Eigen::Triplet<double>> means;
    for (int v = 0; v < W.rows(); ++v) {
        means.emplace_back(v, v, 0.5);
        for (const int w : around[v]) means.emplace_back(v, w, 0.5 / static_cast<double>(around[v].size()));
    }
    Embedding mean(W.rows(), W.rows());
    mean.setFromTriplets(means.begin(), means.end());
    return (mean * W).pruned();
}

/// A box whose surface is much finer than its nodes, with bumps that leave its tetrahedra's faces, so that
/// vertices hang on one to four nodes. Nothing leaves the tetrahedra. smoothings: of its surface, whose
/// vertices then hang on the nodes of several tetrahedra.
struct FineBox {
    explicit FineBox(int levels, double size = 1, int smoothings = 0) {
        const Body body = test::fine_box_body(size * Eigen::Vector3d(1, 0.4, 0.4), {5, 2, 2}, levels);
        tets = body.tets;
        Embedding W = body.W;
        for (Eigen::Index v = 0; v < W.rows(); ++v) {
            if (v % 3 == 0) continue;
            // Somewhat towards the opposite node of a tetrahedron that has the vertex on its boundary.
            std::vector<int> nodes;
            for (Embedding::InnerIterator entry(W, v); entry; ++entry)
                if (entry.value() > 1e-9) nodes.push_back(entry.col());
            for (Eigen::Index t = 0; t < tets.T.rows(); ++t) {
                const auto row = tets.T.row(t);
                if (!std::ranges::all_of(nodes, [&](int n) { return (row.array() == n).any(); })) continue;
                Eigen::RowVectorXd weights = Eigen::RowVectorXd(W.row(v));
                weights *= 1 - 0.02 * (v % 5);
                for (const int node : row) weights[node] += 0.02 * (v % 5) / 4;
                W.row(v) = weights.sparseView();
                break;
            }
        }
        for (int k = 0; k < smoothings; ++k) W = smoothed(W, body.surface.F);
        W.makeCompressed();
        shape = std::make_shared<const ContactShape>(W, body.surface.F, tets.X);
    }
    /// The surface of a box deep within a box of few quadratic tetrahedra.
    static FineBox in_quadratic_cage(double size) {
        FineBox box;
        box.tets = make_quadratic(test::box_mesh(size * Eigen::Vector3d(1, 0.4, 0.4), {3, 1, 1}));
        TriMesh surface = test::box(0.8 * size, 0.3 * size, 0.25 * size, 12);
        surface.X.rowwise() += size * Eigen::RowVector3d(0.1, 0.05, 0.08);
        box.shape = std::make_shared<const ContactShape>(embed(box.tets, surface.X), surface.F, box.tets.X);
        return box;
    }
    TetMesh tets;
    std::shared_ptr<const ContactShape> shape;

 private:
    FineBox() = default;
};

double noise(std::uint64_t stream, std::uint64_t i) { return 2 * counter_uniform(17, stream, i) - 1; }

/// Nodes bent about an axis, turned, and moved at random.
Nodes posed(const Nodes& X, double bend, double turn, double random, std::uint64_t seed) {
    const double size = X.col(0).maxCoeff() - X.col(0).minCoeff();
    const Eigen::Matrix3d R =
        Eigen::AngleAxisd(turn, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
    Nodes x = X;
    for (Eigen::Index i = 0; i < X.rows(); ++i) {
        const double angle = bend * X(i, 0) / size, r = (bend != 0 ? size / bend : 0) + X(i, 2);
        Eigen::Vector3d p = X.row(i);
        if (bend != 0) p = {r * std::sin(angle), X(i, 1), r * std::cos(angle)};
        for (int k = 0; k < 3; ++k) p[k] += random * size * noise(seed, 3 * i + k);
        x.row(i) = R * p;
    }
    return x;
}

struct Pose {
    double bend, turn, random;
};
/// From at rest to crumpled; the first three are mild.
constexpr Pose poses[] = {{0, 0, 0},    {0.3, 1, 0},    {0.5, 2, 0.002}, {2, 0.3, 0.01},
                          {5, 2, 0.01}, {6.5, 0, 0.02}, {0.5, 3, 0.06},  {-4, 1, 0.04}};

std::set<FacePair> set_of(std::span<const FacePair> pairs) { return {pairs.begin(), pairs.end()}; }

/// Features of two faces at a share of the motion.
double feature_distance(const MovingSurface& s, const std::vector<MovingSurface>& all,
                        const FeaturePair& pair, double share, bool at_rest) {
    std::array<Eigen::Vector3d, 4> x;
    const auto at = corners(pair, all);
    for (std::size_t k = 0; k < 4; ++k)
        x[k] = at_rest ? Eigen::Vector3d(s.rest().row(at[k].vertex)) : s.at(at[k].vertex, share);
    return closest_points(pair.kind, x).distance;
}

struct Box {
    double size;
    int smoothings;
    bool in_quadratic_cage = false;
    friend void PrintTo(const Box& box, std::ostream* out) {
        *out << box.size << " m, smoothed " << box.smoothings << " times"
             << (box.in_quadratic_cage ? ", in a quadratic cage" : "");
    }
};

class HostProofTest : public testing::TestWithParam<Box> {
 protected:
    void SetUp() override {
        const FineBox box = GetParam().in_quadratic_cage ? FineBox::in_quadratic_cage(GetParam().size)
                                                         : FineBox(2, GetParam().size, GetParam().smoothings);
        surfaces_.emplace_back(box.shape, box.tets, 0);
        X_ = box.tets.X;
        leaf_of_.resize(surface().F().rows());
        const WideTree& tree = *surfaces_[0].own_tree().box_tree();
        for (int leaf = 0; leaf < tree.leaves(); ++leaf)
            for (int k = 0; k < tree.faces_in[leaf]; ++k) leaf_of_[tree.faces[tree_width * leaf + k]] = leaf;
    }
    const MovingSurface& surface() const { return surfaces_[0]; }
    /// A motion from a pose to a pose beyond it by this share of the way from rest.
    void move(const Pose& pose, double step) {
        surfaces_[0].move(posed(X_, pose.bend, pose.turn, pose.random, 1),
                          posed(X_, pose.bend * (1 + step), pose.turn + step, pose.random * (1 + step), 1));
    }
    bool have_common_vertex(int a, int b) const {
        for (int k = 0; k < 3; ++k)
            if ((surface().F().row(b).array() == surface().F()(a, k)).any()) return true;
        return false;
    }

    std::vector<MovingSurface> surfaces_;
    Nodes X_;
    std::vector<int> leaf_of_;
};

TEST_P(HostProofTest, ItsFacesKeepTheirShareOfTheirDistance) {
    ASSERT_TRUE(surface().hangs_on_nodes());
    const NumberedSurface numbered = surface().numbered(0);
    for (const Pose& pose : poses) {
        for (const double step : {0.0, 0.05}) {
            move(pose, step);
            const HostProof& proof = *surface().proof();
            const std::set<FacePair> open = set_of(proof.open_faces());
            std::set<LeafPair> open_leaves(proof.open_leaves().begin(), proof.open_leaves().end());
            // Of which leaves something is known, a query tells: of those, it gives the open ones alone.
            SelfQuery query;
            const auto found = set_of(query.boxes_within(
                surfaces_[0].own_tree(), static_cast<float>(GetParam().size), proof.known_leaves(), {}));
            int proved = 0, all = 0;
            for (int a = 0; a < surface().F().rows(); a += 23)
                for (int b = a + 1; b < surface().F().rows(); ++b) {
                    const auto [leaf_a, leaf_b] = std::minmax(leaf_of_[a], leaf_of_[b]);
                    const bool is_common = have_common_vertex(a, b);
                    if (!is_common && found.contains({a, b})) continue;  // of leaves that are not known
                    ++all;
                    if (open.contains({a, b}) || (!is_common && open_leaves.contains({leaf_a, leaf_b})))
                        continue;
                    ++proved;
                    if (proof.hang_on_one_host({a, b})) continue;
                    if (!is_common && (a + b) % 5 != 0) continue;  // a part of them is enough
                    for_each_owned_pair(numbered, numbered, {a, b}, [&](const FeaturePair& pair, auto) {
                        const auto at = corners(pair, surfaces_);
                        for (std::size_t k = 0; k < corners_of_a(pair.kind); ++k)
                            for (std::size_t l = corners_of_a(pair.kind); l < 4; ++l)
                                if (at[k].vertex == at[l].vertex) return;
                        const double rest = feature_distance(surface(), surfaces_, pair, 0, true);
                        for (const double share : {0.0, 0.5, 1.0})
                            ASSERT_GE(feature_distance(surface(), surfaces_, pair, share, false),
                                      HostProof::least_share * rest * (1 - 1e-9))
                                << a << ' ' << b;
                    });
                }
            // On few quadratic tetrahedra, whose gradients jump, less is proved.
            if (&pose < poses + 3) {
                EXPECT_GT(proved, (GetParam().in_quadratic_cage ? 0.5 : 0.8) * all) << pose.bend;
            }
        }
    }
}

/// What is found is what a look at all pairs finds, but for faces on one host.
TEST_P(HostProofTest, NearFeaturesAreThoseThatALookAtAllPairsFinds) {
    NearFeatureSearch search;
    search.begin(surfaces_, {});
    const double reach = 0.02 * GetParam().size;
    int near = 0;
    for (const Pose& pose : poses) {
        move(pose, 0.02);
        std::set<FeaturePair> found;
        for (const NearFeatures& n : search.find(surfaces_, reach))
            EXPECT_TRUE(found.insert(n.pair).second) << "twice";
        const NumberedSurface numbered = surface().numbered(0);
        for (int a = 0; a < surface().F().rows(); a += 4)
            for (int b = a + 1; b < surface().F().rows(); ++b) {
                if (surface().proof()->hang_on_one_host({a, b})) continue;
                Eigen::AlignedBox3d of_a, of_b;
                for (int k = 0; k < 3; ++k)
                    for (const double share : {0.0, 1.0}) {
                        of_a.extend(surface().at(surface().F()(a, k), share));
                        of_b.extend(surface().at(surface().F()(b, k), share));
                    }
                if (of_a.exteriorDistance(of_b) > reach) continue;
                for_each_owned_pair(numbered, numbered, {a, b}, [&](const FeaturePair& pair, auto) {
                    const auto at = corners(pair, surfaces_);
                    for (std::size_t k = 0; k < corners_of_a(pair.kind); ++k)
                        for (std::size_t l = corners_of_a(pair.kind); l < 4; ++l)
                            if (at[k].vertex == at[l].vertex) return;
                    double least = reach;
                    for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0})
                        least = std::min(least, feature_distance(surface(), surfaces_, pair, share, false));
                    if (least >= std::min(reach, HostProof::least_share *
                                                     feature_distance(surface(), surfaces_, pair, 0, true)))
                        return;
                    ++near;
                    EXPECT_TRUE(found.contains(pair)) << a << ' ' << b << " at bend " << pose.bend;
                });
            }
    }
    EXPECT_GT(near, 50);
}

TEST_P(HostProofTest, IntersectionsAreThoseOfALookAtAllPairs) {
    IntersectionSearch search;
    search.begin(surfaces_, 0);
    int intersecting = 0;
    for (const Pose& pose : poses) {
        move(pose, 0);
        std::set<FacePair> found;
        for (const Intersection& i : search.find(surfaces_)) found.insert({i.a, i.b});
        // The same surface, placed vertex by vertex, without a proof.
        Nodes x(surface().rest().rows(), 3);
        for (Eigen::Index v = 0; v < x.rows(); ++v) x.row(v) = surface().end(v);
        std::vector<MovingSurface> plain;
        plain.emplace_back(surface().F(), surface().rest(), 0);
        ASSERT_FALSE(plain[0].hangs_on_nodes());
        IntersectionSearch all;
        all.begin(plain, 0);
        plain[0].move(x, x);
        std::set<FacePair> expected;
        for (const Intersection& i : all.find(plain))
            if (!surface().proof()->hang_on_one_host({i.a, i.b})) expected.insert({i.a, i.b});
        EXPECT_EQ(found, expected) << pose.bend;
        intersecting += static_cast<int>(expected.size());
    }
    EXPECT_GT(intersecting, 50);
}

TEST_P(HostProofTest, NumbersThatAreNotFiniteProveNothing) {
    Nodes x = X_;
    x(7, 1) = std::numeric_limits<double>::quiet_NaN();
    HostProof proof = *surface().proof();
    proof.prove(X_, X_);
    const auto at_rest = proof.open_leaves().size() + proof.open_faces().size();
    proof.prove(X_, x);
    EXPECT_GT(proof.open_leaves().size() + proof.open_faces().size(), at_rest);
}

INSTANTIATE_TEST_SUITE_P(Boxes, HostProofTest,
                         testing::Values(Box{1e-3, 0}, Box{100, 0}, Box{1, 4}, Box{1e-3, 0, true},
                                         Box{100, 0, true}));

TEST(HostProof, TwinsShareWhatIsKnownAtRest) {
    const FineBox box(2);
    MovingSurface first(box.shape, box.tets, 0), twin(first, 1);
    EXPECT_EQ(twin.body(), 1);
    EXPECT_EQ(twin.rest(), first.rest());
    for (MovingSurface* s : {&first, &twin}) s->move(posed(box.tets.X, 2, 1, 0.01, 1), box.tets.X);
    EXPECT_TRUE(std::ranges::equal(first.proof()->open_faces(), twin.proof()->open_faces()));
}

/// A body that touches itself at rest is found, though a proof takes it that there is none.
TEST(HostProof, ItsSurfaceIsLookedAtWholeAtRest) {
    const FineBox box(2);
    Embedding W = box.shape->W;
    // A vertex of the upper side is put below the lower side's faces.
    const Nodes rest = embedded(W, box.tets.X);
    Eigen::Index top = 0, node = 0;
    double best = 1;
    for (Eigen::Index v = 0; v < rest.rows(); ++v)
        if (const double off = (rest.row(v) - Eigen::RowVector3d(0.05, 0.02, 0.2)).norm(); off < best) {
            best = off;
            top = v;
        }
    (box.tets.X.rowwise() - Eigen::RowVector3d(0, 0, -0.2)).rowwise().norm().minCoeff(&node);
    Eigen::RowVectorXd weights = Eigen::RowVectorXd::Zero(W.cols());
    weights[node] = 1;
    W.row(top) = weights.sparseView();
    W.makeCompressed();
    std::vector<MovingSurface> surfaces;
    surfaces.emplace_back(std::make_shared<const ContactShape>(W, box.shape->F, box.tets.X), box.tets, 0);
    IntersectionSearch search;
    search.begin(surfaces, 0);
    EXPECT_FALSE(search.at_rest().empty());
    EXPECT_TRUE(search.find(surfaces).empty());
}

}  // namespace
}  // namespace nbd
