#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "collision/query/pair_query.hpp"
#include "sim/fem/elastic_body.hpp"
#include "sim/world/body_load.hpp"
#include "sim/world/grip.hpp"

namespace nbd {

/// What World::add_body() takes.
struct WorldBody {
    std::shared_ptr<const ElasticBody> elastic;
    Embedding W;                                  // [surface vertices, tet nodes]
    Faces F;                                      // of the surface
    std::shared_ptr<const CollisionTree> tree{};  // of the surface W, F; null: exact bounds of its own
    BoundKind bounds = BoundKind::exact;          // `auto`: as exact_for_auto() says
    std::optional<float> margin{};  // relative, of the tree's spheres; none: PosedTree's default
    BodyState state{};              // empty x: the rest pose without velocity
    std::vector<Grip> grips{};
    std::vector<BodyLoad> loads{};
    // Coulomb's coefficient of each surface vertex, where no rule for a pair has one; below 0: the usual one.
    // Empty: of all. Between vertices it is interpolated; of two surfaces with their own, the smaller one
    // holds.
    std::vector<double> friction{};
    std::string name{};  // in messages; empty: "body 0", ...
};

}  // namespace nbd
