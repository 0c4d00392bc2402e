#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "apps/cli/load_body.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/shared_tree.hpp"
#include "collision/base/notice.hpp"
#include "training/calibrate/calibrate.hpp"
#include "training/learn/train_tree.hpp"
#include "training/learn/transfer_tree.hpp"

namespace nbd::python {
namespace {

using std::filesystem::path;
using SharedBody = std::shared_ptr<Body>;
using SharedFile = std::shared_ptr<TreeFile>;

BoundKind trained_kind(const std::string& text) {
    const BoundKind kind = bound_kind(text);
    if (std::ranges::find(trained_kinds, kind) == std::end(trained_kinds))
        throw std::invalid_argument(
            fmt::format("bounds: \"{}\" are not trained; allowed: nbd, learned_affine", text));
    return kind;
}

/// The options of train() that Python may give, with the defaults of the command.
struct TrainOptions {
    std::vector<std::string> bounds;
    std::optional<int> depth;
    int modes, clusters, epochs;
    std::string network;
    std::optional<double> held_out;
    double calibration, random_frames;
    std::string split;
    std::uint64_t seed;

    TrainConfig config(const Body& body) const {
        if (network != "default" && network != "paper")
            throw std::invalid_argument(fmt::format("network: is \"{}\"; allowed: default, paper", network));
        TrainConfig config;
        config.bounds.clear();
        for (const std::string& bound : bounds) config.bounds.push_back(trained_kind(bound));
        if (network == "paper") use_paper_networks(config);
        config.tree.depth = depth.value_or(default_depth(config.bounds, body.surface.F.rows()));
        config.modes = modes;
        config.clusters.k_means.clusters = clusters;
        config.mlp.max_epochs = epochs;
        if (held_out && !split.empty())
            throw std::invalid_argument("split: excludes held_out; allowed: one of them");
        config.held_out_share = held_out;
        config.split = split;
        config.calibration_share = calibration;
        config.random_frame_share = random_frames;
        config.seed = seed;
        return config;
    }
};

/// Ends a training that was stopped by Ctrl-C or by an exception of the progress function.
[[noreturn]] void stopped(const Progress& progress, const path& checkpoint) {
    progress.check();
    raise_stop(checkpoint.empty() || !std::filesystem::exists(checkpoint)
                   ? "the training was stopped, nothing of it is kept"
                   : "the training was stopped; the same call continues from " + checkpoint.string());
}

SharedFile train_body(const Body& body, const path& data, const TrainOptions& options,
                      const CalibrateConfig& calibration, const path& checkpoint, Stoppable& stoppable,
                      Progress& progress) {
    TrainRun run;
    run.checkpoint = checkpoint;
    run.stage = [&](std::string_view stage) { progress.tell(stage, 0, 1); };
    run.hooks.cancel = [&] { return stoppable.asked(); };
    run.hooks.progress = [&](const TrainingProgress& done) {
        progress.tell("networks", done.nodes_done, done.nodes);
    };
    const TrainConfig config = options.config(body);
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

SharedFile train(const Body& body, const path& data, const std::vector<std::string>& bounds,
                 std::optional<int> depth, int modes, int clusters, const std::string& network, int epochs,
                 std::optional<double> held_out, double calibration, double random_frames,
                 const std::string& split, double miss_rate, std::optional<double> confidence,
                 std::uint64_t seed, const std::optional<path>& checkpoint_file, const py::object& function) {
    const path checkpoint = checkpoint_file.value_or(path());
    Stoppable stoppable;
    Progress progress(function, stoppable);
    SharedFile file;
    try {
        file =
            train_body(body, data,
                       {bounds, depth, modes, clusters, epochs, network, held_out, calibration, random_frames,
                        split, seed},
                       {.miss_rate = miss_rate, .confidence = confidence}, checkpoint, stoppable, progress);
    } catch (const TrainingCancelled&) {
        stopped(progress, checkpoint);
    } catch (const StopAsked&) {
        stopped(progress, checkpoint);
    }
    progress.check();
    // Trainings without networks write none; another file of this name is not theirs.
    if (std::ranges::find(bounds, "nbd") != bounds.end() && !checkpoint.empty())
        std::filesystem::remove(checkpoint);
    return file;
}

/// A copy, so that trees that are in use keep the calibration that they began with.
SharedFile calibrated(const TreeFile& file, const path& data, double miss_rate,
                      std::optional<double> confidence) {
    return stoppable<FileCall>([&] {
        const RecordingReader recording(data);
        auto copy = std::make_shared<TreeFile>(file);
        calibrate(*copy, recording, {.miss_rate = miss_rate, .confidence = confidence});
        return copy;
    });
}

SharedFile transferred(const TreeFile& file, const Body& body) {
    return stoppable([&] { return std::make_shared<TreeFile>(transfer_tree(file, surface_body(body))); });
}

py::dict training_facts(const TreeFile& file) {
    const TrainingFacts& facts = file.facts;
    py::dict all;
    all["body_hash"] = facts.body_hash;
    all["recording_hash"] = facts.recording_hash;
    all["config"] = py::module_::import("json").attr("loads")(facts.config);
    all["train_trajectories"] = facts.split.train_trajectories;
    all["calibration_trajectories"] = facts.split.calibration_trajectories;
    all["held_out_trajectories"] = facts.split.held_out_trajectories;
    all["poses"] = facts.poses;
    all["z_error"] = facts.z_error;
    all["node_loss"] = owned(Eigen::VectorXf(facts.node_loss));
    return all;
}

void bind_tree_file(py::module_& m) {
    py::class_<TreeFile, SharedFile>(m, "TreeFile",
                                     "A trained tree with its surface and where it comes from.")
        .def_property_readonly(
            "tree", [](const SharedFile& file) { return SharedTree(file, &file->tree); },
            "The tree. Refers to this object.")
        .def_property_readonly(
            "X", [](py::object self) { return view(self.cast<const TreeFile&>().X, self); },
            "Rest positions of the surface [n, 3], float32. Refers to the object.")
        .def_property_readonly(
            "W", [](py::object self) { return embedding_views(self.cast<const TreeFile&>().W, self); },
            "Weights of the tet nodes, (data, indices, indptr). Refers to the object.")
        .def(
            "surface_positions",
            [](const TreeFile& file, py::handle x) {
                const VertexRows nodes(x, "x", 3);
                nodes.expect(file.W.cols(), "x", "node");
                return owned(embedded(file.W, nodes.as<Vertices>()));
            },
            py::arg("x"), "Positions of the surface, W x, float32 as PosedTree takes them. A new array.")
        .def_property_readonly("facts", &training_facts);
    m.def(
        "load_tree",
        [](const path& file) {
            const FileCall call;
            return std::make_shared<TreeFile>(load_tree(file));
        },
        py::arg("path"), "Reads a tree file.");
    m.def(
        "save_tree",
        [](const path& path, const TreeFile& file) {
            check_output(path, {});
            const FileCall call;
            save_tree(path, file);
        },
        py::arg("path"), py::arg("file"), "Writes a tree file under a temporary name and renames it.");
}

}  // namespace

void bind_training(py::module_& m) {
    const TrainConfig defaults;
    bind_tree_file(m);
    m.def(
        "train", &train, py::arg("body"), py::arg("recording"),
        py::arg("bounds") = std::vector<std::string>{"nbd", "learned_affine"}, py::kw_only(),
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
          py::arg("confidence") = py::none(),
          "A new file with margins for a stated miss rate; the given one stays as it is. Of the recording "
          "of the training, uses the trajectories kept for calibration; of another one, all complete ones. "
          "Raises ValueError for a rate or confidence out of range, or too high for so few trajectories.");
    m.def("transfer_tree", &transferred, py::arg("file"), py::arg("body"),
          "A new file for a body with another resolution of the surface: nbd bounds with their calibration, "
          "as `nbdtree transfer`. Raises ValueError where the surfaces do not lie over each other.");
}

}  // namespace nbd::python
