#include "sim/contact/nearest_face.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "meshing/parallel/parallel_for.hpp"

namespace nbd {
namespace {

bool is_in_reach(const PosedPatches& points, int vertex, const PosedPatches& others, int face,
                 double distance, const ContactReach& reach) {
    return distance <= reach.least() ||
           (distance <= reach.most() &&
            distance <= reach.least() + approach(points, vertex, others, face, reach));
}

}  // namespace

ClosestPoints closest_point(const ContactSurface& surface, int face, const Eigen::Vector3d& p) {
    const auto corners = surface.F().row(face);
    return closest_point_triangle(p, surface.x(corners[0]), surface.x(corners[1]), surface.x(corners[2]));
}

NearestFace measure(const ContactSurface& surface, int face, const Eigen::Vector3d& p, double reach) {
    return measure(surface, face, closest_point(surface, face, p), reach);
}

NearestFace measure(const ContactSurface& surface, int face, const ClosestPoints& closest, double reach) {
    /// At smaller shares of `reach` the line between two points is too short to give a direction.
    constexpr double direction_share = 1e-3;
    const Eigen::Vector3d outward = surface.feature_normal(face, closest.weights_b);
    const double sign = closest.gap.dot(outward) < 0 ? -1 : 1;
    const bool far = closest.distance > direction_share * reach;
    return {.distance = sign * closest.distance,
            .face = face,
            .barycentric = closest.weights_b,
            .normal = far ? Eigen::Vector3d(sign * closest.gap / closest.distance) : outward};
}

double approach(const PosedPatches& points, int vertex, const PosedPatches& others, int face,
                const ContactReach& reach) {
    const Eigen::Vector3f own = points.motion(vertex);
    float most = 0;
    for (const int corner : others.surface().F().row(face))
        most = std::max(most, (own - others.motion(corner)).norm());
    return std::min(reach.approach, double{most});
}

NearestFace nearest_on_side(const PosedPatches& points, int vertex, const PosedPatches& others,
                            std::span<const PatchPair> pairs, const ContactReach& reach,
                            const Eigen::Vector3d& side) {
    const ContactSurface& surface = others.surface();
    const Eigen::Vector3d p = points.surface().x(vertex);
    NearestFace nearest;
    for (const PatchPair& pair : pairs)
        for (const int face : surface.patches().faces[pair.b]) {
            const NearestFace candidate = measure(surface, face, p, reach.most());
            const double distance = std::abs(candidate.distance), least = std::abs(nearest.distance);
            if (candidate.normal.dot(side) > 0 &&
                is_in_reach(points, vertex, others, face, distance, reach) &&
                (distance < least || (distance == least && face < nearest.face)))
                nearest = candidate;
        }
    return nearest;
}

void NearestFaceSearch::begin_patch(std::span<const PatchPair> pairs) {
    const PatchBounds& own = points_.bounds(pairs.front().a);
    const auto least = static_cast<float>(reach_.least()), approach = static_cast<float>(reach_.approach);
    std::array<float, 3> middle;
    float squared_radius = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        middle[i] = (own.lo[i] + own.hi[i]) / 2;
        squared_radius += (own.hi[i] - own.lo[i]) * (own.hi[i] - own.lo[i]) / 4;
    }
    const float radius = std::sqrt(squared_radius);
    of_all_.clear();
    float most = std::numeric_limits<float>::infinity();
    for (const PatchPair& pair : pairs) {
        const PosedPatch& posed = others_[pair.b];
        const float reach = least + std::min(approach, relative_motion(own, others_.bounds(pair.b))) + slack_;
        const float distance = posed.distance_to_centres(middle);
        if (distance - posed.radius - radius > reach) continue;
        of_all_.push_back({distance - posed.radius - radius, reach, pair.b});
        // A face that is certainly in reach of all rules out those that are certainly farther from all.
        const float upper = distance + radius + slack_;
        if (upper <= least) most = std::min(most, upper);
    }
    std::erase_if(of_all_, [&](const NearPatch& patch) { return patch.distance > most + slack_; });
    std::ranges::sort(of_all_, {}, &NearPatch::distance);
}

