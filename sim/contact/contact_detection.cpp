#include "sim/contact/contact_detection.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "collision/base/stopwatch.hpp"
#include "sim/contact/obstacle_contact.hpp"

namespace nbd {
namespace {

/// Young's modulus of a contact layer, Pa: against something rigid, or between two bodies.
double layer_modulus(const ContactParty& a, const ContactParty& b) { return 2 / (1 / a.young + 1 / b.young); }

Eigen::Vector3d mean_velocity(const ContactParty& body) {
    return body.state.v.transpose() * body.elastic.node_masses() / body.elastic.mass();
}

ContactDetail detail_of(const ContactConfig& config) {
    return config.contacts_per_node_pair > 0 ? ContactDetail::enough : ContactDetail::all;
}

/// Largest speed of a node relative to a uniformly moving frame.
double fastest(const ContactParty& body, const Eigen::Vector3d& frame) {
    return (body.state.v.rowwise() - frame.transpose()).rowwise().norm().maxCoeff();
}

/// The same for the nodes inside a region; 0 if there are none.
double fastest_within(const Box& region, const ContactParty& body, const Eigen::Vector3d& frame) {
    const Eigen::Vector3d lo = region.lo.head<3>().cast<double>(), hi = region.hi.head<3>().cast<double>();
    double squared = 0;
    for (Eigen::Index i = 0; i < body.state.x.rows(); ++i) {
        const Eigen::Vector3d x = body.state.x.row(i);
        if ((x.array() >= lo.array()).all() && (x.array() <= hi.array()).all())
            squared = std::max(squared, (body.state.v.row(i).transpose() - frame).squaredNorm());
    }
    return std::sqrt(squared);
}

/// By how much coordinates in the pose of a body's tree may differ from those of its surface, metres: these
/// are rounded to single precision. `affine` bounds add products of K rounded weights and rounded nodes,
/// which is off by at most (K + 4) 2^-24 of the farthest node; AffineModel::rounding() is larger, or 0 where
/// every vertex is a node.
double tree_error(const ContactParty& body) {
    double share = 0x1p-24;
    if (body.tree->takes_nodes()) share += double{body.tree->tree().affine->rounding()};
    return share * body.state.x.cwiseAbs().maxCoeff();
}

/// The velocities of blocks of a body, found where they are first asked for.
const ContactSurface::Ball& block_velocity(const ContactParty& body, int block,
                                           std::vector<ContactSurface::Ball>& balls) {
    ContactSurface::Ball& ball = balls[block];
    if (ball.radius < 0) ball = body.surface.block_ball(block, body.state.v);
    return ball;
}

/// Largest relative speed of vertices with velocities in two balls, rounding of these to single precision
/// included.
double fastest_approach(const ContactSurface::Ball& a, const ContactSurface::Ball& b) {
    constexpr double rounding = 1e-6;
    return (a.centre - b.centre).norm() + a.radius + b.radius +
           rounding * (a.centre.norm() + a.radius + b.centre.norm() + b.radius);
}

Box grown(const Box& box, double by) {
    const Eigen::Array4f step(static_cast<float>(by), static_cast<float>(by), static_cast<float>(by), 0);
    return {box.lo - step, box.hi + step};
}

Box common(const Box& s, const Box& t) { return {s.lo.max(t.lo), s.hi.min(t.hi)}; }

}  // namespace

ContactSides ContactDetection::sides() const {
    ContactSides sides;
    for (const auto& [pair, finder] : finders_) finder.save_sides(sides);
    for (const auto& [body, own] : self_sides_) append(own, body, body, sides);
    for (const auto& [vertex, depth] : starts_) {
        sides.starts.vertices.push_back(vertex);
        sides.starts.depths.push_back(depth);
    }
    sides.starts.bodies = started_bodies_;
    sides.starts.obstacles = started_obstacles_;
    return sides;
}

void ContactDetection::restore(const ContactSides& sides) {
    finders_.clear();
    self_sides_.clear();
    for (const auto& [body, other, vertex] : sides.vertices) {
        if (body == other) {
            if (const auto [own, is_new] = self_sides_.try_emplace(body); is_new)
                own->second = sides_of(sides, body, body);
            continue;
        }
        const BodyIndices pair{std::min(body, other), std::max(body, other)};
        finders_.try_emplace(pair, pair.a, pair.b);
    }
    for (auto& [pair, finder] : finders_) finder.restore_sides(sides);
    starts_.clear();
    for (std::size_t i = 0; i < sides.starts.vertices.size(); ++i)
        starts_[sides.starts.vertices[i]] = sides.starts.depths[i];
    started_bodies_ = sides.starts.bodies;
    started_obstacles_ = sides.starts.obstacles;
}

void ContactDetection::find(std::span<const ContactParty> bodies, std::span<const Obstacle> obstacles,
                            const ContactConfig& config, double thickness, double time, double dt_before,
                            double dt, StepReport& report) {
    const ScopedTimer timer(report.detect_us);
    contacts_.clear();
    starts_now_.clear();
    deepest_ = approach_ = 0;
    find_obstacles(bodies, obstacles, config, thickness, time, dt);
    std::vector<Box> boxes;
    for (const ContactParty& body : bodies)
        boxes.push_back(
            body.tree ? grown(body.surface.box(), thickness + dt * fastest(body, Eigen::Vector3d::Zero()))
                      : empty_box());
    const std::span<const BodyIndices> pairs = sweep_.touching(boxes);
    std::erase_if(finders_, [&](const auto& f) { return !std::ranges::binary_search(pairs, f.first); });
    for (const BodyIndices pair : pairs) find_bodies(pair, bodies, config, thickness, dt_before, dt, report);
    for (int b = 0; config.self_contact && b < std::ssize(bodies); ++b)
        if (bodies[b].tree) find_self(b, bodies, config, thickness, dt_before, dt, report);
    starts_ = std::move(starts_now_);
    started_bodies_ = bodies.size();
    started_obstacles_ = obstacles.size();
}

void ContactDetection::find_obstacles(std::span<const ContactParty> bodies,
                                      std::span<const Obstacle> obstacles, const ContactConfig& config,
                                      double thickness, double time, double dt) {
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const double stiffness = config.stiffness_scale * bodies[b].young / thickness;
        for (std::size_t o = 0; o < obstacles.size(); ++o) {
            const std::size_t first = contacts_.size();
            find_obstacle_contacts(b, bodies[b].surface, obstacles[o], time, dt,
                                   thickness + dt * fastest(bodies[b], mean_velocity(obstacles[o], time, dt)),
                                   contacts_);
            for (std::size_t c = first; c < contacts_.size(); ++c) {
                contacts_[c].stiffness = stiffness * contacts_[c].area;
                contacts_[c].obstacle = static_cast<int>(o);
                deepest_ = std::max(deepest_, -contacts_[c].gap);
            }
            yield_to_starts(first, {static_cast<int>(b), -1 - static_cast<int>(o)}, thickness);
        }
    }
}

