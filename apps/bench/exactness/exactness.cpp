#include "apps/bench/exactness/exactness.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <list>
#include <memory>
#include <numbers>
#include <utility>

#include "collision/geometry/closest_points.hpp"
#include "collision/geometry/triangle_triangle.hpp"
#include "collision/kernels/kernels.hpp"
#include "collision/query/pair_query.hpp"

namespace nbd {
namespace {

using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// Positions about the middle of their box; the half diagonal becomes 1.
Points normalised(const Vertices& nodes) {
    const Points x = nodes.cast<double>();
    const Eigen::RowVector3d lo = x.colwise().minCoeff(), hi = x.colwise().maxCoeff();
    return (x.rowwise() - (lo + hi) / 2) / ((hi - lo).norm() / 2);
}

void twist(Points& x, CounterRandom& random) {
    const double turns = random.uniform(0.3, 3);
    for (auto p : x.rowwise()) {
        const double angle = std::numbers::pi * turns * p[2], c = std::cos(angle), s = std::sin(angle);
        p = Eigen::RowVector3d(c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]);
    }
}

void crush(Points& x, CounterRandom& random) {
    x.col(random.index(3)) *= std::pow(10, random.uniform(-5, -1));
}

void fold(Points& x, CounterRandom& random) {
    const int axis = random.index(3);
    const double plane = random.uniform(-0.3, 0.3) * x.col(axis).cwiseAbs().maxCoeff();
    x.col(axis) = plane - (x.col(axis).array() - plane).abs();
}

void scatter(Points& x, CounterRandom& random) {
    const double by = random.uniform(0.01, 0.1);
    for (auto p : x.rowwise()) p += by * random.unit() * random.direction().transpose();
}

void deform(Points& x, WildPose pose, CounterRandom& random) {
    x *= random.orientation().toRotationMatrix();
    switch (pose) {
        case WildPose::twisted:
            return twist(x, random);
        case WildPose::crushed:
            return crush(x, random);
        case WildPose::inverted:
            return fold(x, random);
        case WildPose::scattered:
            return scatter(x, random);
        case WildPose::far:
            return;
    }
}

}  // namespace

const char* name(WildPose pose) noexcept {
    constexpr const char* names[] = {"twisted", "crushed", "inverted", "scattered", "far"};
    return names[static_cast<int>(pose)];
}

WildScene draw_wild_scene(const Vertices& nodes, WildPose pose, double overlap, CounterRandom random) {
    Points a = normalised(nodes), b = a;
    for (Points* x : {&a, &b}) {
        deform(*x, pose, random);
        *x *= random.orientation().toRotationMatrix();
    }
    const auto middle = [](const Points& x) {
        return Eigen::RowVector3d((x.colwise().minCoeff() + x.colwise().maxCoeff()) / 2);
    };
    const auto half = [](const Points& x) {
        return Eigen::RowVector3d((x.colwise().maxCoeff() - x.colwise().minCoeff()) / 2);
    };
    const Eigen::RowVector3d towards = random.direction().transpose();
    const Eigen::RowVector3d apart =
        (half(a) + half(b)).cwiseProduct(towards) * ((1 - overlap) / towards.cwiseAbs().maxCoeff());
    b.rowwise() += middle(a) + apart - middle(b);
    if (pose == WildPose::far) {
        const Eigen::RowVector3d away = std::pow(10, random.uniform(3, 5)) * random.direction().transpose();
        a.rowwise() += away;
        b.rowwise() += away;
    }
    return {a.cast<float>(), b.cast<float>()};
}

namespace {

struct FaceBox {
    Eigen::Array3d lo, hi;
    int face;
};

Triangle triangle(const VerticesRef& x, const FacesRef& F, int f) {
    return {x.row(F(f, 0)), x.row(F(f, 1)), x.row(F(f, 2))};
}

/// Boxes of all faces, sorted along the first axis. Each is grown by half of `by`, exactly or a little more.
std::vector<FaceBox> sorted_boxes(const VerticesRef& x, const FacesRef& F, double by) {
    std::vector<FaceBox> boxes;
    boxes.reserve(F.rows());
    for (int f = 0; f < F.rows(); ++f) {
        const auto corner = [&](int k) { return x.row(F(f, k)).cast<double>().transpose().array().eval(); };
        const Eigen::Array3d a = corner(0), b = corner(1), c = corner(2);
        boxes.push_back({a.min(b).min(c) - by, a.max(b).max(c) + by, f});
    }
    std::ranges::sort(boxes, {}, [](const FaceBox& box) { return box.lo[0]; });
    return boxes;
}

}  // namespace

std::vector<FacePair> swept_pairs(VerticesRef xa, FacesRef fa, VerticesRef xb, FacesRef fb, float distance) {
    const double by = 0.5000001 * double{distance};  // sides of far boxes round
    const std::vector<FaceBox> a = sorted_boxes(xa, fa, by), b = sorted_boxes(xb, fb, by);
    std::vector<FacePair> pairs;
    const auto compare = [&](const FaceBox& s, const FaceBox& t) {
        if ((s.lo > t.hi).any() || (t.lo > s.hi).any()) return;
        const Triangle p = triangle(xa, fa, s.face), q = triangle(xb, fb, t.face);
        if (distance == 0 ? triangles_intersect(p, q) : triangle_distance(p, q) <= double{distance})
            pairs.push_back({s.face, t.face});
    };
    // Each pair is compared once: when the box that begins later is not yet passed.
    for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
        if (a[i].lo[0] <= b[j].lo[0]) {
            for (std::size_t k = j; k < b.size() && b[k].lo[0] <= a[i].hi[0]; ++k) compare(a[i], b[k]);
            ++i;
        } else {
            for (std::size_t k = i; k < a.size() && a[k].lo[0] <= b[j].hi[0]; ++k) compare(a[k], b[j]);
            ++j;
        }
    }
    std::ranges::sort(pairs);
    return pairs;
}

