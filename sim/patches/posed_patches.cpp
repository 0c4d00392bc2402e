#include "sim/patches/posed_patches.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "meshing/parallel/parallel_for.hpp"

namespace nbd {
namespace {

constexpr float far_away = 1e15f;
constexpr std::array<float, 3> nowhere{far_away, far_away, far_away};
constexpr int patches_per_task = 64;
/// Twice the area over the product of the sides, squared, below which a face is a sliver.
constexpr float thin = 1e-4f;

/// 1 / x, or 0 unless x > 0.
float inverse_of(float x) noexcept { return x > 0 ? 1 / x : 0; }

float least(float a, float b) noexcept { return a < b ? a : b; }
float unit_interval(float x) noexcept { return least(x > 0 ? x : 0, 1); }

}  // namespace

float PosedPatch::distance_to_centres(const std::array<float, 3>& p) const noexcept {
    PatchLanes squared;
    for (std::size_t k = 0; k < ContactPatches::width; ++k) {
        const float x = p[0] - centre[0][k], y = p[1] - centre[1][k], z = p[2] - centre[2][k];
        squared[k] = x * x + y * y + z * z;
    }
    for (std::size_t half = ContactPatches::width / 2; half > 0; half /= 2)
        for (std::size_t k = 0; k < half; ++k) squared[k] = least(squared[k], squared[k + half]);
    return std::sqrt(squared[0]);
}

float PosedPatch::squared_distances(const std::array<float, 3>& p, PatchLanes& squared) const noexcept {
    for (std::size_t k = 0; k < ContactPatches::width; ++k) {
        const float ux = side_1[0][k], uy = side_1[1][k], uz = side_1[2][k];
        const float vx = side_2[0][k], vy = side_2[1][k], vz = side_2[2][k];
        const float x = p[0] - corner[0][k], y = p[1] - corner[1][k], z = p[2] - corner[2][k];
        const auto squared_to_side = [](float ax, float ay, float az, float bx, float by, float bz,
                                        float inverse_b) {
            const float s = unit_interval((ax * bx + ay * by + az * bz) * inverse_b);
            const float gx = ax - s * bx, gy = ay - s * by, gz = az - s * bz;
            return gx * gx + gy * gy + gz * gz;
        };
        const float to_sides =
            least(squared_to_side(x, y, z, ux, uy, uz, inverse_1[k]),
                  least(squared_to_side(x, y, z, vx, vy, vz, inverse_2[k]),
                        squared_to_side(x - ux, y - uy, z - uz, vx - ux, vy - uy, vz - uz, inverse_3[k])));
        // The foot of the perpendicular, solved twice: the second time for what rounding left of the first.
        float s = 0, t = 0, gx = x, gy = y, gz = z;
        for (int pass = 0; pass < 2; ++pass) {
            const float along_1 = gx * ux + gy * uy + gz * uz, along_2 = gx * vx + gy * vy + gz * vz;
            const float more_s = (squared_2[k] * along_1 - product[k] * along_2) * inverse[k],
                        more_t = (squared_1[k] * along_2 - product[k] * along_1) * inverse[k];
            s += more_s;
            t += more_t;
            gx -= more_s * ux + more_t * vx;
            gy -= more_s * uy + more_t * vy;
            gz -= more_s * uz + more_t * vz;
        }
        const float to_plane = gx * gx + gy * gy + gz * gz;
        const bool inside = (s >= 0) & (t >= 0) & (s + t <= 1) & (inverse[k] > 0);
        squared[k] = inside ? least(to_plane, to_sides) : to_sides;
    }
    float smallest = squared[0];
    for (std::size_t k = 1; k < ContactPatches::width; ++k) smallest = least(smallest, squared[k]);
    return smallest;
}

float PatchBounds::squared_distance_to_box(const std::array<float, 3>& p) const noexcept {
    float sum = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const float gap = std::max({lo[i] - p[i], p[i] - hi[i], 0.f});
        sum += gap * gap;
    }
    return sum;
}

float relative_motion(const PatchBounds& s, const PatchBounds& t) noexcept {
    return s.motion_radius + relative_motion(s.motion_centre, t);
}