int NearestFaceSearch::nearest(int vertex) {
    const std::array<float, 3> q = points_.position(vertex);
    const Eigen::Vector3f& motion = points_.motion(vertex);
    const auto least = static_cast<float>(reach_.least()), approach = static_cast<float>(reach_.approach);
    near_.clear();
    candidates_.clear();
    most_ = std::numeric_limits<float>::infinity();
    for (const NearPatch& patch : of_all_) {
        if (patch.distance > most_ + slack_) break;
        const PatchBounds& bounds = others_.bounds(patch.patch);
        const float reach = least + std::min(approach, relative_motion(motion, bounds)) + slack_,
                    farthest = std::min(reach, most_ + slack_);
        if (bounds.squared_distance_to_box(q) > farthest * farthest) continue;
        const PosedPatch& posed = others_[patch.patch];
        const float distance = posed.distance_to_centres(q);
        if (distance - posed.radius > farthest) continue;
        near_.push_back({distance - posed.radius, reach, patch.patch});
        if (distance + slack_ <= least) most_ = std::min(most_, distance + slack_);
    }
    for (const NearPatch& patch : near_)
        if (patch.distance <= most_ + slack_) visit(patch, vertex, q);
    return nearest_candidate(vertex);
}

bool NearestFaceSearch::in_reach(int vertex, int face, double distance) const {
    return is_in_reach(points_, vertex, others_, face, distance, reach_);
}

void NearestFaceSearch::visit(const NearPatch& near, int vertex, const std::array<float, 3>& q) {
    const PosedPatch& posed = others_[near.patch];
    const float most = squared(std::min(most_, near.reach)), closest = posed.squared_distances(q, squared_);
    if (!(closest <= most) && posed.slivers == 0) return;
    const auto faces = others_.surface().patches().faces[near.patch];
    for (std::size_t i = 0; i < faces.size(); ++i) {
        const bool sliver = posed.slivers >> i & 1;
        if (sliver || squared_[i] <= most) candidates_.push_back({sliver ? 0 : squared_[i], faces[i]});
        if (squared_[i] == closest && in_reach(vertex, faces[i], std::sqrt(closest) + slack_))
            most_ = std::min(most_, std::sqrt(closest) + slack_);
    }
}

/// Measures the candidates in double precision.
int NearestFaceSearch::nearest_candidate(int vertex) {
    // The likeliest first: it rules out most others.
    if (!candidates_.empty())
        std::swap(candidates_.front(), *std::ranges::min_element(candidates_, {}, &Candidate::squared));
    const ContactSurface& surface = others_.surface();
    const Eigen::Vector3d p = points_.surface().x(vertex);
    double least = std::numeric_limits<double>::infinity();
    float most = squared(most_);
    int nearest = -1;
    for (const Candidate& candidate : candidates_) {
        if (!(candidate.squared <= most)) continue;
        const int face = candidate.face;
        if (!in_reach(vertex, face, std::sqrt(candidate.squared) - slack_)) continue;
        const double distance = closest_point(surface, face, p).distance;
        ++measured_;
        if ((distance < least || (distance == least && face < nearest)) && in_reach(vertex, face, distance)) {
            least = distance;
            nearest = face;
            most = std::min(most, squared(static_cast<float>(distance)));
        }
    }
    return nearest;
}

NearestFaces nearest_faces(const PosedPatches& points, const PosedPatches& others,
                           std::span<const std::span<const PatchPair>> groups, const ContactReach& reach,
                           std::span<const SoughtVertex> sought) {
    constexpr std::size_t vertices_per_task = 128;
    const std::size_t tasks = (sought.size() + vertices_per_task - 1) / vertices_per_task;
    NearestFaces result{.of_vertices = std::vector<int>(sought.size())};
    std::vector<long> measured(tasks);
    parallel_for(
        tasks,
        [&](int task) {
            NearestFaceSearch search(points, others, reach);
            const std::size_t first = static_cast<std::size_t>(task) * vertices_per_task;
            for (std::size_t i = first; i < std::min(first + vertices_per_task, sought.size()); ++i) {
                const auto& [vertex, group] = sought[i];
                if (i == first || group != sought[i - 1].group) search.begin_patch(groups[group]);
                result.of_vertices[i] = search.nearest(vertex);
            }
            measured[task] = search.measured();
        },
        1);
    result.measured = std::accumulate(measured.begin(), measured.end(), 0L);
    return result;
}

}  // namespace nbd
