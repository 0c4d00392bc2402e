#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "collision/base/message.hpp"
#include "collision/tree/collision_tree.hpp"

// The list of a tree's fields, for all files that hold trees, and for whatever else goes over all of them.
namespace nbd {

/// What files hold in place of the models of `learned_affine` and `affine`, which make_models() makes again.
struct StoredModels {
    /// What hang_on_nodes() takes.
    struct HungNodes {
        Vertices rest;
        SurfaceEmbedding W;
    };
    std::optional<LearnedAffineFit> learned_affine{};
    std::optional<HungNodes> affine{};
    bool are_networks_rounded = false;  // by the reader: the networks of the file have other weights
};

/// Of a tree that is to be written.
StoredModels stored_models(const CollisionTree& tree);

/// Checks a tree that was read, makes its models and `boxes`, and checks it again with them. Throws
/// std::invalid_argument as check_collision_tree(), hang_on_nodes() and LearnedAffineModel.
void make_models(CollisionTree& tree, StoredModels models);

/// A member of the structs of a table: a number or a vector of fixed size.
template <class Struct, class T>
struct TableColumn {
    std::string_view name;
    T Struct::*member;
};
template <class Struct, class T>
TableColumn(const char*, T Struct::*) -> TableColumn<Struct, T>;

/// Whether the columns make up the whole struct, judged by its size.
template <class Struct, class... T>
constexpr bool is_whole_struct = ((sizeof(T) + ...) + alignof(Struct) - 1) / alignof(Struct) *
                                     alignof(Struct) ==
                                 sizeof(Struct);

// `tree` calls `file` for each field of a tree, in the order of flat files. A writer gets const arguments; a
// reader fills them, reads before what gives the shapes of the rest, and ends with make_models(). Structured
// bindings name all members of a struct, so that a new member cannot be forgotten. `file` has:
// - field(name, value, rows, columns): a number, a vector or a matrix. Eigen::Dynamic: of any size.
// - may_be_empty(name, value, rows, columns): likewise, or without numbers.
// - table(name, structs, rows, columns...): a vector of structs, with a TableColumn for each member.
// - numbers(name, value): NetworkNumbers.
// - follows(name, value, rows, columns): as field(), or an embedding and the number of its nodes, for files
//   without the positions and the embedding of the surface, from which these follow.
// - optional(group, value, fields), entry(group, map, key, fields): fields(file, value) if there is a value.
namespace tree_fields {

inline constexpr Eigen::Index any = Eigen::Dynamic;

inline constexpr auto spheres = [](auto& file, auto& tree) {
    using Node = SphereTree::Node;
    auto& [nodes, faces, vertices, rest] = tree;
    file.table("topology/nodes", nodes, any, TableColumn{"first_child", &Node::first_child},
               TableColumn{"depth", &Node::depth}, TableColumn{"face_begin", &Node::face_begin},
               TableColumn{"face_end", &Node::face_end}, TableColumn{"vertex_begin", &Node::vertex_begin},
               TableColumn{"vertex_end", &Node::vertex_end});
    file.field("topology/faces", faces, any);
    file.field("topology/vertices", vertices, any);
    file.table("topology/rest_spheres", rest, std::ssize(nodes), TableColumn{"c", &Sphere::c},
               TableColumn{"r", &Sphere::r});
};

inline constexpr auto modes = [](auto& file, const std::string& group, auto& clustered) {
    auto& [representatives, w, X, U] = clustered;
    file.field(group + "/representatives", representatives, any);
    const Eigen::Index k = std::ssize(representatives);
    file.field(group + "/w", w, k);
    file.field(group + "/X", X, k, 3);
    file.field(group + "/U", U, 3 * k, any);
};

inline constexpr auto bd = [](auto& file, auto& model, Eigen::Index nodes) {
    auto& [clustered, z_to_q, Ubar, dr] = model;
    modes(file, "bd/modes", clustered);
    const Eigen::Index m = clustered.U.cols();
    file.field("bd/z_to_q", z_to_q, m, m);
    file.field("bd/Ubar", Ubar, m, 3 * nodes);
    file.field("bd/dr", dr, m, nodes);
};

/// is_rounded: out, whether the networks that were read have other weights than the file.
inline constexpr auto nbd = [](auto& file, auto& model, Eigen::Index nodes, bool& is_rounded) {
    constexpr bool reads = !std::is_const_v<std::remove_reference_t<decltype(model)>>;
    auto& [clustered, z_centre, z_scale, networks, out_centre, out_scale, centre_map, z_mean, z_whitening] =
        model;
    modes(file, "nbd/modes", clustered);
    const Eigen::Index m = clustered.U.cols();
    int hidden = networks.hidden();
    std::vector<float> weights = networks.weights();
    NetworkNumbers numbers = networks.numbers();
    file.field("nbd/hidden", hidden);
    if constexpr (reads) NbdNetworks(model.mode_count(), hidden, {});  // throws unless the shape is allowed
    file.field("nbd/z_centre", z_centre, m);
    file.field("nbd/z_scale", z_scale, m);
    file.field("nbd/weights", weights, nodes, NbdNetworks::weight_count(model.mode_count(), hidden));
    file.numbers("nbd/numbers", numbers);
    if constexpr (reads) {
        networks = NbdNetworks(model.mode_count(), hidden, weights, numbers);
        is_rounded = networks.weights() != weights;
    }
    file.field("nbd/out_centre", out_centre, NbdModel::outputs, nodes);
    file.field("nbd/out_scale", out_scale, NbdModel::outputs, nodes);
    file.may_be_empty("nbd/centre_map", centre_map, m, 3 * nodes);
    file.may_be_empty("nbd/z_mean", z_mean, m);
    file.may_be_empty("nbd/z_whitening", z_whitening, m, m);
};

inline constexpr auto learned_affine = [](auto& file, auto& fit) {
    auto& [X, samples, box_samples, clusters, residual, growth] = fit;
    file.follows("learned_affine/X", X, any, 3);
    file.field("learned_affine/samples", samples, any);
    file.field("learned_affine/box_samples", box_samples, any);
    file.table("learned_affine/clusters", clusters, any, TableColumn{"growth", &BoxFit::growth},
               TableColumn{"mean", &BoxFit::mean},
               TableColumn{"inverse_deviation", &BoxFit::inverse_deviation});
    file.field("learned_affine/residual", residual, any);
    file.field("learned_affine/growth", growth, any);
};

inline constexpr auto affine = [](auto& file, auto& hung) {
    auto& [rest, W] = hung;
    file.field("affine/rest", rest, any, 3);
    file.follows("affine", W, rest.rows());
};

inline constexpr auto calibration = [](auto& file, const std::string& group, auto& c, Eigen::Index bounds) {
    auto& [miss_rate, confidence, trajectories, poses, margins, limits] = c;
    file.field(group + "/miss_rate", miss_rate);
    file.field(group + "/confidence", confidence);
    file.field(group + "/trajectories", trajectories);
    file.field(group + "/poses", poses);
    file.field(group + "/margins", margins, bounds);
    file.may_be_empty(group + "/limits", limits, bounds);
};

/// models: stored_models() of a tree that is written; else filled, for make_models().
inline constexpr auto tree = [](auto& file, auto& whole, auto& models) {
    auto& [vertex_count, faces, sphere_tree, bd_model, nbd_model, learned, hung, boxes, calibrations] = whole;
    file.follows("surface/vertex_count", vertex_count);
    file.field("surface/faces", faces, any, 3);
    spheres(file, sphere_tree);
    const Eigen::Index nodes = std::ssize(sphere_tree.nodes);
    file.optional("bd", bd_model, [&](auto& part, auto& model) { bd(part, model, nodes); });
    bool is_rounded = false;
    file.optional("nbd", nbd_model, [&](auto& part, auto& model) { nbd(part, model, nodes, is_rounded); });
    if constexpr (!std::is_const_v<std::remove_reference_t<decltype(models)>>)
        models.are_networks_rounded = is_rounded;
    file.optional("learned_affine", models.learned_affine, learned_affine);
    file.optional("affine", models.affine, affine);
    for (const BoundKind kind : bound_kinds) {
        const std::string group = message("calibration/", name(kind));
        file.entry(group, calibrations, kind,
                   [&](auto& part, auto& c) { calibration(part, group, c, is_box(kind) ? any : nodes); });
    }
};

}  // namespace tree_fields
}  // namespace nbd
