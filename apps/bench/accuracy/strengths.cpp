#include "apps/bench/accuracy/strengths.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "apps/dataset/variety.hpp"
#include "training/files/dataset_manifest.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {

StrengthSet measure_strength(const std::filesystem::path& tree, const std::filesystem::path& data,
                             std::span<const BoundKind> bounds) {
    if (!is_dataset_view(data))
        throw std::runtime_error(fmt::format(
            "{}: is not a dataset; allowed: a file that nbdtree dataset has written", data.string()));
    const DatasetManifest manifest = read_dataset_manifest(data);
    const Variety variety = variety_from_json(manifest.variety);
    if (variety.stretch.empty())
        throw std::runtime_error(fmt::format(
            "{}: has no frames to measure; allowed: a dataset with complete trajectories", data.string()));
    const nlohmann::json plan = nlohmann::json::parse(manifest.plan);
    return {.name = tree.stem().string(),
            .seed = plan.at("seed").get<std::uint64_t>(),
            .strength = plan.at("recipe").at("strength").get<double>(),
            .displacement = variety.displacement / variety.body_length,
            .stretch_low = variety.stretch.front(),
            .stretch_high = variety.stretch.back(),
            .least_stretch = variety.least_stretch,
            .largest_stretch = variety.largest_stretch,
            .accuracy = measure_accuracy(load_tree(tree), RecordingReader(data), bounds)};
}

std::string to_csv(const std::vector<StrengthSet>& sets) {
    std::string text = fmt::format(
        "tree,seed,strength,displacement,stretch_1_percent,stretch_99_percent,least_stretch,largest_stretch,{"
        "}\n",
        extents_columns);
    for (const StrengthSet& set : sets)
        for (const AccuracyExtents& extents : over_depths(set.accuracy))
            text += fmt::format("{},{},{:g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{}\n", set.name, set.seed,
                                set.strength, set.displacement, set.stretch_low, set.stretch_high,
                                set.least_stretch, set.largest_stretch, extents_cells(extents));
    return text;
}

}  // namespace nbd
