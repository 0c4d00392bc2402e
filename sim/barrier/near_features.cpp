#include "sim/barrier/near_features.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "meshing/parallel/parallel_for.hpp"
#include "sim/barrier/neighbour_features.hpp"

namespace nbd {
namespace {

constexpr double rest_share = 0.5;  // of its distance at rest, at which a pair of one surface presses

double rest_distance(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces) {
    const Nodes& X = surfaces[static_cast<std::size_t>(pair.surface_a)].rest();
    std::array<Eigen::Vector3d, 4> x;
    const auto at = corners(pair, surfaces);
    for (std::size_t k = 0; k < 4; ++k) x[k] = X.row(at[k].vertex);
    return closest_points(pair.kind, x).distance;
}

/// Whether the boxes of the two features over the motion come within `reach` along every axis. Features of
/// one surface move relative to its mean motion.
bool boxes_near(const FeaturePair& pair, const std::vector<MovingSurface>& surfaces, double reach) {
    const std::size_t corners_of_a = pair.kind == FeatureKind::vertex_face ? 1 : 2;
    const double infinity = std::numeric_limits<double>::infinity();
    Eigen::Array3d low[2], high[2];
    for (int side = 0; side < 2; ++side) {
        low[side].setConstant(infinity);
        high[side].setConstant(-infinity);
    }
    const auto at = corners(pair, surfaces);
    Eigen::Array3d frame = Eigen::Array3d::Zero();
    if (pair.surface_a == pair.surface_b)
        frame = surfaces[static_cast<std::size_t>(pair.surface_a)].mean_motion().array();
    for (std::size_t k = 0; k < 4; ++k) {
        const MovingSurface& surface = surfaces[static_cast<std::size_t>(at[k].surface)];
        const int side = k < corners_of_a ? 0 : 1;
        const Eigen::Array3d p = surface.begin().row(at[k].vertex).transpose().array(),
                             q = surface.end().row(at[k].vertex).transpose().array() - frame;
        low[side] = low[side].min(p).min(q);
        high[side] = high[side].max(p).max(q);
    }
    return (low[0] - high[1] <= reach).all() && (low[1] - high[0] <= reach).all();
}

}  // namespace

void NearFeatureSearch::begin(const std::vector<MovingSurface>& surfaces) {
    neighbours_.clear();
    for (std::size_t s = 0; s < surfaces.size(); ++s) {
        if (surfaces[s].is_obstacle()) continue;
        for (const FeaturePair& pair :
             neighbour_features(surfaces[s].F(), surfaces[s].topology(), static_cast<int>(s))) {
            const double distance = rest_distance(pair, surfaces);
            if (!(distance > 0))
                throw std::invalid_argument(
                    fmt::format("body {} touches itself at rest: {} {} and {} {}", surfaces[s].body(),
                                pair.kind == FeatureKind::vertex_face ? "vertex" : "edge", pair.a,
                                pair.kind == FeatureKind::vertex_face ? "face" : "edge", pair.b));
            neighbours_.push_back({pair, rest_share * distance});
        }
    }
}

/// The features that the two faces own, each with those of the other.
void NearFeatureSearch::add_faces(const std::vector<MovingSurface>& surfaces, int a, int b, FacePair faces) {
    const MovingSurface &s = surfaces[static_cast<std::size_t>(a)],
                        &t = surfaces[static_cast<std::size_t>(b)];
    const double unknown = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
        if (const int v = s.F()(faces.a, k); s.topology().owner_of_vertex(v) == faces.a)
            found_.push_back({{FeatureKind::vertex_face, a, b, v, faces.b}, unknown});
        if (const int v = t.F()(faces.b, k); t.topology().owner_of_vertex(v) == faces.b)
            found_.push_back({{FeatureKind::vertex_face, b, a, v, faces.a}, unknown});
        const int e = s.topology().face_edges(faces.a, k);
        if (s.topology().owner_of_edge(e) != faces.a) continue;
        for (int l = 0; l < 3; ++l)
            if (const int f = t.topology().face_edges(faces.b, l); t.topology().owner_of_edge(f) == faces.b)
                found_.push_back({{FeatureKind::edge_edge, a, b, e, f}, unknown});
    }
}

std::span<const NearFeatures> NearFeatureSearch::find(std::vector<MovingSurface>& surfaces, double reach) {
    found_ = neighbours_;
    face_pairs_ = 0;
    const int count = static_cast<int>(surfaces.size());
    for (int a = 0; a < count; ++a) {
        MovingSurface& s = surfaces[static_cast<std::size_t>(a)];
        if (!s.is_obstacle()) {
            const auto distance = static_cast<float>(reach + 2 * s.rounding());
            const auto pairs = self_query_.boxes_within(s.own_tree(), distance);
            face_pairs_ += static_cast<long>(pairs.size());
            for (const FacePair& faces : pairs) add_faces(surfaces, a, a, faces);
        }
        for (int b = a + 1; b < count; ++b) {
            MovingSurface& t = surfaces[static_cast<std::size_t>(b)];
            if (s.is_obstacle() && t.is_obstacle()) continue;
            const auto distance = static_cast<float>(reach + s.rounding() + t.rounding());
            const auto pairs = pair_query_.boxes_within(s.tree(), t.tree(), distance);
            face_pairs_ += static_cast<long>(pairs.size());
            for (const FacePair& faces : pairs) add_faces(surfaces, a, b, faces);
        }
    }
    keep_near(surfaces, reach);
    return kept_;
}

void NearFeatureSearch::keep_near(const std::vector<MovingSurface>& surfaces, double reach) {
    keeps_.assign(found_.size(), 0);
    parallel_for(static_cast<int>(found_.size()), [&](int i) {
        NearFeatures& near = found_[static_cast<std::size_t>(i)];
        near.reach = std::min(near.reach, reach);
        if (!boxes_near(near.pair, surfaces, near.reach)) return;
        const bool is_new = i >= static_cast<int>(neighbours_.size());
        if (is_new && near.pair.surface_a == near.pair.surface_b)
            near.reach = std::min(near.reach, rest_share * rest_distance(near.pair, surfaces));
        keeps_[static_cast<std::size_t>(i)] = boxes_near(near.pair, surfaces, near.reach);
    });
    kept_.clear();
    for (std::size_t i = 0; i < found_.size(); ++i)
        if (keeps_[i]) kept_.push_back(found_[i]);
    std::ranges::sort(kept_);
}

}  // namespace nbd
