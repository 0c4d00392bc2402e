#include "sim/world/start_check.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <optional>
#include <stdexcept>
#include <utility>

#include "collision/query/pair_query.hpp"

namespace nbd {
namespace {

constexpr double slight = 1e-3;  // share of a body's diagonal: what rests may overlap by as much
constexpr double nearly = 1e-6;  // likewise: what is nearer touches

}  // namespace

/// A surface at the start. Trees are made where something is near.
class StartCheck::Surface {
 public:
    Surface(std::string name, TriMesh surface, const Eigen::Vector3d& origin, bool held)
        : label(std::move(name)),
          is_held(held),
          mesh(std::move(surface)),
          box(mesh.X.colwise().minCoeff().transpose(), mesh.X.colwise().maxCoeff().transpose()),
          x_((mesh.X.rowwise() - origin.transpose()).cast<float>()) {}

    double diagonal() const { return box.diagonal().norm(); }

    /// The tree in the pose of the start, moved by `by`.
    PosedTree& tree(const Eigen::Vector3d& by = Eigen::Vector3d::Zero()) {
        if (!tree_) tree_ = std::make_unique<PosedTree>(shared_exact_tree(x_, mesh.F), BoundKind::exact);
        moved_ = x_.rowwise() + by.cast<float>().transpose();
        tree_->begin_pose(moved_);
        return *tree_;
    }

    /// Signed distance of a point; nullopt where it is more than `reach` outside, or the surface is open.
    std::optional<double> distance(const Eigen::Vector3d& p, double reach) {
        if (!std::exchange(solid_is_made_, true)) {
            solid_ = std::make_unique<StaticSurface>(mesh);
            if (solid_->is_open()) solid_.reset();  // an obstacle of two sides, or around a cage
        }
        if (!solid_) return std::nullopt;
        const auto found = solid_->distance(p, reach);
        return found ? std::optional(found->distance) : std::nullopt;
    }

    /// Whether vertex 0 of `inner` lies in this surface. If the surfaces do not cross, all of `inner` does.
    bool encloses(const Surface& inner) {
        const Eigen::Vector3d p = inner.mesh.X.row(0);
        return box.contains(p) && distance(p, 0).value_or(0) < 0;
    }

    std::string label;
    bool is_held;
    TriMesh mesh;
    Eigen::AlignedBox3d box;

