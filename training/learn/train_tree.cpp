#include "training/learn/train_tree.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "collision/base/counter_random.hpp"
#include "collision/base/stopwatch.hpp"
#include "collision/nbd_tree/bd_bound.hpp"
#include "training/files/surface_body.hpp"
#include "training/networks/checkpoint.hpp"
#include "training/networks/network_fit.hpp"

namespace nbd {

namespace {

bool trains(const TrainConfig& config, BoundKind kind) {
    return std::ranges::find(config.bounds, kind) != config.bounds.end();
}

void check_config(const TrainConfig& config, const SurfaceBody& body) {
    for (const BoundKind kind : config.bounds)
        if (std::ranges::find(trained_kinds, kind) == std::end(trained_kinds))
            throw std::invalid_argument(
                fmt::format("{} bounds are not trained; allowed: nbd, learned_affine", name(kind)));
    if (config.bounds.empty())
        throw std::invalid_argument("no bounds to train; allowed: nbd, learned_affine");
    check_mlp_config(config.mlp);
    check_learned_affine_config(config.learned_affine);
    if (config.modes < 1 || config.modes > NbdNetworks::max_inputs)
        throw std::invalid_argument(
            fmt::format("{} modes; allowed: 1 to {}", config.modes, NbdNetworks::max_inputs));
    if (trains(config, BoundKind::nbd) && body.U.cols() < 1)
        throw std::invalid_argument("the body has no modes; run `nbdtree modes` first");
}

/// Trains the networks that the checkpoint lacks and keeps the checkpoint up to date.
std::vector<TrainedMlp> train_networks(const PoseRows& inputs, const PoseRows& targets,
                                       const MlpConfig& config, const TrainRun& run) {
    std::vector<TrainedMlp> networks(targets.cols() / MlpShape::outputs);
    if (run.checkpoint.empty()) {
        train_mlps(inputs, targets, config, run.hooks, {}, networks);
        return networks;
    }
    const std::string key = training_key(inputs, targets, config);
    load_checkpoint(run.checkpoint, key, networks);
    Stopwatch since_save;
    const auto node_done = [&] {
        if (since_save.seconds() < run.checkpoint_seconds) return;
        save_checkpoint(run.checkpoint, key, networks);
        since_save = {};
    };
    try {
        train_mlps(inputs, targets, config, run.hooks, node_done, networks);
    } catch (const TrainingCancelled&) {
        save_checkpoint(run.checkpoint, key, networks);
        throw;
    }
    save_checkpoint(run.checkpoint, key, networks);
    return networks;
}

/// Scales the labels in place, trains on them and gathers the model.
NbdModel train_model(const ClusteredModes& modes, PoseLabels& labels, const TrainConfig& config,
                     const TrainRun& run, Eigen::VectorXf& node_loss) {
    NbdModel model;
    model.modes = modes;
    const ColumnRange z = column_range(labels.z);
    scale_columns(labels.z, z);
    model.z_centre = z.centre;
    model.z_scale = z.scale();
    if (config.linear_centre) model.centre_map = FixedMatrix(take_linear_centre(labels.z, labels.spheres));
    ColumnRange spheres = column_range(labels.spheres);
    const auto nodes = spheres.centre.size() / NbdModel::outputs;
    using PerNode = Eigen::Map<Eigen::MatrixXf>;
    PerNode half(spheres.half.data(), NbdModel::outputs, nodes);
    // The linear part leaves small centre offsets. In one unit with the radius, their weight in the loss
    // matches how little they move the sphere's surface.
    if (config.linear_centre) half.rowwise() = half.colwise().maxCoeff().eval();
    scale_columns(labels.spheres, spheres);
    model.out_centre = PerNode(spheres.centre.data(), NbdModel::outputs, nodes);
    model.out_scale = half;

    const auto networks = train_networks(labels.z, labels.spheres, config.mlp, run);
    node_loss.resize(nodes);
    std::vector<float> weights;
    for (Eigen::Index i = 0; i < nodes; ++i) {
        const TrainedMlp& network = networks[i];
        weights.insert(weights.end(), network.weights.begin(), network.weights.end());
        node_loss[i] = network.loss;
    }
    const MlpShape shape{.inputs = model.mode_count(), .hidden = config.mlp.hidden};
    model.networks = config.network_numbers == NetworkNumbers::bytes
                         ? round_networks(shape, weights, labels.z, labels.spheres)
                         : NbdNetworks(shape.inputs, shape.hidden, weights, config.network_numbers);
    return model;
}

/// Fills in the tree's clustered modes, BD-Tree and networks.
void train_nbd(const SurfaceBody& body, FrameSource& source, std::span<const FrameId> frames,
               const TrainConfig& config, const TrainRun& run, TreeFile& file) {
    run.enter("clustering modes");
    const ClusteredModesChoice choice = cluster_modes(body, source, frames, config.clusters);
    file.facts.z_error = choice.z_error;
    file.tree.bd = build_bd_model(file.tree.spheres, Eigen::MatrixXf(body.U), choice.modes);
    run.enter("computing labels");
    PoseLabels labels =
        compute_labels(body, file.tree.spheres, choice.modes, source, frames, config.label_frame);
    run.enter(networks_stage);
    file.tree.nbd = train_model(choice.modes, labels, config, run, file.facts.node_loss);
}

}  // namespace

int default_depth(std::span<const BoundKind> bounds, Eigen::Index faces) {
    constexpr Eigen::Index most_leaf_faces = 600;
    int depth = SphereTreeConfig().depth;
    if (std::ranges::find(bounds, BoundKind::nbd) != bounds.end()) return depth;
    while (depth < 16 && faces >> depth > most_leaf_faces) ++depth;
    return depth;
}

void use_paper_networks(TrainConfig& config) {
    config.label_frame = LabelFrame::full;
    config.linear_centre = false;
    config.mlp.weight_decay = 0;
    config.mlp.arithmetic = Arithmetic::single;
    config.network_numbers = NetworkNumbers::floats;
}

std::string to_json(const TrainConfig& c) {
    nlohmann::ordered_json bounds = nlohmann::ordered_json::array();
    for (const BoundKind kind : c.bounds) bounds.push_back(name(kind));
    nlohmann::ordered_json json = {
        {"bounds", bounds},
        {"depth", c.tree.depth},
        {"min_leaf_faces", c.tree.min_leaf_faces},
        {"modes", c.modes},
        {"representatives", c.clusters.k_means.clusters},
        {"k_means_iterations", c.clusters.k_means.max_iterations},
        {"k_means_initialisations", c.clusters.initialisations},
        {"k_means_poses", c.clusters.poses},
        {"label_frame", name(c.label_frame)},
        {"linear_centre", c.linear_centre},
        {"held_out_share",
         c.held_out_share ? nlohmann::ordered_json(*c.held_out_share) : nlohmann::ordered_json()},
        {"calibration_share", c.calibration_share},
        {"random_frame_share", c.random_frame_share},
        {"troubled_frames", c.troubled_frames},
        {"hidden", c.mlp.hidden},
        {"batch", c.mlp.batch},
        {"arithmetic", name(c.mlp.arithmetic)},
        {"network_numbers", name(c.network_numbers)},
        {"learning_rate", c.mlp.learning_rate},
        {"min_learning_rate", c.mlp.min_learning_rate},
        {"weight_decay", c.mlp.weight_decay},
        {"decay", c.mlp.decay},
        {"patience", c.mlp.patience},
        {"improvement", c.mlp.improvement},
        {"max_epochs", c.mlp.max_epochs},
        {"box_miss_rate", c.learned_affine.box_miss_rate},
        {"seed", c.seed}};
    if (!c.split.empty()) json["split"] = c.split;
    return json.dump();
}

TreeFile train_tree(SurfaceBody body, FrameSource& source, TrainConfig config, const TrainRun& run) {
    const RecordingReader& recording = source.recording();
    check_config(config, body);
    check_recording(body.hash, body.W.cols(), recording);
    config.clusters.k_means.seed = counter_random(config.seed, 1, 0);
    config.mlp.seed = counter_random(config.seed, 2, 0);
    config.learned_affine.seed = counter_random(config.seed, 3, 0);
    config.modes = std::min<int>(config.modes, body.U.cols());
    if (config.modes < body.U.cols()) body.U = body.U.leftCols(config.modes).eval();

    TreeFile file;
    TrainingFacts& facts = file.facts;
    facts.body_hash = body.hash;
    facts.config = to_json(config);
    facts.split = make_split(recording, config.held_out_share, config.random_frame_share,
                             counter_random(config.seed, 0, 0), config.calibration_share, config.split);
    facts.split.troubled_frames = config.troubled_frames;
    const std::vector<FrameId> frames = frames_of(recording, facts.split, FrameSet::train);
    facts.poses = frames.size();
    const int needed = trains(config, BoundKind::nbd) ? config.mlp.batch : 1;
    if (facts.poses < needed)
        throw std::runtime_error(
            fmt::format("{}: {} training poses; allowed: at least {} for these bounds; "
                        "record more trajectories or frames",
                        recording.path().string(), facts.poses, needed));

    run.enter("reading");
    std::vector<FrameId> used = frames_of(recording, facts.split, FrameSet::calibration);
    used.insert(used.end(), frames.begin(), frames.end());
    std::ranges::sort(used);
    const RecordingHash& hashes = source.hashes(used);
    facts.recording_hash = hashes.hex;
    facts.trained_on = seen_trajectories(recording, hashes, facts.split.train_trajectories);
    file.tree.vertex_count = body.X.rows();
    file.tree.faces = body.F;
    file.X = body.X;
    file.W = body.W;
    file.tree.spheres = build_sphere_tree(body.X, body.F, config.tree);

    hang_on_solid(file.tree, body);
    file.tree.boxes = make_boxes(file.tree);
    if (trains(config, BoundKind::learned_affine))
        file.tree.learned_affine = train_learned_affine(body, file.tree.boxes->tree(), source, frames,
                                                        config.learned_affine, run.stage);
    if (run.hooks.cancel && run.hooks.cancel()) throw TrainingCancelled("training was stopped");
    if (trains(config, BoundKind::nbd)) train_nbd(body, source, frames, config, run, file);
    return file;
}

TreeFile train_tree(SurfaceBody body, const RecordingReader& recording, TrainConfig config,
                    const TrainRun& run) {
    FrameSource source(body.W, recording);
    return train_tree(std::move(body), source, std::move(config), run);
}

}  // namespace nbd
