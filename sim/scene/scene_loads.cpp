// What grips hold and loads act on.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "meshing/body/rigid_body.hpp"
#include "sim/scene/build_world.hpp"

namespace nbd {
namespace {

[[noreturn]] void refuse(const SceneLoad& load, const char* what) {
    throw std::invalid_argument(fmt::format("{}: {}", load.key, what));
}

/// The direction of the segment of a line that is nearest to p.
Eigen::Vector3d direction_at(const std::vector<Eigen::Vector3d>& line, const Eigen::Vector3d& p) {
    double least = std::numeric_limits<double>::infinity();
    Eigen::Vector3d direction = Eigen::Vector3d::UnitX();
    for (std::size_t k = 1; k < line.size(); ++k) {
        const Eigen::Vector3d way = line[k] - line[k - 1];
        const double share = std::clamp((p - line[k - 1]).dot(way) / way.squaredNorm(), 0.0, 1.0),
                     distance = (p - line[k - 1] - share * way).norm();
        if (!(distance < least)) continue;
        least = distance;
        direction = way.normalized();
    }
    return direction;
}

void take_fibres(const SceneLoad& from, const PlacedBody& placed, const Eigen::Matrix3d& turn,
                 BodyLoad& load) {
    const Tets& T = placed.body.tets.T;
    if (is_rigid(placed.body.tets))
        refuse(from, "a rigid body has no muscles; use a joint with a motor, or a tendon");
    load.tets.resize(T.rows());
    std::iota(load.tets.begin(), load.tets.end(), 0);
    if (from.region) load.tets = parts_in(from.key, *from.region, BodyPart::tet, placed);
    if (load.tets.empty()) refuse(from, "the region holds no centre of a tetrahedron of the body");
    for (const int t : load.tets) {
        const Eigen::Vector3d centre =
            (placed.x.row(T(t, 0)) + placed.x.row(T(t, 1)) + placed.x.row(T(t, 2)) + placed.x.row(T(t, 3)))
                .transpose() /
            4;
        load.fibres.push_back(turn.transpose() * direction_at(from.along, centre));
    }
}

/// A force on a part of a rigid body acts on the surface there, evenly by area, and so on the four nodes.
void share_by_area(const SceneLoad& from, const PlacedBody& placed, BodyLoad& load) {
    const std::vector<int> faces = parts_in(from.key, *from.region, BodyPart::face, placed);
    if (faces.empty()) refuse(from, "the region holds no face of the rigid body's surface");
    const Faces& F = placed.body.surface.F;
    const Nodes x = embedded(placed.body.W, placed.x);
    load.nodes = {0, 1, 2, 3};
    load.shares.assign(4, 0);
    for (const int f : faces) {
        const Eigen::Vector3d a = x.row(F(f, 0)), b = x.row(F(f, 1)), c = x.row(F(f, 2));
        const double area = (b - a).cross(c - a).norm() / 2;
        for (const int vertex : F.row(f))
            for (Embedding::InnerIterator entry(placed.body.W, vertex); entry; ++entry)
                load.shares[entry.col()] += area / 3 * entry.value();
    }
}

}  // namespace

Grip take_nodes(const SceneGrip& from, const PlacedBody& placed) {
    Grip grip = from.grip;
    grip.nodes = parts_in(from.key, from.region, BodyPart::node, placed);
    if (grip.nodes.empty())
        throw std::invalid_argument(fmt::format("{}: the region holds no node of the body", from.key));
    return grip;
}

BodyLoad take_part(const SceneLoad& from, const PlacedBody& placed, const Eigen::Matrix3d& turn) {
    BodyLoad load = from.load;
    if (load.kind == LoadKind::muscle) take_fibres(from, placed, turn, load);
    if (load.kind == LoadKind::pressure || load.kind == LoadKind::gas || load.kind == LoadKind::wind) {
        load.faces = from.region ? parts_in(from.key, *from.region, BodyPart::face, placed)
                                 : faces_at(from, embedded(placed.body.W, placed.x), placed.body.surface.F);
        if (from.region && load.faces.empty()) refuse(from, "the region holds no face of the body's surface");
        return load;
    }
    if (load.kind == LoadKind::muscle || !from.region) return load;
    if (is_rigid(placed.body.tets)) {
        if (load.kind != LoadKind::force)
            refuse(from,
                   "of a rigid body a torque or an acceleration acts on the whole; leave its region out");
        share_by_area(from, placed, load);
        return load;
    }
    load.nodes = parts_in(from.key, *from.region, BodyPart::node, placed);
    if (load.nodes.empty()) refuse(from, "the region holds no node of the body");
    return load;
}

std::string at_odds_text(const std::string& grip, const std::string& other, double time) {
    return fmt::format(
        "{}: contains nodes that {} also holds at {} s; allowed: to take them once they are "
        "released",
        grip, other, time);
}

void check_loads(const SceneBody& spec, const WorldBody& body) {
    std::vector<char> is_held(body.state.x.rows(), 0);
    for (const Grip& grip : body.grips)
        if (grip.release == std::numeric_limits<double>::infinity())
            for (const int node : grip.nodes) is_held[node] = 1;
    for (std::size_t k = 0; k < spec.loads.size(); ++k) {
        const std::vector<int>& nodes = body.loads[k].nodes;
        if (!nodes.empty() && std::ranges::all_of(nodes, [&](int node) { return is_held[node] != 0; }))
            throw std::invalid_argument(fmt::format(
                "{}: pins or grips hold all that it acts on, so it moves nothing; widen its region",
                spec.loads[k].key));
    }
}

}  // namespace nbd
