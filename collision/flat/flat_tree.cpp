#include "collision/flat/flat_tree.hpp"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "collision/base/message.hpp"
#include "collision/base/notice.hpp"
#include "collision/base/temporary_files.hpp"
#include "collision/flat/flat_fields.hpp"
#include "collision/geometry/embedding.hpp"

namespace nbd {
namespace {

// The fields of a tree. `file` is a FlatFieldWriter, with the other argument const, or a FlatFieldReader.
// Structured bindings must name all members of a struct, in order, so that a new member cannot be forgotten.

constexpr auto sphere_fields = [](auto& file, auto& spheres) {
    using Node = SphereTree::Node;
    auto& [nodes, faces, vertices, rest] = spheres;
    file.table("topology/nodes", nodes, FlatColumn{"first_child", &Node::first_child},
               FlatColumn{"depth", &Node::depth}, FlatColumn{"face_begin", &Node::face_begin},
               FlatColumn{"face_end", &Node::face_end}, FlatColumn{"vertex_begin", &Node::vertex_begin},
               FlatColumn{"vertex_end", &Node::vertex_end});
    file.field("topology/faces", faces);
    file.field("topology/vertices", vertices);
    file.table("topology/rest_spheres", rest, FlatColumn{"c", &Sphere::c}, FlatColumn{"r", &Sphere::r});
};

constexpr auto modes_fields = [](auto& file, const std::string& group, auto& modes) {
    auto& [representatives, w, X, U] = modes;
    file.field(group + "/representatives", representatives);
    file.field(group + "/w", w);
    file.field(group + "/X", X);
    file.field(group + "/U", U);
};

constexpr auto bd_fields = [](auto& file, auto& bd) {
    auto& [modes, z_to_q, Ubar, dr] = bd;
    modes_fields(file, "bd/modes", modes);
    file.field("bd/z_to_q", z_to_q);
    file.field("bd/Ubar", Ubar);
    file.field("bd/dr", dr);
};

constexpr auto nbd_fields = [](auto& file, auto& nbd) {
    auto& [modes, z_centre, z_scale, networks, out_centre, out_scale, centre_map, z_mean, z_whitening] = nbd;
    modes_fields(file, "nbd/modes", modes);
    int hidden = networks.hidden();
    std::vector<float> weights = networks.weights();
    file.field("nbd/hidden", hidden);
    file.field("nbd/z_centre", z_centre);
    file.field("nbd/z_scale", z_scale);
    file.field("nbd/weights", weights);
    std::optional<bool> floats;  // absent for networks in bytes
    if (networks.numbers() == NetworkNumbers::floats) floats = true;
    file.optional("nbd/numbers", floats,
                  [](auto& part, auto& value) { part.field("nbd/numbers/floats", value); });
    if constexpr (!std::is_const_v<std::remove_reference_t<decltype(nbd)>>) {
        networks = NbdNetworks(nbd.mode_count(), hidden, weights,
                               floats.value_or(false) ? NetworkNumbers::floats : NetworkNumbers::bytes);
        if (networks.weights() != weights)
            throw std::invalid_argument("NBD-Tree: has weights that are not rounded to bytes");
    }
    file.field("nbd/out_centre", out_centre);
    file.field("nbd/out_scale", out_scale);
    file.field("nbd/centre_map", centre_map);
    file.field("nbd/z_mean", z_mean);
    file.field("nbd/z_whitening", z_whitening);
};

constexpr auto box_table = [](auto& file, const char* name, auto& boxes) {
    file.table(name, boxes, FlatColumn{"growth", &BoxFit::growth}, FlatColumn{"mean", &BoxFit::mean},
               FlatColumn{"inverse_deviation", &BoxFit::inverse_deviation});
};

constexpr auto learned_affine_fields = [](auto& file, auto& fit) {
    auto& [X, samples, box_samples, clusters, residual, growth] = fit;
    file.field("learned_affine/X", X);
    file.field("learned_affine/samples", samples);
    file.field("learned_affine/box_samples", box_samples);
    box_table(file, "learned_affine/clusters", clusters);
    file.field("learned_affine/residual", residual);
    file.field("learned_affine/growth", growth);
};

/// What an affine model is made of; W in compressed rows.
struct HungNodes {
    Vertices rest;
    std::vector<int> row_begin, columns;
    std::vector<float> weights;
};

std::optional<HungNodes> nodes_of(const std::shared_ptr<const AffineModel>& affine) {
    if (!affine) return std::nullopt;
    const SurfaceEmbedding W = affine->weights();
    const auto entries = W.nonZeros();
    return HungNodes{.rest = affine->rest(),
                     .row_begin = {W.outerIndexPtr(), W.outerIndexPtr() + W.rows() + 1},
                     .columns = {W.innerIndexPtr(), W.innerIndexPtr() + entries},
                     .weights = {W.valuePtr(), W.valuePtr() + entries}};
}

constexpr auto hung_fields = [](auto& file, auto& nodes) {
    auto& [rest, row_begin, columns, weights] = nodes;
    file.field("affine/rest", rest);
    file.field("affine/row_begin", row_begin);
    file.field("affine/columns", columns);
    file.field("affine/weights", weights);
};

/// fit: of the tree's `learned_affine` bounds, which the reader makes of it.
constexpr auto tree_fields = [](auto& file, auto& tree, auto& fit) {
    // The models of `affine` and `boxes` are not stored: hang_on_nodes() and make_boxes() make them again.
    auto& [vertex_count, faces, spheres, bd, nbd, learned_affine, affine, boxes, calibrations] = tree;
    file.field("surface/vertex_count", vertex_count);
    file.field("surface/faces", faces);
    sphere_fields(file, spheres);
    file.optional("bd", bd, bd_fields);
    file.optional("nbd", nbd, nbd_fields);
    file.optional("learned_affine", fit, learned_affine_fields);
    std::optional<HungNodes> hung = nodes_of(affine);
    file.optional("affine", hung, hung_fields);
    if constexpr (!std::is_const_v<std::remove_reference_t<decltype(tree)>>)
        if (hung)
            hang_on_nodes(tree,
                          embedding_of_rows(hung->row_begin, hung->columns, hung->weights, hung->rest.rows()),
                          hung->rest);
    for (const BoundKind kind : bound_kinds) {
        const std::string group = message("calibration/", name(kind));
        file.entry(group, calibrations, kind, [&](auto& part, auto& calibration) {
            auto& [miss_rate, confidence, trajectories, poses, margins, limits] = calibration;
            part.field(group + "/miss_rate", miss_rate);
            part.field(group + "/confidence", confidence);
            part.field(group + "/trajectories", trajectories);
            part.field(group + "/poses", poses);
            part.field(group + "/margins", margins);
            part.field(group + "/limits", limits);
        });
    }
};

/// Leaves out the arrays of bounds that are gone, with a notice. Returns whether there are any.
bool leave_out_gone_bounds(FlatFieldReader& file) {
    bool any = false;
    for (const GoneBounds& gone : gone_bounds)
        if (file.leave_out(message(gone.group, '/'))) {
            any = true;
            notice(message("a flat tree: ", left_out(gone)));
        }
    for (const char* bounds : {"learned_spheres", "learned_boxes"})
        file.leave_out(message("calibration/", bounds, '/'));
    return any;
}

[[noreturn]] void fail(const std::filesystem::path& path, const auto&... parts) {
    throw std::runtime_error(message(path.string(), ": ", parts...));
}

/// The bytes of a file; only the beginning of a foreign file, which may be large.
std::vector<std::byte> file_content(const std::filesystem::path& path) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(path, error);
    if (error == std::errc::no_such_file_or_directory || error == std::errc::not_a_directory)
        fail(path, "no such file");
    if (error) fail(path, "cannot be read: ", error.message());
    errno = 0;
    std::ifstream in(path, std::ios::binary);
    std::vector<std::byte> content;
    const auto read_to = [&](std::uintmax_t end) {
        const std::size_t begin = content.size();
        content.resize(end);
        in.read(reinterpret_cast<char*>(content.data() + begin), end - begin);
        if (!in) fail(path, "cannot be read: ", std::generic_category().message(errno));
    };
    read_to(std::min<std::uintmax_t>(size, sizeof(FlatHeader)));
    if (is_flat_file(content)) read_to(size);
    return content;
}

}  // namespace

