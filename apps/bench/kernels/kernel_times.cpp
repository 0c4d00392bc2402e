#include "apps/bench/kernels/kernel_times.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "apps/bench/kernels/plain_bounds.hpp"
#include "apps/bench/measure/median.hpp"
#include "collision/base/stopwatch.hpp"
#include "collision/bounds/learned/learned_boxes.hpp"
#include "collision/bounds/learned/learned_spheres.hpp"
#include "collision/bounds/learned/nbd_bound.hpp"

namespace nbd {
namespace {

constexpr int rounds = 25;

/// Nanoseconds per call of f(i): median of rounds over i = 0 .. count - 1, without the first round. f returns
/// a number, so that the compiler cannot drop the calls.
template <class F>
double nanoseconds(int count, const F& f) {
    std::vector<double> times;
    volatile float sink = 0;
    for (int round = 0; round <= rounds; ++round) {
        float sum = 0;
        const Stopwatch watch;
        for (int i = 0; i < count; ++i) sum += f(i);
        const double seconds = watch.seconds();
        sink = sink + sum;
        if (round > 0) times.push_back(1e9 * seconds / count);
    }
    return median(times);
}

/// The larger one; NaN if either is NaN.
double worse(double a, double b) { return b <= a ? a : b; }

double difference(const Sphere& s, const Sphere& t) {
    return std::max(static_cast<double>((s.c - t.c).norm()), std::abs(double{s.r} - double{t.r}));
}

double difference(const Box& s, const Box& t) {
    return std::max((s.lo - t.lo).abs().head<3>().maxCoeff(), (s.hi - t.hi).abs().head<3>().maxCoeff());
}

float number_of(const Sphere& s) { return s.r + s.c[0]; }
float number_of(const Box& box) { return box.lo[0] + box.hi[1]; }

class Stopwatches {
 public:
    Stopwatches(const CollisionTree& tree, std::span<const Vertices> poses, int nodes)
        : tree_(tree), poses_(poses) {
        // Pairs of siblings, as a traversal requests them.
        const int all = static_cast<int>(tree.spheres.nodes.size()) / 2,
                  pairs = std::clamp(nodes / 2, 1, all);
        for (int i = 0; i < pairs; ++i) {
            const auto first = 1 + 2 * static_cast<int>(std::int64_t{i} * all / pairs);
            nodes_.insert(nodes_.end(), {first, first + 1});
        }
    }

    /// Times nodes. begin(x): starts a pose. ours(node), plain(node): return a volume each.
    template <class Begin, class Ours, class Plain>
    KernelTime nodes(const char* name, const Begin& begin, const Ours& ours, const Plain& plain) const {
        std::vector<double> ours_ns, plain_ns;
        KernelTime time{.name = name};
        const double radius = tree_.spheres.rest[0].r;
        const auto count = static_cast<int>(nodes_.size());
        const auto node = [&](int i) { return nodes_[static_cast<std::size_t>(i)]; };
        for (const Vertices& x : poses_) {
            begin(x);
            for (const int i : nodes_)
                time.difference = worse(time.difference, difference(ours(i), plain(i)) / radius);
            ours_ns.push_back(nanoseconds(count, [&](int i) { return number_of(ours(node(i))); }));
            plain_ns.push_back(nanoseconds(count, [&](int i) { return number_of(plain(node(i))); }));
        }
        time.ours_ns = median(ours_ns);
        time.plain_ns = median(plain_ns);
        return time;
    }

    /// Times the modal coordinates of a pose.
    KernelTime coordinates() const {
        const NbdModel& model = *tree_.nbd;
        const PlainNbd plainly(model);
        ModalCoordinatesScratch scratch;
        Eigen::VectorXf z(model.mode_count());
        std::vector<double> ours_ns, plain_ns;
        KernelTime time{.name = "modal coordinates"};
        for (const Vertices& x : poses_) {
            modal_coordinates(model.modes, x, scratch, z);
            const Eigen::VectorXf plain = plainly.coordinates(x);
            time.difference = worse(time.difference, static_cast<double>((z - plain).norm() / plain.norm()));
            ours_ns.push_back(nanoseconds(1, [&](int) {
                modal_coordinates(model.modes, x, scratch, z);
                return z[0];
            }));
            plain_ns.push_back(nanoseconds(1, [&](int) { return plainly.coordinates(x)[0]; }));
        }
        time.ours_ns = median(ours_ns);
        time.plain_ns = median(plain_ns);
        return time;
    }

 private:
    const CollisionTree& tree_;
    std::span<const Vertices> poses_;
    std::vector<int> nodes_;
};

}  // namespace

std::vector<KernelTime> time_kernels(const CollisionTree& tree, std::span<const Vertices> poses, int nodes) {
    if (poses.empty()) throw std::invalid_argument("no poses to time kernels on");
    if (tree.spheres.nodes.size() < 3)
        throw std::invalid_argument("the tree has one node; allowed: 3 nodes or more");
    const Stopwatches watch(tree, poses, nodes);
    std::vector<KernelTime> times;
    const Vertices* x = nullptr;
    if (tree.learned) {
        LearnedSpheres bound(*tree.learned);
        times.push_back(watch.nodes(
            "learned sphere",
            [&](const Vertices& pose) {
                x = &pose;
                bound.begin_pose(pose);
            },
            [&](int i) { return bound.bound(i); },
            [&](int i) { return plain_learned_sphere(*tree.learned, i, *x); }));
    }
    if (has_bounds(tree, BoundKind::learned_boxes)) {
        const auto grown = [&](int i) {
            const SampleBox samples = sample_box(*tree.learned, i, *x);
            const float growth = tree.learned->boxes[static_cast<std::size_t>(i)].growth * samples.spread;
            const Eigen::Array4f outward = Eigen::Array4f(1, 1, 1, 0) * growth;
            return Box{samples.box.lo - outward, samples.box.hi + outward};
        };
        times.push_back(watch.nodes(
            "learned box", [&](const Vertices& pose) { x = &pose; }, grown,
            [&](int i) { return plain_learned_box(*tree.learned, i, *x); }));
    }
    if (tree.nbd) {
        const NbdModel& model = *tree.nbd;
        const PlainNbd plainly(model);
        ModalCoordinatesScratch scratch;
        Eigen::VectorXf z(model.mode_count()), plain_zn(z);
        FixedVector zn(model.mode_count());
        std::array<Sphere, 2> siblings;
        times.push_back(watch.nodes(
            "nbd node",
            [&](const Vertices& pose) {
                modal_coordinates(model.modes, pose, scratch, z);
                plain_zn = (z - model.z_centre).cwiseProduct(model.z_scale);
                zn.numbers() = plain_zn;
                zn.fix();
            },
            [&](int i) {
                const bool is_first = i % 2 == 1;
                if (is_first) nbd_spheres(model, tree.spheres, i, zn, siblings);
                return siblings[is_first ? 0 : 1];
            },
            [&](int i) { return plainly.sphere(tree.spheres, i, plain_zn); }));
        times.back().max_difference = 5e-3;  // the networks are rounded to bytes
        times.push_back(watch.coordinates());
    }
    for (const KernelTime& time : times)
        if (!(time.difference <= time.max_difference))
            throw std::runtime_error(fmt::format("{}: differs from its plain form by {:.2e} of the radius",
                                                 time.name, time.difference));
    return times;
}

}  // namespace nbd
