#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "apps/cli/load_body.hpp"
#include "apps/python/bindings/arrays.hpp"
#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/long_call.hpp"
#include "apps/python/bindings/shared_tree.hpp"
#include "apps/python/bindings/typed.hpp"
#include "collision/base/notice.hpp"
#include "training/calibrate/calibrate.hpp"
#include "training/evaluate/contact_scenes.hpp"
#include "training/evaluate/coverage.hpp"
#include "training/evaluate/evaluate.hpp"
#include "training/learn/train_tree.hpp"
#include "training/learn/transfer_tree.hpp"

namespace pybind11::detail {

/// (low, high)
template <>
struct type_caster<nbd::Interval> {
    static constexpr auto name = const_name("Tuple[float, float]");

    static handle cast(const nbd::Interval& interval, return_value_policy, handle) {
        return make_tuple(interval.low, interval.high).release();
    }
};

}  // namespace pybind11::detail

namespace nbd::python {
namespace {

using std::filesystem::path;
using SharedFile = std::shared_ptr<TreeFile>;

void check_trained(BoundKind kind) {
    if (std::ranges::find(trained_kinds, kind) == std::end(trained_kinds))
        throw std::invalid_argument(
            fmt::format("bounds: \"{}\" are not trained; allowed: nbd, learned_affine", name(kind)));
}

/// Ends a training that was stopped by Ctrl-C or by an exception of the progress function.
[[noreturn]] void stopped(const Progress& progress, const path& checkpoint) {
    progress.check();
    raise_stop(checkpoint.empty() || !std::filesystem::exists(checkpoint)
                   ? "the training was stopped, nothing of it is kept"
                   : "the training was stopped; the same call continues from " + checkpoint.string());
}

SharedFile train_body(const Body& body, const path& data, const TrainConfig& config,
                      const CalibrateConfig& calibration, const path& checkpoint, Stoppable& stoppable,
                      Progress& progress) {
    TrainRun run;
    run.checkpoint = checkpoint;
    run.stage = [&](std::string_view stage) { progress.tell(stage, 0, 1); };
    run.hooks.cancel = [&] { return stoppable.asked(); };
    run.hooks.progress = [&](const TrainingProgress& done) {
        progress.tell("networks", done.nodes_done, done.nodes);
    };
    const FileCall call;
    const RecordingReader recording(data);
    SurfaceBody surface = surface_body(body);
    FrameSource source(surface.W, recording);
    auto file = std::make_shared<TreeFile>(train_tree(std::move(surface), source, config, run));
    if (file->facts.split.calibration_trajectories.empty()) {
        notice("no trajectories were kept for calibration, so the bounds have no stated miss rate");
    } else {
        progress.tell("calibration", 0, 1);
        calibrate(*file, source, calibration);
    }
    return file;
}

SharedFile train(const Body& body, const path& data, const std::vector<BoundKind>& bounds,
                 std::optional<int> depth, int modes, int clusters, const std::string& network, int epochs,
                 std::optional<double> held_out, double calibration, double random_frames,
                 const std::string& split, double miss_rate, std::optional<double> confidence,
                 std::uint64_t seed, const std::optional<path>& checkpoint_file,
                 const ProgressFunction& function) {
    std::ranges::for_each(bounds, check_trained);
    if (network != "default" && network != "paper")
        throw std::invalid_argument(fmt::format("network: is \"{}\"; allowed: default, paper", network));
    if (held_out && !split.empty())
        throw std::invalid_argument("split: excludes held_out; allowed: one of them");
    TrainConfig config;
    config.bounds = bounds;
    if (network == "paper") use_paper_networks(config);
    config.tree.depth = depth.value_or(default_depth(bounds, body.surface.F.rows()));
    config.modes = modes;
    config.clusters.k_means.clusters = clusters;
    config.mlp.max_epochs = epochs;
    config.held_out_share = held_out;
    config.split = split;
    config.calibration_share = calibration;
    config.random_frame_share = random_frames;
    config.seed = seed;
    const path checkpoint = checkpoint_file.value_or(path());
    Stoppable stoppable;
    Progress progress(function, stoppable);
    SharedFile file;
    try {
        file = train_body(body, data, config, {.miss_rate = miss_rate, .confidence = confidence}, checkpoint,
                          stoppable, progress);
    } catch (const TrainingCancelled&) {
        stopped(progress, checkpoint);
    } catch (const StopAsked&) {
        stopped(progress, checkpoint);
    }
    progress.check();
    // Trainings without networks write none; another file of this name is not theirs.
    if (std::ranges::find(bounds, BoundKind::nbd) != bounds.end() && !checkpoint.empty())
        std::filesystem::remove(checkpoint);
    return file;
}

/// A copy, so that trees that are in use keep the calibration that they began with.
SharedFile calibrated(const TreeFile& file, const path& data, double miss_rate,
                      std::optional<double> confidence) {
    const RecordingReader recording(data);
    auto copy = std::make_shared<TreeFile>(file);
    calibrate(*copy, recording, {.miss_rate = miss_rate, .confidence = confidence});
    return copy;
}

SharedFile transferred(const TreeFile& file, const Body& body) {
    return std::make_shared<TreeFile>(transfer_tree(file, surface_body(body)));
}

Typed<"dict[str, Any]"> training_facts(const TreeFile& file) {
    const TrainingFacts& facts = file.facts;
    return py::dict(py::arg("body_hash") = facts.body_hash, py::arg("recording_hash") = facts.recording_hash,
                    py::arg("config") = py::module_::import("json").attr("loads")(facts.config),
                    py::arg("train_trajectories") = facts.split.train_trajectories,
                    py::arg("calibration_trajectories") = facts.split.calibration_trajectories,
                    py::arg("held_out_trajectories") = facts.split.held_out_trajectories,
                    py::arg("poses") = facts.poses, py::arg("z_error") = facts.z_error,
                    py::arg("node_loss") = facts.node_loss);
}

void bind_tree_file(py::module_& m) {
    py::class_<TreeFile, SharedFile>(m, "TreeFile",
                                     "A trained tree with its surface and where it comes from.")
        .def_property_readonly(
            "tree", [](const SharedFile& file) { return SharedTree(file, &file->tree); },
            "The tree. Refers to this object.")
        .def_readonly("X", &TreeFile::X,
                      "Rest positions of the surface [n, 3], float32. Refers to the object.")
        .def_property_readonly(
            "W", [](py::object self) { return embedding_views(self.cast<const TreeFile&>().W, self); },
            "Weights of the tet nodes, (data, indices, indptr). Refers to the object.")
        .def(
            "surface_positions",
            [](const TreeFile& file, const Rows<Vertices, "x">& x) {
                expect_nodes(x.count(), file.W.cols());
                return embedded(file.W, *x);
            },
            py::arg("x"), "Positions of the surface, W x, float32 as PosedTree takes them. A new array.")
        .def_property_readonly("facts", &training_facts);
    m.def(
        "load_tree", [](const path& file) { return std::make_shared<TreeFile>(load_tree(file)); },
        py::arg("path"), UsesFiles(), "Reads a tree file.");
    m.def("save_tree", &write_checked<save_tree, TreeFile>, py::arg("path"), py::arg("file"), UsesFiles(),
          "Writes a tree file under a temporary name and renames it.");
}

using Kinds = std::optional<std::vector<BoundKind>>;

/// The given kinds; without any, all calibrated ones.
std::vector<BoundKind> measured_kinds(const TreeFile& file, const Kinds& given) {
    if (given && given->empty()) throw std::invalid_argument("bounds: is empty; allowed: at least one kind");
    return given.value_or(calibrated_bounds(file.tree));
}

std::vector<EvaluationRow> evaluate_file(const TreeFile& file, const path& data, const Kinds& bounds,
                                         const std::vector<double>& margins, int max_frames) {
    EvaluateConfig config;
    config.margins = margins;
    config.max_frames = max_frames;
    if (bounds) config.bounds = measured_kinds(file, bounds);
    return evaluate(file, RecordingReader(data), config);
}

std::vector<CoverageRow> coverage_of(const TreeFile& file, const path& data, const Kinds& bounds) {
    const std::vector<BoundKind> kinds = measured_kinds(file, bounds);
    const RecordingReader recording(data);
    const SurfaceBody body = surface_body(file);
    const TestFrames poses = test_frames(file, recording).back();
    std::vector<CoverageRow> rows;
    for (const BoundKind kind : kinds)
        for (const CoverageRow& row :
             measure_coverage(body, refer_to(file.tree), kind, recording, poses.frames))
            rows.push_back(row);
    return rows;
}

std::vector<ContactScenesRow> contact_scenes(const TreeFile& file, const path& data, const Kinds& bounds,
                                             int scenes, double deepest, std::uint64_t seed) {
    const std::vector<BoundKind> kinds = measured_kinds(file, bounds);
    check_has_bounds(file.tree, kinds);
    const RecordingReader recording(data);
    const TestFrames poses = test_frames(file, recording).back();
    return check_contact_scenes(surface_body(file), refer_to(file.tree), kinds, recording, poses.frames,
                                {.scenes = scenes, .deepest = deepest, .seed = seed});
}

void bind_evaluate(py::module_& m) {
    py::class_<EvaluationRow>(m, "EvaluationRow", "Result of one bound at one depth with one margin.")
        .def_readonly("frames", &EvaluationRow::frames)
        .def_readonly("bound", &EvaluationRow::bound)
        .def_readonly("depth", &EvaluationRow::depth)
        .def_readonly("margin", &EvaluationRow::margin)
        .def_readonly("radius_error", &EvaluationRow::radius_error)
        .def_readonly("inflation", &EvaluationRow::inflation)
        .def_readonly("centre_error", &EvaluationRow::centre_error)
        .def_readonly("vertices_outside", &EvaluationRow::vertices_outside)
        .def_readonly("nodes_missing", &EvaluationRow::nodes_missing)
        .def_readonly("poses", &EvaluationRow::poses)
        .def_readonly("nodes", &EvaluationRow::nodes)
        .def_readonly("vertices", &EvaluationRow::vertices);
    m.def("evaluate", &evaluate_file, py::arg("file"), py::arg("recording"), py::arg("bounds") = py::none(),
          py::arg("margins") = EvaluateConfig{}.margins, py::arg("max_frames") = 0, UsesFilesLong(),
          "Errors and misses of a tree's bounds on the frames of a recording that its training did not see, "
          "one row for each set of frames, bound, margin and depth. margins: relative, >= 0; "
          "max_frames: of a set, 0: all. Leaves out bounds that the tree does not have; raises ValueError if "
          "it has none of them, for affine bounds, which are not those of nodes, and numbers out of range.");
}

void bind_coverage(py::module_& m) {
    py::class_<CoverageRow>(m, "CoverageRow", "Coverage of calibrated bounds at one depth of the tree.")
        .def_readonly("bound", &CoverageRow::bound)
        .def_readonly("depth", &CoverageRow::depth)
        .def_readonly("trajectories", &CoverageRow::trajectories)
        .def_readonly("poses", &CoverageRow::poses)
        .def_readonly("miss_rate", &CoverageRow::miss_rate, "Stated.")
        .def_readonly("confidence", &CoverageRow::confidence, "Stated.")
        .def_readonly("keeping", &CoverageRow::keeping, "Trajectories with at most the stated miss rate.")
        .def_readonly("keeping_share", &CoverageRow::keeping_share,
                      "(low, high): 95 % interval of their share.")
        .def_readonly("nodes_missing", &CoverageRow::nodes_missing,
                      "Share of (pose, node) pairs that miss, mean over trajectories.")
        .def_readonly("nodes_missing_mean", &CoverageRow::nodes_missing_mean,
                      "(low, high): 95 % interval of it.")
        .def_readonly("vertices_outside", &CoverageRow::vertices_outside, "Share of all vertices.")
        .def_readonly("inflation", &CoverageRow::inflation, "Mean of r / r_exact - 1.")
        .def_readonly("out_of_range", &CoverageRow::out_of_range,
                      "Share of (pose, node) pairs bounded exactly.");
    m.def("measure_coverage", &coverage_of, py::arg("file"), py::arg("recording"),
          py::arg("bounds") = py::none(), UsesFilesLong(),
          "Whether calibrated bounds keep their stated miss rate, as `nbdtree coverage` measures it: on the "
          "held-out trajectories of the training's recording, or all complete ones of another. bounds: by "
          "default all calibrated ones. Raises ValueError for bounds without calibration.");
}

void bind_contact_scenes(py::module_& m) {
    py::class_<ContactScenesRow>(m, "ContactScenesRow", "Face pairs that one kind of bounds misses.")
        .def_readonly("bound", &ContactScenesRow::bound)
        .def_readonly("scenes", &ContactScenesRow::scenes, "Scenes in which the bodies intersect.")
        .def_readonly("scenes_missing", &ContactScenesRow::scenes_missing, "Of these, with a pair not found.")
        .def_readonly("face_pairs", &ContactScenesRow::face_pairs)
        .def_readonly("missed", &ContactScenesRow::missed)
        .def_readonly("missed_share", &ContactScenesRow::missed_share,
                      "(low, high): 95 % interval of the share of pairs missed.")
        .def_readonly("nodes_bounded", &ContactScenesRow::nodes_bounded, "Mean of a scene.")
        .def_readonly("leaf_pairs", &ContactScenesRow::leaf_pairs, "Mean of a scene.")
        .def_readonly("exact_leaf_pairs", &ContactScenesRow::exact_leaf_pairs,
                      "Mean of a scene with exact bounds.")
        .def_readonly("out_of_range", &ContactScenesRow::out_of_range,
                      "Mean of a scene: nodes bounded exactly.");
    const ContactScenesConfig defaults;
    m.def(
        "check_contact_scenes", &contact_scenes, py::arg("file"), py::arg("recording"),
        py::arg("bounds") = py::none(), py::kw_only(), py::arg("scenes") = defaults.scenes,
        py::arg("deepest") = defaults.deepest, py::arg("seed") = defaults.seed, UsesFilesLong(),
        "Intersecting face pairs that bounds miss in scenes of two copies of the body, as `nbdtree coverage "
        "--contacts` counts them. deepest: overlap in radii of the body, in (0, 1]. Raises ValueError for "
        "bounds that the tree does not have.");
}

}  // namespace

void bind_training(py::module_& m) {
    const TrainConfig defaults;
    bind_tree_file(m);
    m.def(
        "train", &train, py::arg("body"), py::arg("recording"),
        py::arg("bounds") = std::vector{BoundKind::nbd, BoundKind::learned_affine}, py::kw_only(),
        py::arg("depth") = py::none(), py::arg("modes") = defaults.modes,
        py::arg("clusters") = defaults.clusters.k_means.clusters, py::arg("network") = "default",
        py::arg("epochs") = defaults.mlp.max_epochs, py::arg("held_out") = py::none(),
        py::arg("calibration") = defaults.calibration_share,
        py::arg("random_frames") = defaults.random_frame_share, py::arg("split") = "",
        py::arg("miss_rate") = 1e-3, py::arg("confidence") = py::none(), py::arg("seed") = defaults.seed,
        py::arg("checkpoint") = py::none(), py::arg("progress") = py::none(),
        "Trains and calibrates the bounds of a body's tree on a recording, as `nbdtree train` does, with the "
        "same bits. checkpoint: a file that an interrupted training continues from. progress: a function "
        "(what, done, total). Ctrl-C stops it. split: of the dataset, by its name, instead of held_out.");
    m.def("calibrate", &calibrated, py::arg("file"), py::arg("recording"), py::arg("miss_rate") = 1e-3,
          py::arg("confidence") = py::none(), UsesFilesLong(),
          "A new file with margins for a stated miss rate; the given one stays as it is. Of the recording "
          "of the training, uses the trajectories kept for calibration; of another one, all complete ones. "
          "Raises ValueError for a rate or confidence out of range, or too high for so few trajectories.");
    m.def("transfer_tree", &transferred, py::arg("file"), py::arg("body"), ComputesLong(),
          "A new file for a body with another resolution of the surface: nbd bounds with their calibration, "
          "as `nbdtree transfer`. Raises ValueError where the surfaces do not lie over each other.");
    bind_evaluate(m);
    bind_coverage(m);
    bind_contact_scenes(m);
}

}  // namespace nbd::python