/// Pairs of patches that hold all pairs of faces in reach of each other, sorted. dt: seconds for which they
/// move.
std::span<const PatchPair> ContactDetection::near_patches(const ContactParty& a, const ContactParty& b,
                                                          const ContactReach& reach, double dt,
                                                          StepReport& report) {
    const ScopedTimer timer(report.collision_us);
    // The finder measures with the surfaces' own positions, so that contacts do not depend on the trees.
    const double error = std::sqrt(3.0) * (tree_error(a) + tree_error(b));
    const auto distance = static_cast<float>(reach.most() + error);
    std::span<const PatchPair> pairs;
    if (a.surface.has_patches_of(a.tree->box_tree()) && b.surface.has_patches_of(b.tree->box_tree())) {
        const ContactSurface::Ball unknown{Eigen::Vector3d::Zero(), -1};
        block_velocities_a_.assign(a.surface.block_count(), unknown);
        block_velocities_b_.assign(b.surface.block_count(), unknown);
        const auto reach_of = [&](int block_a, int block_b) {
            const double approach = dt * fastest_approach(block_velocity(a, block_a, block_velocities_a_),
                                                          block_velocity(b, block_b, block_velocities_b_));
            return std::min(distance, static_cast<float>(reach.least() + approach + error));
        };
        // A copy of what it captures would be allocated.
        pairs = query_.box_leaves_within(*a.tree, *b.tree, distance, std::cref(reach_of));
    } else {
        const auto patch = [](const ContactParty& body, int face) {
            return body.surface.patches().of_face[face];
        };
        patch_pairs_.clear();
        std::array<PatchPair, 1024> recent;  // most repeats follow soon
        recent.fill({-1, -1});
        for (const FacePair& faces : query_.boxes_within(*a.tree, *b.tree, distance)) {
            const PatchPair pair{patch(a, faces.a), patch(b, faces.b)};
            const auto place =
                (31 * static_cast<unsigned>(pair.a) + static_cast<unsigned>(pair.b)) % recent.size();
            if (std::exchange(recent[place], pair) != pair) patch_pairs_.push_back(pair);
        }
        std::ranges::sort(patch_pairs_);
        const auto repeats = std::ranges::unique(patch_pairs_);
        patch_pairs_.erase(repeats.begin(), repeats.end());
        pairs = patch_pairs_;
    }
    report.nodes_bounded += query_.counters().nodes_bounded;
    report.nodes_out_of_range += query_.counters().nodes_out_of_range;
    for (const PatchPair& pair : pairs)
        report.face_pairs += static_cast<long>(a.surface.patches().faces[pair.a].size() *
                                               b.surface.patches().faces[pair.b].size());
    return pairs;
}

