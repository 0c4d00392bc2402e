#include "training/learn/samples.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>

#include "collision/base/counter_random.hpp"

namespace nbd {

namespace {

constexpr std::size_t lanes = 16;
constexpr double spread_share = 0.25;  // of spread samples under `support`
constexpr float side_weight = 0.25f;   // of each side of the box relative to the radius, under `support`
constexpr int measures = 7;            // distance from the centre, and extent along the six sides of a box

/// A patch's vertices without repeats, and the share of each in the patch's list.
struct PatchVertices {
    std::vector<int> ids;
    Eigen::VectorXf share;  // weight in the mean; sum 1

    explicit PatchVertices(std::span<const int> listed) : ids(listed.begin(), listed.end()) {
        std::ranges::sort(ids);
        const std::vector<int> all = ids;
        ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
        share.resize(ids.size());
        for (std::size_t i = 0; i < ids.size(); ++i) {
            const auto [begin, end] = std::equal_range(all.begin(), all.end(), ids[i]);
            share[i] = static_cast<float>(end - begin) / static_cast<float>(all.size());
        }
    }
    int count() const noexcept { return ids.size(); }
    Eigen::RowVector3f mean(VerticesRef x) const {
        Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
        for (std::size_t i = 0; i < ids.size(); ++i) sum += (share[i] * x.row(ids[i])).cast<double>();
        return sum.cast<float>();
    }
    float radius(const Vertices& x, const Eigen::RowVector3f& c) const {
        float squared = 0;
        for (const int v : ids) squared = std::max(squared, (x.row(v) - c).squaredNorm());
        return std::sqrt(squared);
    }
};

/// A patch in one pose.
struct PatchPose {
    const Vertices* x;
    Eigen::RowVector3f c;  // mean of the patch's vertices
    float r;               // largest distance from it
    Eigen::Matrix3f axes;  // of a box, at random, because bodies in use turn freely

    /// Distance of the vertex from the centre and its extent along the six directions.
    std::array<float, measures> measure(int v) const {
        const Eigen::RowVector3f q = x->row(v) - c, s = q * axes;
        return {q.norm(), s[0], s[1], s[2], -s[0], -s[1], -s[2]};
    }
};

std::vector<PatchPose> patch_poses(const PatchVertices& patch, std::span<const Vertices> poses) {
    constexpr std::uint64_t seed = 1;
    std::vector<PatchPose> seen;
    for (std::size_t p = 0; p < poses.size(); ++p) {
        PatchPose pose{.x = &poses[p], .c = patch.mean(poses[p]), .r = 0, .axes = {}};
        pose.r = std::max(patch.radius(poses[p], pose.c), std::numeric_limits<float>::min());
        pose.axes = CounterRandom(seed, p).orientation().toRotationMatrix().cast<float>();
        seen.push_back(pose);
    }
    return seen;
}

/// Vertices that are farthest by some measure in some pose.
std::vector<int> farthest_vertices(const PatchVertices& patch, const std::vector<PatchPose>& poses) {
    std::vector<int> found;
    for (const PatchPose& pose : poses) {
        std::array<float, measures> most;
        most.fill(-std::numeric_limits<float>::infinity());
        std::array<int, measures> at{};
        for (const int v : patch.ids) {
            const auto m = pose.measure(v);
            for (std::size_t k = 0; k < measures; ++k)
                if (m[k] > most[k]) most[k] = m[k], at[k] = v;
        }
        found.insert(found.end(), at.begin(), at.end());
    }
    std::ranges::sort(found);
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
}

/// At most `count` candidates, chosen greedily by what each adds to those before it; stops when none adds
/// anything.
std::vector<int> support_vertices(const PatchVertices& patch, const std::vector<PatchPose>& poses,
                                  int count) {
    const std::vector<int> candidates = farthest_vertices(patch, poses);
    const Eigen::Index rows = measures * poses.size();
    // Each candidate's measures in each pose, relative to the patch's radius.
    Eigen::ArrayXXf reach(rows, candidates.size());
    for (std::size_t p = 0; p < poses.size(); ++p)
        for (std::size_t i = 0; i < candidates.size(); ++i) {
            const auto m = poses[p].measure(candidates[i]);
            for (int k = 0; k < measures; ++k)
                reach(measures * p + k, i) = m[k] / poses[p].r * (k == 0 ? 1 : side_weight);
        }
    std::vector<int> chosen;
    Eigen::ArrayXf reached = Eigen::ArrayXf::Zero(rows);
    while (std::ssize(chosen) < count) {
        const Eigen::ArrayXf gain = (reach.colwise() - reached).max(0.f).colwise().sum().transpose();
        Eigen::Index best = 0;
        if (!(gain.maxCoeff(&best) > 0)) break;
        chosen.push_back(candidates[best]);
        reached = reached.max(reach.col(best));
    }
    return chosen;
}

/// Adds vertices far from those chosen, at rest, until there are `count` or all.
void add_spread_vertices(VerticesRef X, const PatchVertices& patch, int count, std::vector<int>& chosen) {
    const auto far = [&](const Eigen::RowVector3f& point) {
        Eigen::ArrayXf squared(patch.count());
        for (int i = 0; i < patch.count(); ++i) squared[i] = (X.row(patch.ids[i]) - point).squaredNorm();
        return squared;
    };
    Eigen::Index at = 0;
    if (chosen.empty()) {
        far(patch.mean(X)).maxCoeff(&at);
        chosen.push_back(patch.ids[at]);
    }
    Eigen::ArrayXf squared = far(X.row(chosen.front()));
    for (const int v : chosen) squared = squared.min(far(X.row(v)));
    while (std::ssize(chosen) < std::min(count, patch.count())) {
        squared.maxCoeff(&at);
        chosen.push_back(patch.ids[at]);
        squared = squared.min(far(X.row(chosen.back())));
        squared[at] = -1;  // vertices may coincide
    }
}

}  // namespace

std::vector<int> choose_samples(VerticesRef X, std::span<const Vertices> poses, std::span<const int> vertices,
                                SampleRule rule, int count) {
    const PatchVertices patch(vertices);
    std::vector<int> chosen;
    if (patch.count() <= count) {
        chosen = patch.ids;
        chosen.resize((chosen.size() + lanes - 1) / lanes * lanes, chosen.front());
        return chosen;
    }
    if (rule == SampleRule::support) {
        const int supported = count - static_cast<int>(spread_share * count);
        chosen = support_vertices(patch, patch_poses(patch, poses), supported);
    }
    add_spread_vertices(X, patch, count, chosen);
    return chosen;
}

}  // namespace nbd
