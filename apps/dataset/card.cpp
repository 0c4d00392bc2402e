#include "apps/dataset/card.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/dataset/variety.hpp"
#include "meshing/h5/atomic_file.hpp"

namespace nbd {
namespace {

/// What the file holds of each frame besides positions; empty if nothing.
std::string extras_text(const nlohmann::ordered_json& plan) {
    std::string text;
    if (!plan.contains("extras")) return text;
    for (const auto& extra : plan["extras"])
        text += fmt::format("{}`{}`", text.empty() ? "" : ", ", extra.get<std::string>());
    return fmt::format("Frames also have {}.\n\n", text);
}

/// A further split, by a parameter of the recipes.
std::string split_text(const DatasetSplit& split) {
    const nlohmann::ordered_json rule = nlohmann::ordered_json::parse(split.rule);
    const std::string parameter = rule.at("parameter").get<std::string>();
    std::string limits;
    if (rule.contains("names")) {
        limits = fmt::format("is one of {}", rule["names"].dump());
    } else {
        if (!rule.at("from").is_null()) limits = fmt::format("is at least {}", rule["from"].dump());
        if (!rule.at("to").is_null())
            limits += fmt::format("{} at most {}", limits.empty() ? "is" : " and", rule["to"].dump());
    }
    return fmt::format(
        "A second split is by a parameter of the recipes (`{}`, `dataset/splits/{}` in the file): {} are held out, "
        "whose `{}` {}; {} are to train on and have none of these.\n\n",
        rule.at("rule").get<std::string>(), split.name, split.held_out.size(), parameter, limits,
        split.train.size());
}

std::string splits_text(const DatasetManifest& manifest) {
    std::string text = fmt::format(
        "## Split\n\nWhole trajectories are divided, drawn from the seed: {} are to train on, {} are held out "
        "(`dataset/split` in the file).\n"
        "Frames of one trajectory are alike; a split by frames would leak.\n\n",
        manifest.train_trajectories.size(), manifest.held_out_trajectories.size());
    for (const DatasetSplit& split : manifest.splits) text += split_text(split);
    return text;
}

}  // namespace

std::string dataset_card(const std::string& name, const Body& body, const std::string& body_file,
                         const std::string& licence, const DatasetManifest& manifest) {
    const nlohmann::ordered_json plan = nlohmann::ordered_json::parse(manifest.plan);
    std::string text = fmt::format(
        "# {}\n\nThis dataset holds poses of a deformable body, which {} simulated: trajectories of the "
        "positions of its tet nodes (float32, metres).\n\n",
        name, plan.at("program").get<std::string>());
    text += fmt::format(
        "- Body: `{}`, {} nodes, {} tetrahedra, {} surface faces, SHA-256 `{}`; "
        "material {}, Young's modulus {} Pa.\n",
        body_file, body.tets.X.rows(), body.tets.T.rows(), body.surface.F.rows(),
        plan.at("body_sha256").get<std::string>(), plan.at("material").at("law").get<std::string>(),
        plan.at("material").at("young").dump());
    text += fmt::format("- Licence: {}\n\n",
                        licence.empty() ? "not stated (`--licence` of `nbdtree dataset`)" : licence);
    text += fmt::format(
        "## What it holds\n\nFrames count complete trajectories. Troubled frames follow steps that went "
        "wrong.\n\n```text\n{}\n```\n\n",
        to_text(variety_from_json(manifest.variety)));
    text += extras_text(plan);
    text += splits_text(manifest);
    text += fmt::format(
        "## How it was made\n\nTrajectory i depends on the seed {} and on i alone. "
        "`dataset/plan` in the file is the whole plan:\n\n```json\n{}\n```\n\n",
        plan.at("seed").dump(), plan.dump(2));
    text += fmt::format(
        "## How to read it\n\n```python\nimport nbdtree.torch\n"
        "data = nbdtree.torch.Dataset(\"{}\", \"{}\", window=3)\n"
        "x = data[0][\"x\"]   # [3 frames, nodes, 3]\n```\n\n"
        "Any reader of HDF5 finds `trajectories/000000/positions` [frames, nodes, 3] and `times` in seconds. "
        "Keep the file beside its folder of shards.\n",
        name, body_file);
    return text;
}

void write_card(const ShardFolder& folder, const Body& body, const std::string& body_file,
                const std::string& licence) {
    h5::AtomicFile page(folder.card());
    page.out() << dataset_card(folder.view().filename().string(), body, body_file, licence,
                               read_dataset_manifest(folder.view()));
    page.commit();
}

}  // namespace nbd
