#include "sim/barrier/barrier.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <variant>

#include "collision/base/stopwatch.hpp"
#include "meshing/parallel/parallel_for.hpp"
#include "sim/barrier/merged_contacts.hpp"
#include "sim/barrier/moving_features.hpp"
#include "sim/barrier/pair_weight.hpp"

namespace nbd {
namespace {

Nodes placed_by(const Placing& placing, const Nodes& x) {
    if (placing.is_shift) return x.rowwise() + placing.translation.transpose();
    Nodes moved(x.rows(), 3);
    for (Eigen::Index i = 0; i < x.rows(); ++i) moved.row(i) = placing(x.row(i)).transpose();
    return moved;
}

bool is_mesh(const Obstacle& obstacle) {
    return std::holds_alternative<std::shared_ptr<const StaticSurface>>(obstacle.shape);
}

SurfacePoint surface_point(const MovingSurface& surface, int first, int count,
                           const std::array<FeatureCorner, 4>& at, const Eigen::Vector3d& weights) {
    if (surface.is_obstacle()) return {};
    SurfacePoint point{.body = surface.body(), .count = count};
    for (int k = 0; k < point.count; ++k) {
        const std::size_t i = k;
        point.vertices[i] = at[first + k].vertex;
        point.weights[i] = weights[k];
    }
    return point;
}

/// Whether a visitor of near features sees two of meshes.
template <class Near>
constexpr bool is_of_meshes = std::is_same_v<std::decay_t<Near>, NearFeatures>;

double edge_area(const MovingSurface& surface, int edge) {
    const auto ends = surface.topology().edges.row(edge);
    return (surface.rest_areas()[ends[0]] + surface.rest_areas()[ends[1]]) / 6;
}

}  // namespace

void Barrier::add_body(std::shared_ptr<const ContactShape> shape, const TetMesh& rest, double young,
                       const PairBounds& bounds, HeldPose held, std::vector<double> friction) {
    const auto twin =
        std::ranges::find_if(surfaces_, [&](const MovingSurface& s) { return &s.shape() == shape.get(); });
    const int body = bodies_.size();
    if (twin != surfaces_.end())
        surfaces_.push_back(MovingSurface(*twin, body, bounds));
    else
        surfaces_.emplace_back(shape, rest, body, bounds);
    bodies_.push_back({std::move(shape), young, std::move(held), std::move(friction)});
}

void Barrier::add_obstacle(const Obstacle& obstacle) {
    walls_.push_back({.obstacle = obstacle});
    if (!is_mesh(obstacle)) {
        walls_.back().smooth.emplace(obstacle);
        return;
    }
    const TriMesh& mesh = std::get<std::shared_ptr<const StaticSurface>>(obstacle.shape)->mesh();
    walls_.back().surface = surfaces_.size();
    surfaces_.emplace_back(mesh.F, mesh.X, party_of_obstacle(std::ssize(walls_) - 1));
}

void Barrier::begin() {
    intersection_search_.begin(surfaces_, touching_share * reach_, rules_);
    search_.begin(surfaces_, intersection_search_.about_those_at_rest(), rules_);
    find_held_touch();
}

/// How far features at a distance may come nearer before they are at their floor, as far as they press.
double Barrier::room_at(double distance, double floor, double reach) {
    return std::max(std::min(distance, reach) - floor, 0.0);
}

bool Barrier::can_miss() const {
    return !is_exact_ && std::ranges::any_of(surfaces_, &MovingSurface::can_miss);
}

void Barrier::be_exact(bool exact) {
    if (exact == is_exact_) return;
    is_exact_ = exact;
    for (MovingSurface& surface : surfaces_)
        if (!surface.is_obstacle()) surface.be_exact(exact);
    search_.forget();
}

double Barrier::floor() const noexcept { return floor_share * reach_; }

std::vector<Intersection> Barrier::intersections(std::span<const Nodes> nodes) {
    place(nodes, nodes, 1);
    near_ = {};
    near_smooth_.clear();
    return intersection_search_.find(surfaces_);
}

bool Barrier::missed_too_near() {
    return can_miss() && intersection_search_.missed_within(surfaces_, least_start());
}

void Barrier::begin_step(double time, double dt) {
    dt_ = dt;
    if (can_miss()) search_.forget();  // so that a step depends on its start alone
    for (Wall& wall : walls_) {
        const Motion& motion = wall.obstacle.motion;
        const Placing start = motion.at(time), end = motion.at(time + dt);
        wall.moves = dt > 0 && !motion.keyframe_at(time).is_where(motion.keyframe_at(time + dt));
        if (wall.smooth) {
            wall.smooth->begin_step(start, wall.moves ? end : start);
            continue;
        }
        const SurfaceFrames* frames = wall.obstacle.frames.get();
        const Nodes& rest = surfaces_[wall.surface].rest();
        wall.moves = wall.moves || (dt > 0 && frames && !frames->stand(time, time + dt));
        wall.start_x = placed_by(start, frames ? frames->at(time) : rest);
        wall.end_x = wall.start_x;
        if (wall.moves) wall.end_x = placed_by(end, frames ? frames->at(time + dt) : rest);
    }
}

bool Barrier::obstacles_move() const {
    return std::ranges::any_of(walls_, [](const Wall& wall) { return wall.moves; });
}

void Barrier::place(std::span<const Nodes> begin, std::span<const Nodes> end, double progress) {
    parallel_for(
        std::ssize(bodies_), [&](int b) { surfaces_[b].move(begin[b], end[b]); }, 1);
    progress_ = progress;
    for (const Wall& wall : walls_) {
        if (wall.surface < 0) continue;
        MovingSurface& surface = surfaces_[wall.surface];
        if (wall.moves)
            surface.move(wall.start_x + progress * (wall.end_x - wall.start_x), wall.end_x);
        else
            surface.move(wall.start_x, wall.start_x);
    }
}

void Barrier::look(std::span<const Nodes> begin, std::span<const Nodes> end, double progress) {
    see(begin, end, progress);
    is_guess_ = true;
}

void Barrier::see(std::span<const Nodes> begin, std::span<const Nodes> end, double progress) {
    is_guess_ = false;
    costs_ = {};
    timed(costs_.update_us, "update", [&] { place(begin, end, progress); });
    near_ = search_.find(surfaces_, reach_);
    costs_.add(search_.costs());
    find_near_smooth();
}

double Barrier::move(std::span<const Nodes> begin, std::span<const Nodes> end, double progress) {
    see(begin, end, progress);
    limits_.resize(feature_pairs());
    for_each_near([&](const auto& near, std::size_t i) { limits_[i] = limit(near); });
    double least = 1;
    for (const double share : limits_) least = std::min(least, share);
    return least;
}

/// Calls visit(near, i) for all near features and their place among all, on several threads.
template <class Visit>
void Barrier::for_each_near(const Visit& visit) const {
    constexpr int grain = 128;
    const auto of_surfaces = near_.size();
    parallel_for(
        feature_pairs(),
        [&](int k) {
            const std::size_t i = k;
            if (i < of_surfaces)
                visit(near_[i], i);
            else
                visit(near_smooth_[i - of_surfaces], i);
        },
        grain);
}

std::array<Eigen::Vector3d, 4> Barrier::positions(const FeaturePair& pair, double share) const {
    std::array<Eigen::Vector3d, 4> x;
    const auto at = corners(pair, surfaces_);
    for (std::size_t k = 0; k < 4; ++k) x[k] = surfaces_[at[k].surface].at(at[k].vertex, share);
    return x;
}

double Barrier::limit(const NearFeatures& near) const {
    const auto [kind, x, y] = moving_features(near.pair, surfaces_);
    const double floor = floor_share * near.reach,
                 room = room_at(closest_points(kind, x).distance, floor, near.reach);
    const ImpactConfig config{.separation = floor + left_share * room, .tolerance = tolerance_share * room};
    const Impact impact =
        feature_impact(kind, {{{x[0], y[0]}, {x[1], y[1]}, {x[2], y[2]}, {x[3], y[3]}}}, config);
    return impact.hits ? impact.time : 1;
}

const Barrier::Wall* Barrier::wall_of(const MovingSurface& surface) const {
    if (!surface.is_obstacle()) return nullptr;
    const auto number = &surface - surfaces_.data();
    return &*std::ranges::find(walls_, number, &Wall::surface);
}

/// A layer as thick as the reach under the area.
BarrierLaw Barrier::law(double young, double area, double reach) const {
    return {.reach = reach,
            .floor = floor_share * reach,
            .stiffness = config_.stiffness_scale * young * area / reach};
}

BarrierLaw Barrier::law(const NearFeatures& near) const {
    const MovingSurface &a = surfaces_[near.pair.surface_a], &b = surfaces_[near.pair.surface_b];
    const auto of = [&](const MovingSurface& surface) { return bodies_[surface.body()].young; };
    double young = 0;
    if (a.is_obstacle())
        young = of(b);
    else if (b.is_obstacle())
        young = of(a);
    else
        young = 2 / (1 / of(a) + 1 / of(b));
    double area = 0;
    if (near.pair.kind == FeatureKind::vertex_face) {
        // The vertices of an obstacle may stand for more than the body's face has.
        area = a.rest_areas()[near.pair.a];
        if (a.is_obstacle()) {
            double face = 0;
            for (int k = 0; k < 3; ++k) face += b.rest_areas()[b.F()(near.pair.b, k)] / 3;
            area = std::min(area, face);
        }
    } else {
        area = std::min(edge_area(a, near.pair.a), edge_area(b, near.pair.b));
    }
    return law(young, area, near.reach);
}

/// Distances of all near features after a share of the motion.
void Barrier::measure(double share) {
    distances_.resize(feature_pairs());
    for_each_near([&](const auto& near, std::size_t i) {
        if constexpr (is_of_meshes<decltype(near)>)
            distances_[i] = closest_points(near.pair.kind, positions(near.pair, share)).distance;
        else
            distances_[i] = distance(near, share).distance;
    });
    least_distance_ = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < distances_.size(); ++i) {
        const double reach = i < near_.size() ? near_[i].reach : reach_;
        if (distances_[i] < reach) least_distance_ = std::min(least_distance_, distances_[i]);
    }
}

