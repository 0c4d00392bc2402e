#include <fmt/format.h>
#include <tbb/global_control.h>

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "apps/check/check_file.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/dataset/card.hpp"
#include "apps/dataset/hold_out.hpp"
#include "apps/dataset/plan.hpp"
#include "apps/dataset/producer.hpp"
#include "apps/dataset/scene_trajectories.hpp"
#include "apps/dataset/variety.hpp"
#include "apps/python/bindings/arrays.hpp"
#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/json_text.hpp"
#include "apps/python/bindings/make_dataset.hpp"
#include "apps/python/bindings/typed.hpp"
#include "collision/base/notice.hpp"
#include "meshing/body/body_hints.hpp"
#include "training/files/dataset_manifest.hpp"
#include "training/files/recording.hpp"

namespace nbd::python {
namespace {

using std::filesystem::path;

void check_count(const char* name, int count, int most) {
    if (count < 1 || count > most)
        throw std::invalid_argument(fmt::format("{}: is {}; allowed: 1 to {}", name, count, most));
}

/// The ranges of a recipe: a dictionary, or the file at a path.
RecipeRanges ranges_from(py::handle recipe, std::optional<double> strength) {
    RecipeRanges ranges;
    if (py::hasattr(recipe, "keys")) {
        ranges = parse_recipe_ranges(json_text(recipe));
    } else if (!recipe.is_none()) {
        ranges = load_recipe_ranges(path_from(recipe, "recipe"));
    }
    if (strength) ranges.strength = *strength;
    return ranges;
}

void make_dataset(const Body& body, const path& file, int trajectories, int frames, std::uint64_t seed,
                  std::optional<double> strength, const Typed<"Union[Path, Mapping[str, Any], None]">& recipe,
                  double frame_interval, int steps_per_frame, double held_out, int per_shard,
                  const std::string& licence, const std::string& hold_out, bool contact_forces, bool stress,
                  bool deformation_gradients, bool contact_edges, const ProgressFunction& function) {
    DatasetPlan plan = plan_of(
        {trajectories, per_shard, frames, held_out, hold_out, contact_forces, stress, deformation_gradients});
    plan.extras.contact_edges = contact_edges;
    plan.excitation.frame_interval = frame_interval;
    plan.excitation.steps_per_frame = steps_per_frame;
    plan.excitation.ranges = ranges_from(recipe, strength);
    plan.excitation.seed = seed;
    if (strength && !(*strength > 0 && *strength <= 1000))
        throw std::invalid_argument(fmt::format("strength: is {}; allowed: > 0 and at most 1000", *strength));
    check_output(file, {});
    make_files("make_dataset", file, function, [&](Stoppable& stoppable, Progress& progress) {
        produce(body, plan, file, body.name + ".h5", licence, stoppable, progress);
    });
}

Typed<"dict[str, Any]"> manifest_of(const path& file) {
    std::vector<std::pair<int, std::string>> recipes;
    const auto manifest = long_call<FileCall>([&] {
        const RecordingReader recording(file);
        for (const TrajectoryInfo& info : recording.trajectories())
            recipes.emplace_back(info.id, info.recipe.str());
        return read_dataset_manifest(file);
    });
    const py::object read = py::module_::import("json").attr("loads");
    py::dict splits;
    const DatasetSplit drawn = manifest.split(trajectory_split);
    splits[trajectory_split] = py::dict(py::arg("train") = drawn.train, py::arg("held_out") = drawn.held_out);
    for (const DatasetSplit& split : manifest.splits)
        splits[split.name.c_str()] =
            py::dict(py::arg("train") = split.train, py::arg("held_out") = split.held_out,
                     py::arg("rule") = read(split.rule));
    py::dict variables;
    for (const auto& [id, recipe] : recipes)
        if (const py::object json = read(recipe); json.contains("variables"))
            variables[py::int_(id)] = json["variables"];
    return py::dict(py::arg("train_trajectories") = manifest.train_trajectories,
                    py::arg("held_out_trajectories") = manifest.held_out_trajectories,
                    py::arg("plan") = read(manifest.plan), py::arg("variety") = read(manifest.variety),
                    py::arg("splits") = splits, py::arg("variables") = variables);
}

}  // namespace

DatasetPlan plan_of(const DatasetArguments& arguments) {
    DatasetPlan plan;
    check_count("trajectories", arguments.trajectories, 1'000'000);
    check_count("frames", arguments.frames.value_or(1), 1'000'000);
    check_count("per_shard", arguments.per_shard, 1'000'000);
    if (!(arguments.held_out >= 0 && arguments.held_out < 1))
        throw std::invalid_argument(
            fmt::format("held_out: is {}; allowed: >= 0 and < 1", arguments.held_out));
    if (!arguments.hold_out.empty()) parse_hold_out(arguments.hold_out);
    plan.hold_out = arguments.hold_out;
    plan.extras.fields[FrameField::contact_forces] = arguments.contact_forces;
    plan.extras.fields[FrameField::first_piola_stress] = arguments.stress;
    plan.extras.fields[FrameField::deformation_gradients] = arguments.deformation_gradients;
    plan.trajectories = arguments.trajectories;
    plan.per_shard = arguments.per_shard;
    plan.held_out_share = arguments.held_out;
    if (arguments.frames) plan.excitation.frames = *arguments.frames;
    return plan;
}

void produce(const Body& body, const DatasetPlan& plan, const path& file, const std::string& body_file,
             const std::string& licence, Stoppable& stoppable, Progress& progress) {
    const ShardFolder folder(file, plan.trajectories, plan.per_shard);
    const FileCall call;
    for (const std::string& hint : body_hints(body)) notice(fmt::format("the body: {}", hint));
    check_trajectories(plan, body);
    check_hold_out(plan, body);
    begin_dataset(folder, plan_json(plan, body));
    const auto stop_if_asked = [&] {
        if (stoppable.asked()) throw StopAsked();
    };
    Producer producer(
        body, plan, folder,
        {.warn = [](const std::string& line) { notice(line); },
         .progress = [&](int there) { progress.tell("trajectories", there, plan.trajectories); },
         .stop_if_asked = stop_if_asked});
    const auto all = [](int) { return true; };
    producer.verify(all);
    const auto threads = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
    do producer.produce(all, threads, 0);
    while (!producer.merge());
    write_card(folder, body,
               plan.scene ? plan.scene->body_file(folder.path()).filename().string() : body_file, licence);
    const Variety variety = variety_from_json(read_dataset_manifest(file).variety);
    if (variety.all.frames == 0)
        throw std::runtime_error(fmt::format(
            "{}: every trajectory failed, so there is nothing to train on; shorter steps or weaker forces may help",
            file.string()));
}

void bind_datasets(py::module_& m) {
    const DatasetPlan defaults;
    m.def("make_dataset", &make_dataset, py::arg("body"), py::arg("path"), py::kw_only(),
          py::arg("trajectories") = defaults.trajectories, py::arg("frames") = defaults.excitation.frames,
          py::arg("seed") = defaults.excitation.seed, py::arg("strength") = py::none(),
          py::arg("recipe") = py::none(), py::arg("frame_interval") = defaults.excitation.frame_interval,
          py::arg("steps_per_frame") = defaults.excitation.steps_per_frame,
          py::arg("held_out") = defaults.held_out_share, py::arg("per_shard") = defaults.per_shard,
          py::arg("licence") = "", py::arg("hold_out") = "", py::arg("contact_forces") = false,
          py::arg("stress") = false, py::arg("deformation_gradients") = false,
          py::arg("contact_edges") = false, py::arg("progress") = py::none(),
          "Simulates trajectories to train on, as `nbdtree dataset` does, with the same bits. "
          "recipe: a recipe file or a dictionary with its keys. progress: a function (what, done, total). "
          "Ctrl-C stops it; the same call continues. licence: what the dataset's card says of it. "
          "hold_out: a second split by a parameter of the recipes, as \"kind=thrown,drop\", "
          "\"velocity=0.5..2\" or \"velocity_gradient=top:0.2\". contact_forces, stress, "
          "deformation_gradients, contact_edges: what frames hold besides positions.");
    m.def(
        "dataset_manifest", &manifest_of, py::arg("path"),
        "What a dataset says of itself: train_trajectories and held_out_trajectories, by their ids; plan, "
        "which determines its content; variety, how much its poses differ; splits, by their names, each with "
        "train, held_out and, of a split by a parameter, its rule; variables, the values of each trajectory of a "
        "scene, by ids.");
    m.def("is_dataset", &is_dataset_view, py::arg("path"), UsesFiles(),
          "Whether the file is a dataset, a recording in shards with a manifest.");
    m.def(
        "check_file",
        [](const path& file, const std::optional<path>& body) {
            return check_file(file, body.value_or(path()));
        },
        py::arg("path"), py::arg("body") = py::none(), UsesFiles(),
        "Checks a file as `nbdtree inspect --check` does and returns one line. "
        "body: the file of the body that it must belong to. Raises RuntimeError, one line, on a defect.");
}

}  // namespace nbd::python