CollisionTree read_flat_tree(std::span<const std::byte> file) {
    FlatFieldReader reader(file);
    CollisionTree tree;
    try {
        std::optional<LearnedAffineFit> fit;
        tree_fields(reader, tree, fit);
        const bool lost_bounds = leave_out_gone_bounds(reader);
        reader.finish();
        check_sphere_tree(tree.spheres, tree.vertex_count, tree.faces);
        tree.boxes = make_boxes(tree);
        if (fit)
            tree.learned_affine =
                std::make_shared<const LearnedAffineModel>(tree.boxes->tree(), *std::move(fit));
        check_collision_tree(tree);
        if (lost_bounds) require_other_bounds(tree);
    } catch (const std::invalid_argument& e) {
        throw std::runtime_error(e.what());
    }
    return tree;
}

std::vector<std::byte> write_flat_tree(const CollisionTree& tree) {
    check_collision_tree(tree);
    FlatFieldWriter writer;
    std::optional<LearnedAffineFit> fit;
    if (tree.learned_affine) fit = tree.learned_affine->fit();
    tree_fields(writer, tree, std::as_const(fit));
    return writer.finish();
}

CollisionTree load_flat_tree(const std::filesystem::path& path) {
    const std::vector<std::byte> content = file_content(path);
    try {
        return read_flat_tree(content);
    } catch (const std::runtime_error& e) {
        fail(path, e.what());
    }
}

void save_flat_tree(const std::filesystem::path& path, const CollisionTree& tree) {
    const std::vector<std::byte> bytes = write_flat_tree(tree);
    TemporaryFile file(path);
    file.write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    file.commit();
}

}  // namespace nbd
