#include "apps/view/contact_finder.hpp"

#include <algorithm>
#include <iterator>

#include "collision/geometry/far_origin.hpp"

namespace nbd {
namespace {

std::vector<std::uint32_t> faces_of(std::span<const FacePair> pairs, int FacePair::*side) {
    std::vector<std::uint32_t> faces;
    faces.reserve(pairs.size());
    for (const FacePair& pair : pairs) faces.push_back(pair.*side);
    return faces;
}

void append(std::vector<std::uint32_t>& faces, const std::vector<std::uint32_t>& more) {
    faces.insert(faces.end(), more.begin(), more.end());
}

/// Exact pairs that are not among those found.
std::vector<FacePair> missing(std::span<const FacePair> exact, std::span<const FacePair> found) {
    std::vector<FacePair> result;
    std::ranges::set_difference(exact, found, std::back_inserter(result));
    return result;
}

}  // namespace

void FaceMarks::add_frame(std::vector<std::uint32_t> marked) {
    std::ranges::sort(marked);
    marked.erase(std::unique(marked.begin(), marked.end()), marked.end());
    counts.push_back(marked.size());
    append(faces, marked);
}

ContactFinder::ContactFinder(double distance, bool self_contact, std::vector<Obstacle> obstacles,
                             const std::vector<Vertices>& rest, const std::deque<PosedView>& bodies)
    : distance_(static_cast<float>(distance)), obstacles_(std::move(obstacles)) {
    if (!self_contact) return;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const Faces& F = bodies[b].tree().faces;
        self_distance_.push_back(
            std::min(distance_, static_cast<float>(mean_edge(rest[b].cast<double>(), F))));
        self_.emplace_back(near_at_rest(rest[b], F, 2 * self_distance_.back()));
    }
}

void ContactFinder::meet(PosedView& a, PosedView& b, Marked& of_a, Marked& of_b, PairCounts& counts) {
    const bool may_miss = a.misses() || b.misses();
    const auto mark = [&](std::span<const FacePair> exact, std::span<const FacePair> found,
                          std::vector<std::uint32_t> Marked::*kind, std::uint32_t PairCounts::*count,
                          std::uint32_t PairCounts::*count_missed) {
        append(of_a.*kind, faces_of(exact, &FacePair::a));
        append(of_b.*kind, faces_of(exact, &FacePair::b));
        counts.*count += exact.size();
        if (!may_miss) return;
        const std::vector<FacePair> missed = missing(exact, found);
        append(of_a.missed, faces_of(missed, &FacePair::a));
        append(of_b.missed, faces_of(missed, &FacePair::b));
        counts.*count_missed += missed.size();
    };
    const std::span<const FacePair> none;
    const auto touching = exact_.intersecting(a.exact(), b.exact());
    mark(touching, may_miss ? own_.intersecting(a.own(), b.own()) : none, &Marked::intersecting,
         &PairCounts::intersecting, &PairCounts::intersecting_missed);
    if (distance_ <= 0) return;
    const auto near = exact_.within(a.exact(), b.exact(), distance_);
    mark(near, may_miss ? own_.within(a.own(), b.own(), distance_) : none, &Marked::near, &PairCounts::near,
         &PairCounts::near_missed);
}

void ContactFinder::meet_itself(PosedView& body, std::size_t index, Marked& marked, PairCounts& counts) {
    SelfQuery& query = self_[index];
    const auto touching = query.intersecting(body.exact());
    for (const auto side : {&FacePair::a, &FacePair::b})
        append(marked.intersecting, faces_of(touching, side));
    counts.intersecting += touching.size();
    const auto near = query.within(body.exact(), self_distance_[index]);
    for (const auto side : {&FacePair::a, &FacePair::b}) append(marked.near, faces_of(near, side));
    counts.near += near.size();
}

/// Marks faces with a vertex that is near an obstacle, or behind its surface.
void ContactFinder::meet_obstacles(const PosedView& body, double time, Marked& marked) const {
    if (obstacles_.empty()) return;
    std::vector<bool> is_near(body.x().rows());
    for (const Obstacle& told : obstacles_) {
        const Obstacle obstacle = as_at(told, time);
        for (Eigen::Index v = 0; v < body.x().rows(); ++v) {
            const auto found =
                signed_distance(obstacle, body.x().row(v).transpose().cast<double>(), time, distance_);
            if (found && found->distance <= distance_) is_near[v] = true;
        }
    }
    const Faces& F = body.tree().faces;
    for (Eigen::Index f = 0; f < F.rows(); ++f)
        for (int c = 0; c < 3; ++c)
            if (is_near[F(f, c)]) {
                marked.near.push_back(f);
                break;
            }
}

PairCounts ContactFinder::add_frame(std::deque<PosedView>& bodies, double time,
                                    std::vector<ViewBody>& shown) {
    PairCounts counts;
    std::vector<Marked> marked(bodies.size());
    for (std::size_t a = 0; a < bodies.size(); ++a) {
        for (std::size_t b = a + 1; b < bodies.size(); ++b)
            meet(bodies[a], bodies[b], marked[a], marked[b], counts);
        if (!self_.empty()) meet_itself(bodies[a], a, marked[a], counts);
        meet_obstacles(bodies[a], time, marked[a]);
    }
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        shown[b].near.add_frame(std::move(marked[b].near));
        shown[b].intersecting.add_frame(std::move(marked[b].intersecting));
        shown[b].missed.add_frame(std::move(marked[b].missed));
    }
    return counts;
}

}  // namespace nbd