void ContactDetection::find_bodies(BodyIndices pair, std::span<const ContactParty> bodies,
                                   const ContactConfig& config, double thickness, double dt_before, double dt,
                                   StepReport& report) {
    const ContactParty &a = bodies[pair.a], &b = bodies[pair.b];
    const Eigen::Vector3d frame = (mean_velocity(a) + mean_velocity(b)) / 2;
    const double most = thickness + dt * (fastest(a, frame) + fastest(b, frame));
    const Box region = common(grown(a.surface.box(), most), grown(b.surface.box(), most));
    const double speed = fastest_within(region, a, frame) + fastest_within(region, b, frame),
                 approach = dt * speed;
    approach_ = std::max(approach_, approach);
    // Limits the search, so that one fast tip does not fill the list with pairs that never meet. A faster
    // approach requires a shorter step.
    const double near = std::min(approach, thickness);
    BodyContactFinder& finder = finders_.try_emplace(pair, pair.a, pair.b).first->second;
    const double overlap =
        std::min(finder.deepest(), 0.25 * std::min(a.surface.rest_diagonal(), b.surface.rest_diagonal()));
    const ContactReach reach{.apart = thickness, .inside = std::max(thickness, overlap), .approach = near};
    // Damping makes a contact press that much earlier than it is within the thickness.
    const double moving = dt + config.damping;
    const auto pairs = near_patches(a, b, reach, moving, report);
    const Eigen::Vector3d origin = ((region.lo + region.hi) / 2).head<3>().matrix().cast<double>();
    posed_a_.begin(a.surface, origin, a.state.v, moving);
    posed_b_.begin(b.surface, origin, b.state.v, moving);
    const std::size_t first = contacts_.size();
    const double moved =
        dt_before > 0 ? dt_before * speed + a.moved + b.moved : std::numeric_limits<double>::infinity();
    report.pairs_measured +=
        finder.find(posed_a_, posed_b_, pairs, reach, detail_of(config), moved, contacts_);
    finish_bodies(first, pair, bodies, config, thickness,
                  config.stiffness_scale * layer_modulus(a, b) / thickness);
}