 private:
    Vertices x_, moved_;
    std::unique_ptr<PosedTree> tree_;
    std::unique_ptr<StaticSurface> solid_;
    bool solid_is_made_ = false;
};

namespace {

Eigen::Vector3d normal(const TriMesh& mesh, int face) {
    const Eigen::Vector3d a = mesh.X.row(mesh.F(face, 0)), b = mesh.X.row(mesh.F(face, 1)),
                          c = mesh.X.row(mesh.F(face, 2));
    return (b - a).cross(c - a);
}

/// How two surfaces meet.
struct Meeting {
    std::size_t crossing = 0;   // pairs of faces with a point in common
    bool touches_only = false;  // no such pair is left once b is moved slightly away
};

template <class Surface>
Meeting meeting(PairQuery& query, Surface& a, Surface& b) {
    const auto found = query.intersecting(a.tree(), b.tree());
    Meeting result{.crossing = found.size()};
    if (found.empty()) return result;
    Eigen::Vector3d apart = Eigen::Vector3d::Zero();
    for (const FacePair& pair : found) apart += normal(a.mesh, pair.a) - normal(b.mesh, pair.b);
    if (apart.norm() > 0) {
        const double by = slight * std::min(a.diagonal(), b.diagonal());
        result.touches_only = query.intersecting(a.tree(), b.tree(by * apart.normalized())).empty();
    }
    return result;
}

}  // namespace

StartCheck::StartCheck(double apart, PairRules rules) : apart_(apart), rules_(std::move(rules)) {}
StartCheck::~StartCheck() = default;

void StartCheck::add_body(std::string label, TriMesh surface, bool is_held) {
    if (bodies_.empty()) origin_ = surface.X.colwise().mean();
    bodies_.push_back(std::make_unique<Surface>(std::move(label), std::move(surface), origin_, is_held));
}

/// what: says what the body does. other: a body that it meets; null: an obstacle.
StartFault StartCheck::fault(bool overlaps, const Surface& body, const std::string& what,
                             const Surface* other) const {
    StartFault result{.overlaps = overlaps,
                      .is_held = body.is_held && (!other || other->is_held),
                      .text = fmt::format("{}: {}", body.label, what),
                      .way = "; \"resolve_start\": true moves bodies apart before the first step"};
    if (result.is_held && other)
        result.way = fmt::format("; {} and {} are held, so place them at least {:.2g} m apart", other->label,
                                 body.label, apart_);
    else if (result.is_held)
        result.way = fmt::format("; {} is held, so place it at least {:.2g} m away", body.label, apart_);
    return result;
}

std::vector<StartFault> StartCheck::between_bodies() {
    std::vector<StartFault> faults;
    for (std::size_t i = 0; i < bodies_.size(); ++i)
        for (std::size_t k = i + 1; k < bodies_.size(); ++k) {
            Surface &a = *bodies_[i], &b = *bodies_[k];
            if (!a.box.intersects(b.box) || !rules_.meet(i, k)) continue;
            const Meeting found = meeting(query_, a, b);
            if (found.touches_only)
                faults.push_back(fault(false, b, fmt::format("touches {} at the start", a.label), &a));
            else if (found.crossing > 0)
                faults.push_back(fault(
                    true, b,
                    fmt::format("overlaps {} at the start: {} pairs of faces cross", a.label, found.crossing),
                    &a));
            else if (a.encloses(b) || b.encloses(a))
                faults.push_back(
                    fault(true, b, fmt::format("lies inside {} or encloses it at the start", a.label), &a));
        }
    return faults;
}

std::vector<StartFault> StartCheck::with_obstacle(int number, const std::string& label,
                                                  const Obstacle& obstacle) {
    std::unique_ptr<Surface> solid;  // one for all bodies: a large mesh may lie under many
    if (const auto* shape = std::get_if<std::shared_ptr<const StaticSurface>>(&obstacle.shape)) {
        TriMesh mesh = (*shape)->mesh();
        const Placing start = obstacle.motion.at(0);
        for (Eigen::Index i = 0; i < mesh.X.rows(); ++i)
            mesh.X.row(i) = start(mesh.X.row(i).transpose()).transpose();
        solid = std::make_unique<Surface>(label, std::move(mesh), origin_, true);
    }
    std::vector<StartFault> faults;
    for (std::size_t b = 0; b < bodies_.size(); ++b)
        if (rules_.meet(b, party_of_obstacle(number)))
            if (auto fault = check(*bodies_[b], label, obstacle, solid.get()))
                faults.push_back(std::move(*fault));
    return faults;
}

/// solid: the obstacle at the start if it is a mesh, else null.
std::optional<StartFault> StartCheck::check(Surface& body, const std::string& label, const Obstacle& obstacle,
                                            Surface* solid) {
    const double size = body.diagonal();
    double least = size;  // distance of the body's vertices, and of its faces where they are looked at
    for (Eigen::Index i = 0; i < body.mesh.X.rows(); ++i)
        if (const auto found = signed_distance(obstacle, body.mesh.X.row(i).transpose(), 0, nearly * size))
            least = std::min(least, found->distance);
    if (const BallShape* ball = std::get_if<BallShape>(&obstacle.shape)) {
        const Placing start = obstacle.motion.at(0);
        const Eigen::Vector3d centre = start(ball->centre);
        const double radius = start.scale * ball->radius, reach = radius + nearly * size;
        if (body.box.exteriorDistance(centre) <= reach)
            if (const auto distance = body.distance(centre, reach))
                least = std::min(least, *distance - radius);
    }
    if (least < -slight * size)
        return fault(true, body, fmt::format("is {:.3g} m deep in {} at the start", -least, label));
    if (solid && solid->box.intersects(body.box)) {
        const Meeting found = meeting(query_, *solid, body);
        if (found.crossing > 0 && !found.touches_only)
            return fault(
                true, body,
                fmt::format("overlaps {} at the start: {} pairs of faces cross", label, found.crossing));
        if (found.crossing > 0) least = 0;
        if (found.crossing == 0 && body.encloses(*solid))
            return fault(true, body, fmt::format("encloses {} at the start", label));
    }
    if (least <= nearly * size) return fault(false, body, fmt::format("touches {} at the start", label));
    return std::nullopt;
}

std::vector<StartFault> start_faults(const World& world, const std::vector<std::string>& labels,
                                     const std::vector<std::string>& obstacles) {
    StartCheck check(world.thickness(), world.pairs());
    for (int b = 0; b < world.body_count(); ++b)
        check.add_body(labels.at(b), {world.surface(b), world.shape(b).F}, !world.can_be_moved(b));
    std::vector<StartFault> faults = check.between_bodies();
    for (std::size_t o = 0; o < world.obstacles().size(); ++o) {
        const std::string label = obstacles.empty() ? fmt::format("obstacles[{}]", o) : obstacles.at(o);
        for (StartFault& fault : check.with_obstacle(o, label, world.obstacles()[o]))
            faults.push_back(std::move(fault));
    }
    std::erase_if(faults, [](const StartFault& fault) { return !fault.overlaps && fault.is_held; });
    std::stable_sort(faults.begin(), faults.end(),
                     [](const StartFault& a, const StartFault& b) { return a.overlaps && !b.overlaps; });
    return faults;
}

StartVerdict judge_start(World& world, const std::vector<std::string>& labels,
                         const std::vector<std::string>& obstacles) {
    StartVerdict verdict{.refusal = {}, .faults = start_faults(world, labels, obstacles)};
    try {
        world.check_start();
    } catch (const std::invalid_argument& error) {
        verdict.refusal = error.what();
    }
    return verdict;
}

std::string start_warning(const std::vector<StartFault>& faults, bool resolved) {
    constexpr std::size_t most = 3;  // in one line
    if (faults.empty()) return "";
    std::string line, ways;
    for (std::size_t f = 0; f < std::min(faults.size(), most); ++f) {
        line += (f > 0 ? "; " : "") + faults[f].text;
        if (ways.find(faults[f].way) == std::string::npos) ways += faults[f].way;
    }
    if (faults.size() > most) line += fmt::format("; and {} more", faults.size() - most);
    return line + (resolved ? ", although \"resolve_start\" is set; place the bodies apart" : ways);
}

}  // namespace nbd