float relative_motion(const Eigen::Vector3f& motion, const PatchBounds& t) noexcept {
    return (motion - t.motion_centre).norm() + t.motion_radius;
}

float squared_distance(const PatchBounds& s, const PatchBounds& t) noexcept {
    float sum = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const float gap = std::max({s.lo[i] - t.hi[i], t.lo[i] - s.hi[i], 0.f});
        sum += gap * gap;
    }
    return sum;
}

void PosedPatches::begin(const ContactSurface& surface, const Eigen::Vector3d& origin, const Nodes& v,
                         double dt) {
    if (surface_ != &surface || at_.size() != static_cast<std::size_t>(surface.patches().count())) {
        at_.assign(surface.patches().count(), -1);
        required_.clear();
    }
    for (const int patch : required_) at_[patch] = -1;
    required_.clear();
    edges_at_.clear();
    surface_ = &surface;
    origin_ = origin;
    const std::size_t vertices = surface.vertex_count();
    if (++step_ == 0 || motion_steps_.size() < vertices) {  // 0: the counter wrapped around
        motions_.resize(std::max(motions_.size(), vertices));
        motion_steps_.assign(motions_.size(), 0);
        step_ = 1;
    }
    v_ = &v;
    dt_ = dt;
    tolerance_ = 0;
    edge_packs_ = 0;
}

std::array<float, 3> PosedPatches::position(int vertex) const noexcept {
    const Eigen::Vector3f p = (surface_->x(vertex) - origin_).cast<float>();
    return {p[0], p[1], p[2]};
}

/// Gives each new patch its place, and lists the vertices that no patch before has.
void PosedPatches::list_new(std::span<const PatchPair> pairs, int PatchPair::*side) {
    const ContactPatches& patches = surface_->patches();
    new_vertices_.clear();
    for (const PatchPair& pair : pairs) {
        const int patch = pair.*side;
        int& at = at_[patch];
        if (at >= 0) continue;
        at = required_.size();
        required_.push_back(patch);
        for (const int face : patches.faces[patch])
            for (const int vertex : surface_->F().row(face))
                if (std::exchange(motion_steps_[vertex], step_) != step_) new_vertices_.push_back(vertex);
    }
}

void PosedPatches::require(std::span<const PatchPair> pairs, int PatchPair::*side) {
    const auto first = required_.size();
    list_new(pairs, side);
    surface_->compute(new_vertices_);
    parallel_for(new_vertices_.size(), [&](int i) {
        const int vertex = new_vertices_[i];
        motions_[vertex] = (dt_ * surface_->mean_at(vertex, *v_)).cast<float>();
    });
    if (posed_.size() < required_.size()) {
        posed_.resize(std::max<std::size_t>(64, 2 * required_.size()));
        bounds_.resize(posed_.size());
    }
    edges_at_.resize(required_.size(), -1);
    parallel_for(
        required_.size() - first,
        [&](int i) {
            const std::size_t k = first + i;
            pose(required_[k], bounds_[k], posed_[k]);
        },
        patches_per_task);
    for (std::size_t k = first; k < required_.size(); ++k)
        for (std::size_t i = 0; i < 3; ++i)
            tolerance_ = std::max(
                {tolerance_, 0x1p-22f * std::abs(bounds_[k].lo[i]), 0x1p-22f * std::abs(bounds_[k].hi[i])});
}

void PosedPatches::require_edges(std::span<const PatchPair> pairs, int PatchPair::*side) {
    new_edges_.clear();
    for (const PatchPair& pair : pairs) {
        const int patch = pair.*side;
        std::ptrdiff_t& at = edges_at_[place(patch)];
        if (at >= 0) continue;
        at = edge_packs_;
        edge_packs_ +=
            (surface_->patches().edges[patch].size() + ContactPatches::width - 1) / ContactPatches::width;
        new_edges_.push_back(patch);
    }
    if (posed_edges_.size() < edge_packs_) posed_edges_.resize(2 * edge_packs_);
    parallel_for(
        new_edges_.size(),
        [&](int i) {
            const int patch = new_edges_[i];
            pose_edges(patch, posed_edges_.data() + edges_at_[place(patch)]);
        },
        patches_per_task);
}