/// Moves the gaps of contacts of a body with another or an obstacle, from `first` on, by how near they were
/// at the start.
void ContactDetection::yield_to_starts(std::size_t first, std::array<int, 2> pair, double thickness) {
    const auto [body, other] = pair;
    const bool starts =
        body >= started_bodies_ || (other >= 0 ? other >= started_bodies_ : -1 - other >= started_obstacles_);
    if (!starts && starts_.empty()) return;
    const auto for_each_vertex = [&](const Contact& contact, const auto& visit) {
        for (const SurfacePoint* point : {&contact.a, &contact.b})
            for (std::size_t k = 0; point->body >= 0 && k < static_cast<std::size_t>(point->count); ++k)
                if (point->weights[k] > 0)
                    visit({point->body, point->body == body ? other : body, point->vertices[k]});
    };
    using Key = std::array<int, 3>;
    for (std::size_t c = first; c < contacts_.size(); ++c) {
        const double inside = thickness - contacts_[c].gap;
        if (!(inside > 0)) continue;
        for_each_vertex(contacts_[c], [&](const Key& vertex) {
            const auto before = starts_.find(vertex);
            if (!starts && before == starts_.end()) return;
            double& depth = starts_now_[vertex];
            depth = std::max(depth, starts ? inside : std::min(before->second, inside));
        });
    }
    for (std::size_t c = first; c < contacts_.size(); ++c) {
        double nearer = 0;
        for_each_vertex(contacts_[c], [&](const Key& vertex) {
            if (const auto now = starts_now_.find(vertex); now != starts_now_.end())
                nearer = std::max(nearer, now->second);
        });
        contacts_[c].gap += nearer;
    }
}

/// Reduces the contacts of a pair from `first` on and makes them press. stiffness: N/m3.
void ContactDetection::finish_bodies(std::size_t first, BodyIndices pair,
                                     std::span<const ContactParty> bodies, const ContactConfig& config,
                                     double thickness, double stiffness) {
    for (std::size_t c = first; c < contacts_.size(); ++c) deepest_ = std::max(deepest_, -contacts_[c].gap);
    yield_to_starts(first, {pair.a, pair.b}, thickness);
    if (config.contacts_per_node_pair > 0)
        reduction_.reduce(contacts_, first, pair.a, bodies[pair.a].surface, bodies[pair.b].surface, thickness,
                          config.contacts_per_node_pair);
    for (std::size_t c = first; c < contacts_.size(); ++c) {
        contacts_[c].friction = config.friction;
        contacts_[c].stiffness = stiffness * contacts_[c].area;
    }
}

/// The finder of a body; made if there is none for this surface yet.
SelfContactFinder& ContactDetection::self_finder(int body, const ContactParty& party, double thickness) {
    const ContactShape* shape = party.surface.shape().get();
    const WideTree* tree = party.tree->box_tree();
    const auto fits = [&](const SelfContactFinder& finder) {
        return finder.rest()->is_of(shape, tree, thickness);
    };
    if (const auto own = self_finders_.find(body); own != self_finders_.end() && fits(own->second))
        return own->second;
    const auto like = std::ranges::find_if(self_finders_, [&](const auto& f) { return fits(f.second); });
    const auto rest =
        like != self_finders_.end()
            ? like->second.rest()
            : std::make_shared<const SelfContactRest>(party.surface, party.elastic.rest().X, tree, thickness);
    return self_finders_.insert_or_assign(body, SelfContactFinder(body, rest)).first->second;
}

void ContactDetection::find_self(int body, std::span<const ContactParty> bodies, const ContactConfig& config,
                                 double thickness, double dt_before, double dt, StepReport& report) {
    const ContactParty& party = bodies[body];
    const double own = self_thickness(*party.surface.shape(), thickness);
    SelfContactFinder& finder = self_finder(body, party, own);
    const double moved = dt_before > 0 ? 2 * dt_before * fastest(party, mean_velocity(party)) + party.moved
                                       : std::numeric_limits<double>::infinity();
    const std::size_t first = contacts_.size();
    finder.find(party.surface, *party.tree, party.state.v, dt + config.damping,
                2 * std::sqrt(3.0) * tree_error(party), moved, self_sides_[body], contacts_);
    report.add(finder.costs());
    finish_bodies(first, {body, body}, bodies, config, own, config.stiffness_scale * party.young / own);
    // Its layer is thinner than that of other contacts, which press from `thickness` on.
    for (std::size_t c = first; c < contacts_.size(); ++c) contacts_[c].gap += thickness - own;
}

}  // namespace nbd
