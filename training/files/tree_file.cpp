#include "training/files/tree_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "collision/base/notice.hpp"
#include "meshing/h5/sparse.hpp"
#include "training/files/h5_fields.hpp"

namespace nbd {

namespace {

const h5::Format tree_format{"nbdtree tree", 2};

bool same(const ClusteredModes& a, const ClusteredModes& b) {
    return a.representatives == b.representatives && a.w == b.w && a.X == b.X && a.U == b.U;
}

/// What a file has of the surface besides the fields of its tree.
void read_surface(const h5::Reader& file, TreeFile& tree_file) {
    tree_file.X = file.matrix<Vertices>("surface/vertices", h5::any, 3);
    tree_file.tree.vertex_count = tree_file.X.rows();
    if (!tree_file.X.allFinite())
        file.refuse("surface/vertices has a number that is not finite", "finite numbers");
    const int nodes = file.attribute<int>("embedding", "nodes");
    if (nodes < 1)
        file.refuse(fmt::format("the embedding has {} nodes", nodes), fmt::format("1 to {}", INT32_MAX));
    tree_file.W = h5::read_sparse<float>(file, "embedding", tree_file.X.rows(), nodes);
    const Eigen::VectorXf sums = tree_file.W * Eigen::VectorXf::Ones(tree_file.W.cols());
    for (Eigen::Index i = 0; i < sums.size(); ++i)
        if (!(std::abs(sums[i] - 1) < 1e-4f))
            file.refuse(fmt::format("embedding: the weights of vertex {} sum to {}", i, sums[i]), "1");
}

constexpr auto seen_fields = [](auto& file, const std::string& group, auto& trajectories) {
    file.optional(group, trajectories, [&](auto& part, auto& seen) {
        auto& [frames, origins] = seen;
        part.field(group + "/frames", frames, Eigen::Dynamic);
        part.field(group + "/origins", origins, Eigen::Dynamic);
    });
};

/// As the lists of tree_fields.hpp; the hash of the body is an attribute of the file.
constexpr auto facts_fields = [](auto& file, auto& facts) {
    constexpr Eigen::Index any = Eigen::Dynamic;
    auto& [body_hash, recording_hash, config, split, trained_on, calibrated_on, poses, node_loss, z_error] =
        facts;
    auto& [train, calibration, held_out, frame_seed, random_frame_share, troubled_frames] = split;
    file.field("facts/recording_sha256", recording_hash);
    file.field("facts/poses", poses);
    file.field("facts/z_error", z_error);
    file.field("facts/frame_seed", frame_seed);
    file.field("facts/random_frame_share", random_frame_share);
    file.added_later("facts/troubled_frames", troubled_frames);
    file.text("facts/config", config);
    file.field("facts/train_trajectories", train, any);
    file.added_later("facts/calibration_trajectories", calibration, any);
    file.field("facts/held_out_trajectories", held_out, any);
    file.field("facts/node_loss", node_loss, any);
    seen_fields(file, "facts/trained_on", trained_on);
    seen_fields(file, "facts/calibrated_on", calibrated_on);
};

/// Throws unless facts that were read are within their ranges. nodes: of the tree.
void check_facts(const h5::Reader& file, const TrainingFacts& facts, std::size_t nodes) {
    if (facts.poses < 0)
        file.refuse(fmt::format("{} training poses", facts.poses), fmt::format("0 to {}", INT32_MAX));
    if (const float share = facts.split.random_frame_share; !(share >= 0 && share <= 1))
        file.refuse(fmt::format("random_frame_share is {}", share), "0 to 1");
    const std::size_t losses = facts.node_loss.size();
    if (losses != 0 && losses != nodes)
        file.refuse(fmt::format("facts/node_loss has {} numbers", losses), fmt::format("none or {}", nodes));
    if (!facts.node_loss.allFinite())
        file.refuse("facts/node_loss has a number that is not finite", "finite numbers");
    for (const auto& [seen, group] : {std::pair(&facts.trained_on, "facts/trained_on"),
                                      std::pair(&facts.calibrated_on, "facts/calibrated_on")})
        if (*seen && !(std::ranges::is_sorted((*seen)->frames) && std::ranges::is_sorted((*seen)->origins)))
            file.refuse(fmt::format("{} has hashes out of order", group), "ascending ones");
}

/// Says which bounds of the file are gone; false if none are.
bool tells_of_gone_bounds(const h5::Reader& file) {
    bool any = false;
    for (const GoneBounds& gone : gone_bounds)
        if (file.has(std::string(gone.group))) {
            any = true;
            notice(fmt::format("{}: {}", file.path().string(), left_out(gone)));
        }
    return any;
}

/// Returns f(); turns its std::invalid_argument into a std::runtime_error that names the file.
template <class F>
auto of_file(const std::filesystem::path& path, const F& f) {
    try {
        return f();
    } catch (const std::invalid_argument& e) {
        throw std::runtime_error(fmt::format("{}: {}", path.string(), e.what()));
    }
}

/// Runs check_collision_tree() on the content of a file.
void check(const std::filesystem::path& path, const TreeFile& file) {
    of_file(path, [&] {
        check_collision_tree(file.tree);
        if (file.tree.affine && !file.tree.affine->hangs_by(file.W))
            throw std::invalid_argument(
                "the affine model has other weights than the embedding; allowed: the same ones");
    });
}

}  // namespace

SurfaceBody surface_body(const TreeFile& file) {
    return {file.X, file.tree.faces, file.W, ModeRows(3 * file.X.rows(), 0), file.facts.body_hash};
}

void save_tree(const std::filesystem::path& path, const TreeFile& tree_file) {
    const CollisionTree& tree = tree_file.tree;
    check(path, tree_file);
    if (tree_file.X.rows() != tree.vertex_count || tree_file.W.rows() != tree.vertex_count)
        throw std::runtime_error(
            fmt::format("{}: {} rest positions and {} rows of the embedding, but the tree has {} vertices",
                        path.string(), tree_file.X.rows(), tree_file.W.rows(), tree.vertex_count));
    h5::Writer file(path, tree_format);
    H5FieldWriter fields(file);
    file.attribute("/", "body_sha256", tree_file.facts.body_hash);
    file.write("surface/vertices", tree_file.X, fields.packing);
    h5::write_sparse(file, "embedding", tree_file.W);
    file.attribute("embedding", "nodes", static_cast<int>(tree_file.W.cols()));
    if (tree.bd && tree.nbd && same(tree.bd->modes, tree.nbd->modes)) fields.link("bd/modes", "/nbd/modes");
    const StoredModels models = stored_models(tree);
    tree_fields::tree(fields, tree, models);
    facts_fields(fields, tree_file.facts);
    file.commit();
}

TreeFile load_tree(const std::filesystem::path& path) {
    h5::Reader file(path, tree_format);
    if (file.format().version < tree_format.version)
        file.refuse(
            fmt::format("is a tree of version {}", file.format().version),
            fmt::format("version {}; train the tree again with `nbdtree train`", tree_format.version));
    H5FieldReader fields(file);
    TreeFile result;
    CollisionTree& tree = result.tree;
    read_surface(file, result);
    StoredModels models;
    of_file(path, [&] { tree_fields::tree(fields, tree, models); });
    // These calibrations are invalid: they used an older ood_score, or networks that were not rounded.
    if (tree.nbd && (tree.nbd->z_mean.size() == 0 || models.are_networks_rounded))
        tree.calibrations.erase(BoundKind::nbd);
    if (models.are_networks_rounded)
        tree.calibrations.erase(BoundKind::bd);  // the modes were not rounded either
    if (models.learned_affine) models.learned_affine->X = result.X;
    if (models.affine) {
        if (models.affine->rest.rows() != result.W.cols())
            file.refuse(fmt::format("dataset 'affine/rest' is {} x 3", models.affine->rest.rows()),
                        fmt::format("{} x 3", result.W.cols()));
        models.affine->W = result.W;
    }
    of_file(path, [&] { make_models(tree, std::move(models)); });
    if (!tree.affine && file.has("solid/nodes")) {  // of a file that may be older than `affine` bounds
        SurfaceBody body = surface_body(result);
        body.solid.X = file.matrix<Nodes>("solid/nodes", result.W.cols(), 3);
        hang_on_solid(tree, body);
    }
    if (tells_of_gone_bounds(file)) of_file(path, [&] { require_other_bounds(tree); });
    result.facts.body_hash = file.attribute<std::string>("/", "body_sha256");
    facts_fields(fields, result.facts);
    check_facts(file, result.facts, tree.spheres.nodes.size());
    return result;
}

}  // namespace nbd