double Barrier::energy(double share) {
    measure(share);
    energies_.resize(feature_pairs());
    for_each_near([&](const auto& near, std::size_t i) {
        constexpr bool of_meshes = is_of_meshes<decltype(near)>;
        double reach = reach_;
        if constexpr (of_meshes) reach = near.reach;
        energies_[i] = distances_[i] < reach ? law(near).at(distances_[i]).energy : 0;
        if constexpr (of_meshes)
            if (energies_[i] > 0 && std::isfinite(energies_[i]))
                energies_[i] *= pair_weight(near.pair, surfaces_, 0);
    });
    double sum = 0;
    for (const double energy : energies_) sum += energy;
    return sum;
}

Contact Barrier::contact(const NearFeatures& near, double share) const {
    const MovingSurface &a = surfaces_[near.pair.surface_a], &b = surfaces_[near.pair.surface_b];
    const auto at = corners(near.pair, surfaces_);
    const ClosestPoints closest = closest_points(near.pair.kind, positions(near.pair, share));
    const int of_a = corners_of_a(near.pair.kind);
    Contact contact{.a = surface_point(a, 0, of_a, at, closest.weights_a),
                    .b = surface_point(b, of_a, 4 - of_a, at, closest.weights_b),
                    .normal = closest.gap / closest.distance,
                    .gap = closest.distance};
    if (a.is_obstacle()) {
        std::swap(contact.a, contact.b);
        contact.normal *= -1;
    }
    const MovingSurface& other = a.is_obstacle() ? a : b;
    double usual = config_.friction;
    if (const Wall* wall = wall_of(other)) {
        if (wall->moves) contact.wall_velocity = velocity_of(near, other, closest);
        contact.obstacle = static_cast<int>(wall - walls_.data());
        usual = wall->obstacle.friction;
    }
    contact.friction = friction(contact, usual);
    return contact;
}

