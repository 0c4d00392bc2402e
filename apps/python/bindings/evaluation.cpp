#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "apps/python/bindings/arrays.hpp"
#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/long_call.hpp"
#include "training/calibrate/random_splits.hpp"
#include "training/evaluate/contact_scenes.hpp"
#include "training/evaluate/coverage.hpp"
#include "training/evaluate/evaluate.hpp"

namespace nbd::python {
namespace {

using std::filesystem::path;
using Names = std::vector<std::string>;

std::vector<BoundKind> kinds_named(const Names& names) {
    std::vector<BoundKind> kinds;
    for (const std::string& name : names) kinds.push_back(bound_kind(name));
    return kinds;
}

/// The named kinds; without names, all calibrated ones.
std::vector<BoundKind> measured_kinds(const TreeFile& file, const std::optional<Names>& names) {
    if (names && names->empty()) throw std::invalid_argument("bounds: is empty; allowed: at least one kind");
    return names ? kinds_named(*names) : calibrated_bounds(file.tree);
}

std::vector<EvaluationRow> evaluate_file(const TreeFile& file, const path& data,
                                         const std::optional<std::vector<std::string>>& bounds,
                                         const std::vector<double>& margins, int max_frames) {
    EvaluateConfig config;
    config.margins = margins;
    config.max_frames = max_frames;
    if (bounds) config.bounds = measured_kinds(file, bounds);
    return stoppable<FileCall>([&] { return evaluate(file, RecordingReader(data), config); });
}

std::vector<CoverageRow> coverage_of(const TreeFile& file, const path& data,
                                     const std::optional<Names>& bounds) {
    const std::vector<BoundKind> kinds = measured_kinds(file, bounds);
    return stoppable<FileCall>([&] {
        const RecordingReader recording(data);
        const SurfaceBody body = surface_body(file);
        const TestFrames poses = test_frames(file, recording).back();
        std::vector<CoverageRow> rows;
        for (const BoundKind kind : kinds)
            for (const CoverageRow& row :
                 measure_coverage(body, refer_to(file.tree), kind, recording, poses.frames))
                rows.push_back(row);
        return rows;
    });
}

std::vector<ContactScenesRow> contact_scenes(const TreeFile& file, const path& data,
                                             const std::optional<Names>& bounds, int scenes, double deepest,
                                             std::uint64_t seed) {
    const std::vector<BoundKind> kinds = measured_kinds(file, bounds);
    check_has_bounds(file.tree, kinds);
    return stoppable<FileCall>([&] {
        const RecordingReader recording(data);
        const TestFrames poses = test_frames(file, recording).back();
        return check_contact_scenes(surface_body(file), refer_to(file.tree), kinds, recording, poses.frames,
                                    {.scenes = scenes, .deepest = deepest, .seed = seed});
    });
}

std::vector<RandomSplitsRow> random_splits(const TreeFile& file, const path& data, const std::string& bound,
                                           int splits) {
    const BoundKind kind = bound_kind(bound);
    if (splits < 1) throw std::invalid_argument(fmt::format("splits: is {}; allowed: at least 1", splits));
    if (!file.tree.calibrations.contains(kind))
        throw std::invalid_argument(fmt::format("{} bounds of the tree are not calibrated", name(kind)));
    return stoppable<FileCall>([&] {
        const RecordingReader recording(data);
        FrameSource source(file.W, recording);
        return check_random_splits(file, kind, source, splits);
    });
}

template <class Row>
std::string bound_of(const Row& row) {
    return std::string(name(row.bound));
}

template <class Row, Interval Row::*member>
std::pair<double, double> interval_of(const Row& row) {
    return {(row.*member).low, (row.*member).high};
}

void bind_evaluate(py::module_& m) {
    py::class_<EvaluationRow>(m, "EvaluationRow", "Result of one bound at one depth with one margin.")
        .def_readonly("frames", &EvaluationRow::frames)
        .def_property_readonly("bound", [](const EvaluationRow& row) { return std::string(name(row.bound)); })
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
          py::arg("margins") = EvaluateConfig{}.margins, py::arg("max_frames") = 0,
          "Errors and misses of a tree's bounds on the frames of a recording that its training did not see, "
          "one row for each set of frames, bound, margin and depth. margins: relative, >= 0; "
          "max_frames: of a set, 0: all. Leaves out bounds that the tree does not have; raises ValueError if "
          "it has none of them, for affine bounds, which are not those of nodes, and numbers out of range.");
}

void bind_coverage(py::module_& m) {
    py::class_<CoverageRow>(m, "CoverageRow", "Coverage of calibrated bounds at one depth of the tree.")
        .def_property_readonly("bound", &bound_of<CoverageRow>)
        .def_readonly("depth", &CoverageRow::depth)
        .def_readonly("trajectories", &CoverageRow::trajectories)
        .def_readonly("poses", &CoverageRow::poses)
        .def_readonly("miss_rate", &CoverageRow::miss_rate, "Stated.")
        .def_readonly("confidence", &CoverageRow::confidence, "Stated.")
        .def_readonly("keeping", &CoverageRow::keeping, "Trajectories with at most the stated miss rate.")
        .def_property_readonly("keeping_share", &interval_of<CoverageRow, &CoverageRow::keeping_share>,
                               "(low, high): 95 % interval of their share.")
        .def_readonly("nodes_missing", &CoverageRow::nodes_missing,
                      "Share of (pose, node) pairs that miss, mean over trajectories.")
        .def_property_readonly("nodes_missing_mean",
                               &interval_of<CoverageRow, &CoverageRow::nodes_missing_mean>,
                               "(low, high): 95 % interval of it.")
        .def_readonly("vertices_outside", &CoverageRow::vertices_outside, "Share of all vertices.")
        .def_readonly("inflation", &CoverageRow::inflation, "Mean of r / r_exact - 1.")
        .def_readonly("out_of_range", &CoverageRow::out_of_range,
                      "Share of (pose, node) pairs bounded exactly.");
    m.def("measure_coverage", &coverage_of, py::arg("file"), py::arg("recording"),
          py::arg("bounds") = py::none(),
          "Whether calibrated bounds keep their stated miss rate, as `nbdtree coverage` measures it: on the "
          "held-out trajectories of the training's recording, or all complete ones of another. bounds: by "
          "default all calibrated ones. Raises ValueError for bounds without calibration.");
}

void bind_contact_scenes(py::module_& m) {
    py::class_<ContactScenesRow>(m, "ContactScenesRow", "Face pairs that one kind of bounds misses.")
        .def_property_readonly("bound", &bound_of<ContactScenesRow>)
        .def_readonly("scenes", &ContactScenesRow::scenes, "Scenes in which the bodies intersect.")
        .def_readonly("scenes_missing", &ContactScenesRow::scenes_missing, "Of these, with a pair not found.")
        .def_readonly("face_pairs", &ContactScenesRow::face_pairs)
        .def_readonly("missed", &ContactScenesRow::missed)
        .def_property_readonly("missed_share",
                               &interval_of<ContactScenesRow, &ContactScenesRow::missed_share>,
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
        py::arg("deepest") = defaults.deepest, py::arg("seed") = defaults.seed,
        "Intersecting face pairs that bounds miss in scenes of two copies of the body, as `nbdtree coverage "
        "--contacts` counts them. deepest: overlap in radii of the body, in (0, 1]. Raises ValueError for "
        "bounds that the tree does not have.");
    py::class_<RandomSplitsRow>(m, "RandomSplitsRow", "How often the miss rate was kept at one depth.")
        .def_readonly("depth", &RandomSplitsRow::depth)
        .def_readonly("splits", &RandomSplitsRow::splits)
        .def_readonly("calibration", &RandomSplitsRow::calibration, "Trajectories to calibrate on.")
        .def_readonly("test", &RandomSplitsRow::test, "Trajectories to test on.")
        .def_readonly("stated", &RandomSplitsRow::stated, "Stated share that keeps the rate, mean of splits.")
        .def_readonly("keeping", &RandomSplitsRow::keeping, "Measured share, mean of splits.")
        .def_readonly("nodes_missing", &RandomSplitsRow::nodes_missing, "Miss rate, mean of splits.")
        .def_readonly("highest", &RandomSplitsRow::highest, "Highest mean miss rate of a split.");
    m.def("check_random_splits", &random_splits, py::arg("file"), py::arg("recording"), py::arg("bound"),
          py::arg("splits") = 100,
          "How often the stated miss rate holds when the trajectories that training did not see are split at "
          "random into calibration and test. Raises ValueError for another recording than the training's.");
}

}  // namespace

void bind_evaluation(py::module_& m) {
    bind_evaluate(m);
    bind_coverage(m);
    bind_contact_scenes(m);
}

}  // namespace nbd::python
