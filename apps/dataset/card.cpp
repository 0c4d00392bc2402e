#include "apps/dataset/card.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "apps/dataset/variety.hpp"
#include "meshing/h5/atomic_file.hpp"

namespace nbd {
namespace {

std::string kinds_table(const Variety& variety) {
    std::string table =
        "| kind | trajectories | failed | frames | in contact | of steps that went wrong | that "
        "intersect themselves |\n| --- | --- | --- | --- | --- | --- | --- |\n";
    const auto row = [&](const std::string& name, const KindVariety& kind) {
        table += fmt::format("| {} | {} | {} | {} | {} | {} | {} |\n", name, kind.trajectories, kind.failed,
                             kind.frames, kind.frames_in_contact, kind.frames_troubled,
                             kind.frames_self_intersecting);
    };
    for (const auto& [name, kind] : variety.kinds) row("`" + name + "`", kind);
    KindVariety all = variety.all;
    all.trajectories = all.failed = 0;
    for (const auto& [name, kind] : variety.kinds) {
        all.trajectories += kind.trajectories;
        all.failed += kind.failed;
    }
    row("all", all);
    return table;
}

std::string stretches(const Variety& variety) {
    std::string text;
    for (std::size_t i = 0; i < variety.stretch.size() && i < variety_quantiles.size(); ++i)
        text += fmt::format("{}{:.3f} ({:.0f} %)", i == 0 ? "" : ", ", variety.stretch[i],
                            100 * variety_quantiles[i]);
    return text;
}

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
        "By a parameter of the recipes (`{}`, `dataset/splits/{}` in the file): {} are held out, "
        "whose `{}` {}; {} to train on have none of these.\n"
        "\n",
        rule.at("rule").get<std::string>(), split.name, split.held_out.size(), parameter, limits,
        split.train.size());
}

std::string splits_text(const DatasetManifest& manifest) {
    std::string text = fmt::format(
        "## Split\n\nBy whole trajectories, drawn from the seed: {} to train on, {} held out "
        "(`dataset/split` in the file).\n"
        "Frames of one trajectory are alike; a split by frames would leak.\n\n",
        manifest.train_trajectories.size(), manifest.held_out_trajectories.size());
    for (const DatasetSplit& split : manifest.splits) text += split_text(split);
    return text;
}

}  // namespace

std::string dataset_card(const CardFacts& facts, const DatasetManifest& manifest) {
    const nlohmann::ordered_json plan = nlohmann::ordered_json::parse(manifest.plan);
    const Variety variety = variety_from_json(manifest.variety);
    std::string text = fmt::format(
        "# {}\n\nPoses of a deformable body, simulated by {} as trajectories of tet-node positions (float32, "
        "metres).\n\n",
        facts.name, plan.at("program").get<std::string>());
    text += fmt::format(
        "- Body: `{}`, {} nodes, {} tetrahedra, {} surface faces, SHA-256 `{}`; "
        "material {}, Young's modulus {} Pa.\n",
        facts.body, facts.nodes, facts.tets, facts.faces, plan.at("body_sha256").get<std::string>(),
        plan.at("material").at("law").get<std::string>(), plan.at("material").at("young").dump());
    text +=
        fmt::format("- Licence: {}\n\n## What it holds\n\n",
                    facts.licence.empty() ? "not stated (`--licence` of `nbdtree dataset`)" : facts.licence);
    text += kinds_table(variety);
    text += fmt::format(
        "\nFrames count complete trajectories. Principal stretches of elements, quantiles: {}; "
        "extremes {:.3f} and {:.3f}. Root mean square displacement without rigid motion: "
        "{:.3g} m, {:.1f} % of the body.\n\n",
        stretches(variety), variety.least_stretch, variety.largest_stretch, variety.displacement,
        100 * variety.displacement / variety.body_length);
    text += extras_text(plan);
    text += splits_text(manifest);
    text += fmt::format(
        "## How it was made\n\nTrajectory i depends on the seed {} and on i alone. "
        "The whole plan, `dataset/plan` in the file:\n\n```json\n{}\n```\n\n",
        plan.at("seed").dump(), plan.dump(2));
    text += fmt::format(
        "## How to read it\n\n```python\nimport nbdtree.torch\n"
        "data = nbdtree.torch.Dataset(\"{}\", \"{}\", window=3)\n"
        "x = data[0][\"x\"]   # [3 frames, nodes, 3]\n```\n\n"
        "Or any reader of HDF5: `trajectories/000000/positions` [frames, nodes, 3], `times` in seconds. "
        "Keep the file beside its folder of shards.\n",
        facts.name, facts.body);
    return text;
}

void write_card(const ShardFolder& folder, const Body& body, const std::string& body_file,
                const std::string& licence) {
    const CardFacts facts{.name = folder.view().filename().string(),
                          .body = body_file,
                          .nodes = static_cast<int>(body.tets.X.rows()),
                          .tets = static_cast<int>(body.tets.T.rows()),
                          .faces = static_cast<int>(body.surface.F.rows()),
                          .licence = licence};
    h5::AtomicFile page(folder.card());
    page.out() << dataset_card(facts, read_dataset_manifest(folder.view()));
    page.commit();
}

}  // namespace nbd