void PosedPatches::pose(int patch, PatchBounds& bounds, PosedPatch& posed) const {
    const Faces& F = surface_->F();
    const auto faces = surface_->patches().faces[patch];
    Eigen::AlignedBox3f motions;
    for (const int face : faces)
        for (const int corner : F.row(face)) motions.extend(motion(corner));
    bounds.motion_centre = motions.center();
    bounds.motion_radius = motions.diagonal().norm() / 2;
    bounds.lo.fill(std::numeric_limits<float>::infinity());
    bounds.hi.fill(-std::numeric_limits<float>::infinity());
    posed.slivers = 0;
    float squared_radius = 0, longest_side = 0;  // squared
    for (std::size_t k = 0; k < ContactPatches::width; ++k) {
        std::array<std::array<float, 3>, 3> x{nowhere, nowhere, nowhere};
        if (k < faces.size())
            for (std::size_t c = 0; c < 3; ++c) {
                x[c] = position(F(faces[k], c));
                for (std::size_t i = 0; i < 3; ++i) {
                    bounds.lo[i] = std::min(bounds.lo[i], x[c][i]);
                    bounds.hi[i] = std::max(bounds.hi[i], x[c][i]);
                }
            }
        float squared_1 = 0, squared_2 = 0, product = 0;
        for (std::size_t i = 0; i < 3; ++i) posed.centre[i][k] = (x[0][i] + x[1][i] + x[2][i]) / 3;
        for (const std::array<float, 3>& corner : x) {
            float squared = 0;
            for (std::size_t i = 0; i < 3; ++i)
                squared += (corner[i] - posed.centre[i][k]) * (corner[i] - posed.centre[i][k]);
            squared_radius = std::max(squared_radius, squared);
        }
        for (std::size_t i = 0; i < 3; ++i) {
            const float u = x[1][i] - x[0][i], v = x[2][i] - x[0][i];
            posed.corner[i][k] = x[0][i];
            posed.side_1[i][k] = u;
            posed.side_2[i][k] = v;
            squared_1 += u * u;
            squared_2 += v * v;
            product += u * v;
        }
        const float squared_3 = squared_1 + squared_2 - 2 * product,
                    area = squared_1 * squared_2 - product * product,
                    longest = std::max({squared_1, squared_2, squared_3});
        if (k < faces.size()) longest_side = std::max(longest_side, longest);
        if (k < faces.size() && !(area > thin * longest * longest)) posed.slivers |= 1u << k;
        posed.squared_1[k] = squared_1;
        posed.squared_2[k] = squared_2;
        posed.product[k] = product;
        posed.inverse_1[k] = inverse_of(squared_1);
        posed.inverse_2[k] = inverse_of(squared_2);
        posed.inverse_3[k] = inverse_of(squared_3);
        posed.inverse[k] = inverse_of(area);
    }
    posed.radius = std::sqrt(squared_radius);
    bounds.longest_edge = std::sqrt(longest_side);
}

void PosedPatches::pose_edges(int patch, PosedEdges* packs) const {
    constexpr std::size_t width = ContactPatches::width;
    const auto& ends = surface_->topology().edges;
    const auto edges = surface_->patches().edges[patch];
    for (std::size_t k = 0; k < (edges.size() + width - 1) / width * width; ++k) {
        PosedEdges& pack = packs[k / width];
        if (k % width == 0) pack.longest_squared = 0;
        const bool used = k < edges.size();
        const std::array<float, 3> p = used ? position(ends(edges[k], 0)) : nowhere,
                                   q = used ? position(ends(edges[k], 1)) : nowhere;
        float squared = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            pack.p[i][k % width] = p[i];
            pack.d[i][k % width] = q[i] - p[i];
            squared += (q[i] - p[i]) * (q[i] - p[i]);
        }
        pack.squared[k % width] = squared;
        pack.longest_squared = std::max(pack.longest_squared, squared);
        pack.inverse_length[k % width] = std::sqrt(inverse_of(squared));
    }
}

}  // namespace nbd