/// Mean velocity in the step of the point of an obstacle's mesh that is nearest.
Eigen::Vector3d Barrier::velocity_of(const NearFeatures& near, const MovingSurface& obstacle,
                                     const ClosestPoints& closest) const {
    const Wall& wall = *wall_of(obstacle);
    const auto at = corners(near.pair, surfaces_);
    const std::size_t of_a = corners_of_a(near.pair.kind);
    const bool is_a = &obstacle == &surfaces_[near.pair.surface_a];
    Eigen::RowVector3d way = Eigen::RowVector3d::Zero();
    for (std::size_t k = is_a ? 0 : of_a; k < (is_a ? of_a : 4); ++k) {
        const double weight = is_a ? closest.weights_a[k] : closest.weights_b[k - of_a];
        way += weight * (wall.end_x.row(at[k].vertex) - wall.start_x.row(at[k].vertex));
    }
    return way.transpose() / dt_;
}

/// Motion of a body's point from begin to end.
Eigen::Vector3d Barrier::motion(const SurfacePoint& point) const {
    const MovingSurface& s = surfaces_[point.body];
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    for (std::size_t k = 0; k < static_cast<std::size_t>(point.count); ++k)
        sum += point.weights[k] * (s.end(point.vertices[k]) - s.begin(point.vertices[k]));
    return sum;
}

std::vector<Contact> Barrier::contacts(double share) {
    measure(share);
    weights_.assign(feature_pairs(), 1);
    const double rise = is_guess_ && share == 0 ? rise_share : std::numeric_limits<double>::infinity();
    for_each_near([&](const auto& near, std::size_t i) {
        if constexpr (is_of_meshes<decltype(near)>) {
            const auto may_press = [&] {
                const MovingFeatures moving = moving_features(near.pair, surfaces_);
                return distances_[i] - (1 - share) * moving.relative_motion() < near.reach;
            };
            weights_[i] = 0;
            if (distances_[i] < near_share * near.reach || (share < 1 && may_press()))
                weights_[i] = pair_weight(near.pair, surfaces_, share, rise * near.reach);
        }
    });
    std::vector<Contact> result;
    const auto add = [&](const auto& near, double distance, double reach, double weight) {
        Contact c = contact(near, share);
        const Eigen::Vector3d of_b =
            c.b.body < 0 ? Eigen::Vector3d((1 - progress_) * dt_ * c.wall_velocity) : motion(c.b);
        const double nearer = (1 - share) * c.normal.dot(of_b - motion(c.a));
        if (!(distance - nearer < reach) && !(distance < near_share * reach)) return;
        c.barrier = law(near);
        c.barrier.stiffness *= weight;
        c.barrier.linear_below =
            c.barrier.floor + left_share * room_at(distance, c.barrier.floor, c.barrier.reach);
        result.push_back(c);
    };
    for (std::size_t i = 0; i < near_.size(); ++i)
        if (weights_[i] > 0) add(near_[i], distances_[i], near_[i].reach, weights_[i]);
    for (std::size_t i = 0; i < near_smooth_.size(); ++i)
        add(near_smooth_[i], distances_[near_.size() + i], reach_, 1);
    return merged(std::move(result));
}

}  // namespace nbd