namespace {

constexpr std::pair<BoundKind, BoundKind> mixes[] = {
    {BoundKind::affine, BoundKind::affine}, {BoundKind::boxes, BoundKind::boxes},
    {BoundKind::exact, BoundKind::exact},   {BoundKind::automatic, BoundKind::automatic},
    {BoundKind::affine, BoundKind::boxes},  {BoundKind::exact, BoundKind::affine},
};

/// The kernels of this machine in turn; those of before come back at the end.
class AllKernels {
 public:
    AllKernels() {
        for (const InstructionSet set : instruction_sets)
            if (const Kernels* form = kernels_for(set)) forms_.push_back(form);
    }
    ~AllKernels() { use_kernels(*before_); }
    AllKernels(const AllKernels&) = delete;
    AllKernels& operator=(const AllKernels&) = delete;
    const std::vector<const Kernels*>& forms() const { return forms_; }

 private:
    const Kernels* before_ = &kernels();
    std::vector<const Kernels*> forms_;
};

/// Two bodies with the given bounds.
struct Couple {
    BoundKind kind_a, kind_b;
    PosedTree a, b;

    Couple(const std::shared_ptr<const CollisionTree>& tree, BoundKind in_a, BoundKind in_b)
        : kind_a(in_a), kind_b(in_b), a(tree, in_a), b(tree, in_b) {}
};

struct Stage {
    WildScene nodes;
    Vertices a, b;
    float distance = 0;  // 0: intersecting faces
    std::vector<FacePair> truth;
};

/// Bodies have a half diagonal of about 1 there.
Stage draw_stage(const BenchBody& body, WildPose pose, const ExactnessConfig& config, int scene) {
    const SurfaceBody& surface = body.surface;
    CounterRandom random(config.seed, scene);
    Stage stage;
    if (scene % 4 == 3) stage.distance = std::pow(10, random.uniform(-4, -2.5));
    for (double overlap = random.uniform(0.02, 0.2); overlap < 0.9 && stage.truth.empty(); overlap += 0.15) {
        stage.nodes = draw_wild_scene(surface.solid.X.cast<float>(), pose, overlap, random);
        stage.a = embedded(surface.W, stage.nodes.a);
        stage.b = embedded(surface.W, stage.nodes.b);
        stage.truth = swept_pairs(stage.a, surface.F, stage.b, surface.F, stage.distance);
    }
    return stage;
}

void begin_pose(PosedTree& tree, const Vertices& x, const Vertices& nodes) {
    if (tree.takes_nodes())
        tree.begin_pose_of_nodes(nodes);
    else
        tree.begin_pose(x);
}

/// Of the scenes in one kind of wild poses.
struct Tally {
    int scenes = 0, touching = 0;
    long pairs = 0, queries = 0, different = 0;
    std::string first_difference{};
};

}  // namespace

Rows check_exactness(const std::string& called, const BenchBody& body, const ExactnessConfig& config,
                     const std::function<void(int)>& done) {
    std::array<Tally, std::size(wild_poses)> tallies;
    std::list<Couple> couples;
    for (const auto& [kind_a, kind_b] : mixes) couples.emplace_back(body.tree, kind_a, kind_b);
    const AllKernels all;
    PairQuery query;
    for (int scene = 0; scene < config.scenes; ++scene) {
        const std::size_t kind = scene % std::size(wild_poses);
        Tally& tally = tallies[kind];
        const Stage stage = draw_stage(body, wild_poses[kind], config, scene);
        ++tally.scenes;
        tally.touching += !stage.truth.empty();
        tally.pairs += std::ssize(stage.truth);
        for (const Kernels* form : all.forms()) {
            use_kernels(*form);
            for (Couple& couple : couples) {
                begin_pose(couple.a, stage.a, stage.nodes.a);
                begin_pose(couple.b, stage.b, stage.nodes.b);
                const auto found = stage.distance > 0 ? query.within(couple.a, couple.b, stage.distance)
                                                      : query.intersecting(couple.a, couple.b);
                ++tally.queries;
                if (std::ranges::equal(found, stage.truth)) continue;
                ++tally.different;
                if (tally.first_difference.empty())
                    tally.first_difference =
                        fmt::format("{} against {}, {} kernels, scene {}", name(couple.kind_a),
                                    name(couple.kind_b), name(form->instructions), scene);
            }
        }
        done(scene + 1);
    }
    Rows rows;
    for (std::size_t kind = 0; kind < tallies.size(); ++kind) {
        const Tally& tally = tallies[kind];
        rows.push_back({{"body", called},
                        {"faces", body.faces()},
                        {"poses", name(wild_poses[kind])},
                        {"scenes", tally.scenes},
                        {"touching", tally.touching},
                        {"pairs", tally.pairs},
                        {"queries", tally.queries},
                        {"different", tally.different},
                        {"first_difference", tally.first_difference}});
    }
    return rows;
}

}  // namespace nbd
