#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "apps/cli/output_paths.hpp"
#include "apps/dataset/scene_trajectories.hpp"
#include "apps/python/bindings/arrays.hpp"
#include "apps/python/bindings/bindings.hpp"
#include "apps/python/bindings/json_text.hpp"
#include "apps/python/bindings/make_dataset.hpp"
#include "apps/python/bindings/typed.hpp"
#include "collision/base/file_text.hpp"
#include "sim/scene/scene_template.hpp"

namespace nbd::python {
namespace {

using std::filesystem::path;
using SceneArgument = Typed<"Union[Path, Mapping[str, Any]]">;

/// A scene with variables: a dictionary, or the file at a path. folder: of relative paths in a dictionary;
/// None: the current one.
SceneTemplate template_from(py::handle scene, py::handle folder) {
    if (!py::hasattr(scene, "keys")) return load_template(path_from(scene, "scene"));
    const path base = folder.is_none() ? std::filesystem::current_path() : path_from(folder, "folder");
    std::vector<std::string> problems;
    SceneTemplate result(json_text(scene), base, problems);
    if (!problems.empty()) throw std::invalid_argument(problems.front());
    return result;
}

Typed<"dict[str, Any]"> draw_scene(const SceneArgument& scene, int trajectory, std::uint64_t seed,
                                   const Typed<"Optional[Mapping[str, Any]]">& values) {
    if (trajectory < 0)
        throw std::invalid_argument(fmt::format("trajectory: is {}; allowed: 0 or more", trajectory));
    const SceneTemplate drawn = template_from(scene, py::none());
    const py::object json = py::module_::import("json");
    SceneValues all = drawn.draw(seed, trajectory);
    if (!values.is_none()) {
        std::vector<std::string> settings;
        for (const auto& [name, value] : py::dict(values))
            settings.push_back(name.cast<std::string>() + "=" +
                               json.attr("dumps")(value).cast<std::string>());
        set_values(drawn, settings, all);
    }
    return json.attr("loads")(drawn.text_with(all));
}

Body make_scene_dataset(const SceneArgument& scene, const path& file, const std::string& record,
                        int trajectories, std::optional<int> frames, std::uint64_t seed, double held_out,
                        int per_shard, const std::string& licence, const std::string& hold_out,
                        bool contact_forces, bool stress, bool deformation_gradients,
                        const Typed<"Optional[Path]">& folder, const ProgressFunction& function) {
    DatasetPlan plan = plan_of(
        {trajectories, per_shard, frames, held_out, hold_out, contact_forces, stress, deformation_gradients});
    plan.excitation.seed = seed;
    check_output(file, {});
    SceneTemplate drawn = template_from(scene, folder);
    make_files("make_scene_dataset", file, function, [&](Stoppable& stoppable, Progress& progress) {
        {
            const FileCall call;
            plan.scene = std::make_shared<const SceneTrajectories>(
                std::move(drawn), SceneDataset{.body = record, .frames = frames, .seed = seed});
        }
        plan.excitation.frames = plan.scene->frames();
        produce(plan.scene->body(), plan, file, "", licence, stoppable, progress);
    });
    return plan.scene->body();
}

}  // namespace

void bind_templates(py::module_& m) {
    const DatasetPlan defaults;
    m.def(
        "draw_scene", &draw_scene, py::arg("scene"), py::arg("trajectory") = 0, py::kw_only(),
        py::arg("seed") = defaults.excitation.seed, py::arg("values") = py::none(),
        "The scene that a scene with variables, a file or a dictionary, is with the values of a trajectory, for "
        "World(scene, folder). values: instead of drawn ones, by names of variables.");
    m.def(
        "make_scene_dataset", &make_scene_dataset, py::arg("scene"), py::arg("path"), py::kw_only(),
        py::arg("record") = "", py::arg("trajectories") = defaults.trajectories,
        py::arg("frames") = py::none(), py::arg("seed") = defaults.excitation.seed,
        py::arg("held_out") = defaults.held_out_share, py::arg("per_shard") = defaults.per_shard,
        py::arg("licence") = "", py::arg("hold_out") = "", py::arg("contact_forces") = false,
        py::arg("stress") = false, py::arg("deformation_gradients") = false, py::arg("folder") = py::none(),
        py::arg("progress") = py::none(),
        "Simulates trajectories that are drawn from a scene with variables, as `nbdtree dataset SCENE` does, with "
        "the same bits, and returns the body whose poses it records. scene: a file or a dictionary, whose paths "
        "are relative to `folder`. record: name of the body; of several with the name, each in its turn. frames: "
        "instead of the scene's. hold_out: as in make_dataset, with variables.NAME for a variable.");
}

}  // namespace nbd::python
