#include "training/files/tree_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "collision/base/notice.hpp"
#include "meshing/h5/sparse.hpp"
#include "training/files/learned_affine_file.hpp"

namespace nbd {

namespace {

const h5::Format tree_format{"nbdtree tree", 2};

using IntRows = Eigen::Matrix<int, Eigen::Dynamic, 6, Eigen::RowMajor>;
using SphereRows = Eigen::Matrix<float, Eigen::Dynamic, 4, Eigen::RowMajor>;

// Everything is deflated: index arrays shrink to a third, float32 by a tenth.
constexpr auto packing = h5::Packing::deflate;

bool same(const ClusteredModes& a, const ClusteredModes& b) {
    return a.representatives == b.representatives && a.w == b.w && a.X == b.X && a.U == b.U;
}

void write_topology(h5::Writer& file, const CollisionTree& tree) {
    const SphereTree& spheres = tree.spheres;
    IntRows nodes(spheres.nodes.size(), 6);
    SphereRows rest(nodes.rows(), 4);
    for (Eigen::Index i = 0; i < nodes.rows(); ++i) {
        const SphereTree::Node& n = spheres.nodes[i];
        const Sphere& s = spheres.rest[i];
        nodes.row(i) << n.first_child, n.depth, n.face_begin, n.face_end, n.vertex_begin, n.vertex_end;
        rest.row(i) << s.c.transpose(), s.r;
    }
    file.write("topology/nodes", nodes, packing);
    file.write("topology/faces", spheres.faces, packing);
    file.write("topology/vertices", spheres.vertices, packing);
    file.write("topology/rest_spheres", rest, packing);
}

void write_surface(h5::Writer& file, const TreeFile& tree_file) {
    file.write("surface/faces", tree_file.tree.faces, packing);
    file.write("surface/vertices", tree_file.X, packing);
    h5::write_sparse(file, "embedding", tree_file.W);
    file.attribute("embedding", "nodes", static_cast<int>(tree_file.W.cols()));
}

void read_surface(const h5::Reader& file, TreeFile& tree_file) {
    tree_file.tree.faces = file.matrix<Faces>("surface/faces", h5::any, 3);
    tree_file.X = file.matrix<Vertices>("surface/vertices", h5::any, 3);
    tree_file.tree.vertex_count = tree_file.X.rows();
    if (!tree_file.X.allFinite())
        file.refuse("surface/vertices has a number that is not finite", "finite numbers");
    const std::int64_t nodes = file.int_attribute("embedding", "nodes");
    if (nodes < 1 || nodes > INT32_MAX)
        file.refuse(fmt::format("the embedding has {} nodes", nodes), fmt::format("1 to {}", INT32_MAX));
    tree_file.W = h5::read_sparse<float>(file, "embedding", tree_file.X.rows(), nodes);
    const Eigen::VectorXf sums = tree_file.W * Eigen::VectorXf::Ones(tree_file.W.cols());
    for (Eigen::Index i = 0; i < sums.size(); ++i)
        if (!(std::abs(sums[i] - 1) < 1e-4f))
            file.refuse(fmt::format("embedding: the weights of vertex {} sum to {}", i, sums[i]), "1");
}

void read_topology(const h5::Reader& file, CollisionTree& tree) {
    const auto nodes = file.matrix<IntRows>("topology/nodes", h5::any, 6);
    const auto rest = file.matrix<SphereRows>("topology/rest_spheres", nodes.rows(), 4);
    for (Eigen::Index i = 0; i < nodes.rows(); ++i) {
        const auto n = nodes.row(i);
        tree.spheres.nodes.push_back({n[0], n[1], n[2], n[3], n[4], n[5]});
        tree.spheres.rest.push_back({rest.row(i).head<3>().transpose(), rest(i, 3)});
    }
    tree.spheres.faces = file.read<int>("topology/faces", {h5::any});
    tree.spheres.vertices = file.read<int>("topology/vertices", {h5::any});
}

void write_modes(h5::Writer& file, const std::string& group, const ClusteredModes& modes) {
    file.write(group + "/representatives", modes.representatives, packing);
    file.write(group + "/weights", modes.w, packing);
    file.write(group + "/X", modes.X, packing);
    file.write(group + "/U", modes.U.numbers(), packing);
}

ClusteredModes read_modes(const h5::Reader& file, const std::string& group) {
    ClusteredModes modes;
    modes.representatives = file.read<int>(group + "/representatives", {h5::any});
    const std::size_t k = modes.representatives.size();
    modes.w = file.matrix<Eigen::VectorXf>(group + "/weights", k);
    modes.X = file.matrix<Vertices>(group + "/X", k, 3);
    modes.U = FixedMatrix(file.matrix<Eigen::MatrixXf>(group + "/U", 3 * k, h5::any));
    return modes;
}

void write_bd(h5::Writer& file, const BdModel& bd) {
    file.write("bd/z_to_q", bd.z_to_q, packing);
    file.write("bd/Ubar", bd.Ubar, packing);
    file.write("bd/dr", bd.dr, packing);
}

BdModel read_bd(const h5::Reader& file, std::size_t nodes) {
    BdModel bd;
    bd.modes = read_modes(file, "bd/modes");
    const std::size_t m = bd.modes.U.cols();
    bd.z_to_q = file.matrix<Eigen::MatrixXf>("bd/z_to_q", m, m);
    bd.Ubar = file.matrix<Eigen::MatrixXf>("bd/Ubar", m, 3 * nodes);
    bd.dr = file.matrix<Eigen::MatrixXf>("bd/dr", m, nodes);
    return bd;
}

void write_nbd(h5::Writer& file, const NbdModel& nbd) {
    file.group("nbd");
    file.attribute("nbd", "hidden", nbd.networks.hidden());
    file.attribute("nbd", "numbers", name(nbd.networks.numbers()));
    file.write("nbd/z_centre", nbd.z_centre, packing);
    file.write("nbd/z_scale", nbd.z_scale, packing);
    const std::vector<float> weights = nbd.networks.weights();
    const std::size_t per_node = nbd.networks.weight_count();
    file.write("nbd/weights", {weights.size() / per_node, per_node}, std::span(weights), packing);
    file.write("nbd/out_centre", nbd.out_centre, packing);
    file.write("nbd/out_scale", nbd.out_scale, packing);
    if (nbd.centre_map.size() > 0) file.write("nbd/centre_map", nbd.centre_map.numbers(), packing);
    if (nbd.z_mean.size() == 0) return;
    file.write("nbd/z_mean", nbd.z_mean, packing);
    file.write("nbd/z_whitening", nbd.z_whitening, packing);
}

/// Numbers of the networks; bytes in files that do not say.
NetworkNumbers read_numbers(const h5::Reader& file) {
    if (!file.has_attribute("nbd", "numbers")) return NetworkNumbers::bytes;
    const std::string text = file.text_attribute("nbd", "numbers");
    for (const NetworkNumbers numbers : {NetworkNumbers::bytes, NetworkNumbers::floats})
        if (text == name(numbers)) return numbers;
    file.refuse(fmt::format("the networks have {} as numbers", text), "bytes and floats");
}

/// as_stored: out, true if the networks are as in the file, false if rounding to bytes changed them.
NbdModel read_nbd(const h5::Reader& file, std::size_t nodes, bool& as_stored) {
    NbdModel nbd;
    nbd.modes = read_modes(file, "nbd/modes");
    const std::int64_t hidden = file.int_attribute("nbd", "hidden");
    if (hidden < 1 || hidden > NbdNetworks::max_hidden)
        file.refuse(fmt::format("the networks have {} hidden units", hidden),
                    fmt::format("1 to {}", NbdNetworks::max_hidden));
    const std::size_t m = nbd.mode_count();
    nbd.z_centre = file.matrix<Eigen::VectorXf>("nbd/z_centre", m);
    nbd.z_scale = file.matrix<Eigen::VectorXf>("nbd/z_scale", m);
    const int per_node = NbdNetworks::weight_count(nbd.mode_count(), hidden);
    const auto weights = file.read<float>("nbd/weights", {nodes, static_cast<std::size_t>(per_node)});
    nbd.networks = NbdNetworks(nbd.mode_count(), hidden, weights, read_numbers(file));
    as_stored = nbd.networks.weights() == weights;
    nbd.out_centre = file.matrix<Eigen::MatrixXf>("nbd/out_centre", NbdModel::outputs, nodes);
    nbd.out_scale = file.matrix<Eigen::MatrixXf>("nbd/out_scale", NbdModel::outputs, nodes);
    if (file.has("nbd/centre_map"))
        nbd.centre_map = FixedMatrix(file.matrix<Eigen::MatrixXf>("nbd/centre_map", m, 3 * nodes));
    if (file.has("nbd/z_mean")) {
        nbd.z_mean = file.matrix<Eigen::VectorXf>("nbd/z_mean", m);
        nbd.z_whitening = file.matrix<Eigen::MatrixXf>("nbd/z_whitening", m, m);
    }
    return nbd;
}

std::string calibration_group(BoundKind kind) { return fmt::format("calibration/{}", name(kind)); }

void write_calibration(h5::Writer& file, BoundKind kind, const Calibration& calibration) {
    const std::string group = calibration_group(kind);
    file.group(group);
    file.attribute(group, "miss_rate", calibration.miss_rate);
    file.attribute(group, "confidence", calibration.confidence);
    file.attribute(group, "trajectories", calibration.trajectories);
    file.attribute(group, "poses", static_cast<std::int64_t>(calibration.poses));
    file.write(group + "/margins", calibration.margins, packing);
    if (!calibration.limits.empty()) file.write(group + "/limits", calibration.limits, packing);
}

Calibration read_calibration(const h5::Reader& file, BoundKind kind, std::size_t nodes) {
    const std::string group = calibration_group(kind);
    const auto count = [&](const char* what) {
        const std::int64_t value = file.int_attribute(group, what);
        if (value < 1 || value > INT32_MAX)
            file.refuse(fmt::format("{} has {} {}", group, value, what), fmt::format("1 to {}", INT32_MAX));
        return static_cast<int>(value);
    };
    return {.miss_rate = file.number_attribute(group, "miss_rate"),
            .confidence = file.number_attribute(group, "confidence"),
            .trajectories = count("trajectories"),
            .poses = count("poses"),
            .margins = file.read<float>(group + "/margins", {nodes}),
            .limits = file.has(group + "/limits") ? file.read<float>(group + "/limits", {nodes})
                                                  : std::vector<float>()};
}

void write_seen(h5::Writer& file, const std::string& group, const std::optional<SeenTrajectories>& seen) {
    if (!seen) return;
    file.group(group);
    file.write(group + "/frames", seen->frames);
    file.write(group + "/origins", seen->origins);
}

std::optional<SeenTrajectories> read_seen(const h5::Reader& file, const std::string& group) {
    if (!file.has(group)) return {};
    SeenTrajectories seen{file.read<std::uint64_t>(group + "/frames", {h5::any}),
                          file.read<std::uint64_t>(group + "/origins", {h5::any})};
    for (const auto* hashes : {&seen.frames, &seen.origins})
        if (!std::ranges::is_sorted(*hashes))
            file.refuse(fmt::format("{} has hashes out of order", group), "ascending ones");
    return seen;
}

void write_facts(h5::Writer& file, const TrainingFacts& facts) {
    file.group("facts");
    file.attribute("facts", "recording_sha256", facts.recording_hash);
    file.attribute("facts", "poses", facts.poses);
    file.attribute("facts", "z_error", facts.z_error);
    file.attribute("facts", "frame_seed", facts.split.frame_seed);
    file.attribute("facts", "random_frame_share", facts.split.random_frame_share);
    file.attribute("facts", "troubled_frames", facts.split.troubled_frames ? 1 : 0);
    file.write_text("facts/config", facts.config);
    file.write("facts/train_trajectories", facts.split.train_trajectories);
    file.write("facts/calibration_trajectories", facts.split.calibration_trajectories);
    file.write("facts/held_out_trajectories", facts.split.held_out_trajectories);
    file.write("facts/node_loss", facts.node_loss);
    write_seen(file, "facts/trained_on", facts.trained_on);
    write_seen(file, "facts/calibrated_on", facts.calibrated_on);
}

TrainingFacts read_facts(const h5::Reader& file, std::size_t nodes) {
    TrainingFacts facts;
    facts.body_hash = file.text_attribute("/", "body_sha256");
    facts.recording_hash = file.text_attribute("facts", "recording_sha256");
    const std::int64_t poses = file.int_attribute("facts", "poses");
    if (poses < 0 || poses > INT32_MAX)
        file.refuse(fmt::format("{} training poses", poses), fmt::format("0 to {}", INT32_MAX));
    facts.poses = poses;
    facts.z_error = file.number_attribute("facts", "z_error");
    facts.split.frame_seed = file.uint_attribute("facts", "frame_seed");
    facts.split.random_frame_share = static_cast<float>(file.number_attribute("facts", "random_frame_share"));
    if (!(facts.split.random_frame_share >= 0 && facts.split.random_frame_share <= 1))
        file.refuse(fmt::format("random_frame_share is {}", facts.split.random_frame_share), "0 to 1");
    facts.split.troubled_frames =
        file.has_attribute("facts", "troubled_frames") && file.int_attribute("facts", "troubled_frames") != 0;
    facts.config = file.read_text("facts/config");
    facts.split.train_trajectories = file.read<int>("facts/train_trajectories", {h5::any});
    facts.split.held_out_trajectories = file.read<int>("facts/held_out_trajectories", {h5::any});
    if (file.has("facts/calibration_trajectories"))
        facts.split.calibration_trajectories = file.read<int>("facts/calibration_trajectories", {h5::any});
    facts.node_loss = file.matrix<Eigen::VectorXf>("facts/node_loss", h5::any);
    const std::size_t losses = facts.node_loss.size();
    if (losses != 0 && losses != nodes)
        file.refuse(fmt::format("facts/node_loss has {} numbers", losses), fmt::format("none or {}", nodes));
    if (!facts.node_loss.allFinite())
        file.refuse("facts/node_loss has a number that is not finite", "finite numbers");
    facts.trained_on = read_seen(file, "facts/trained_on");
    facts.calibrated_on = read_seen(file, "facts/calibrated_on");
    return facts;
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
    file.attribute("/", "body_sha256", tree_file.facts.body_hash);
    write_surface(file, tree_file);
    write_topology(file, tree);
    if (tree.nbd) {
        write_nbd(file, *tree.nbd);
        write_modes(file, "nbd/modes", tree.nbd->modes);
    }
    if (tree.bd) {
        write_bd(file, *tree.bd);
        if (tree.nbd && same(tree.bd->modes, tree.nbd->modes))
            file.link("bd/modes", "/nbd/modes");
        else
            write_modes(file, "bd/modes", tree.bd->modes);
    }
    if (tree.learned_affine) write_learned_affine(file, tree.learned_affine->fit());
    for (const auto& [kind, calibration] : tree.calibrations) write_calibration(file, kind, calibration);
    if (tree.affine) file.write("affine/rest", tree.affine->rest(), packing);
    write_facts(file, tree_file.facts);
    file.commit();
}

TreeFile load_tree(const std::filesystem::path& path) {
    h5::Reader file(path, tree_format);
    if (file.format().version < tree_format.version)
        file.refuse(
            fmt::format("is a tree of version {}", file.format().version),
            fmt::format("version {}; train the tree again with `nbdtree train`", tree_format.version));
    TreeFile result;
    CollisionTree& tree = result.tree;
    read_surface(file, result);
    read_topology(file, tree);
    const std::size_t nodes = tree.spheres.nodes.size();
    if (file.has("bd")) tree.bd = read_bd(file, nodes);
    bool networks_as_stored = true;
    if (file.has("nbd")) tree.nbd = of_file(path, [&] { return read_nbd(file, nodes, networks_as_stored); });
    for (const BoundKind kind : bound_kinds)
        if (kind != BoundKind::learned_affine && file.has(calibration_group(kind)))
            tree.calibrations[kind] = read_calibration(file, kind, nodes);
    // These calibrations are invalid: they used an older ood_score, or networks that were not rounded.
    if (tree.nbd && (tree.nbd->z_mean.size() == 0 || !networks_as_stored))
        tree.calibrations.erase(BoundKind::nbd);
    if (!networks_as_stored) tree.calibrations.erase(BoundKind::bd);  // the modes were not rounded either
    check(path, result);
    tree.boxes = make_boxes(tree);
    if (file.has("affine")) {
        const auto rest = file.matrix<Vertices>("affine/rest", result.W.cols(), 3);
        of_file(path, [&] { hang_on_nodes(tree, result.W, rest); });
    } else if (file.has("solid/nodes")) {  // of a file that may be older than `affine` bounds
        SurfaceBody body = surface_body(result);
        body.solid.X = file.matrix<Nodes>("solid/nodes", result.W.cols(), 3);
        hang_on_solid(tree, body);
    }
    if (file.has("learned_affine")) {
        tree.learned_affine = of_file(path, [&] {
            return std::make_shared<const LearnedAffineModel>(tree.boxes->tree(),
                                                              read_learned_affine(file, result.X));
        });
        constexpr auto kind = BoundKind::learned_affine;
        if (file.has(calibration_group(kind)))
            tree.calibrations[kind] = read_calibration(file, kind, bound_count(tree, kind));
        check(path, result);
    }
    if (tells_of_gone_bounds(file)) of_file(path, [&] { require_other_bounds(tree); });
    result.facts = read_facts(file, nodes);
    return result;
}

}  // namespace nbd
