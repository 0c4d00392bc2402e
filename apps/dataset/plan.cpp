#include "apps/dataset/plan.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "apps/dataset/scene_trajectories.hpp"
#include "collision/base/file_text.hpp"
#include "collision/base/shortened.hpp"
#include "meshing/h5/atomic_file.hpp"
#include "meshing/h5/sha256.hpp"
#include "meshing/h5/version.hpp"
#include "sim/json/json_object.hpp"
#include "training/files/dataset_manifest.hpp"
#include "training/files/recording_format.hpp"

namespace nbd {
namespace {

nlohmann::ordered_json to_json(const Material& material) {
    return {{"law", name(material.law)},
            {"young", material.young},
            {"poisson", material.poisson},
            {"density", material.density},
            {"rayleigh_mass", material.rayleigh_mass},
            {"rayleigh_stiffness", material.rayleigh_stiffness}};
}

std::string shown(const nlohmann::json& flat, const std::string& key) {
    if (!flat.contains(key)) return "none";
    return shortened(flat[key].dump(), 40);
}

}  // namespace

std::string plan_json(const DatasetPlan& plan, const Body& body) {
    const ExcitationConfig& excitation = plan.excitation;
    nlohmann::ordered_json json;
    json["program"] = "nbdtree " + std::string(version());
    json["body_sha256"] = body_hash(body);
    json["material"] = to_json(body.material);
    for (const MaterialRegion& region : body.regions) {
        json["regions"][region.name] = to_json(region.material);
        h5::Sha256 hash;
        hash.add(std::as_bytes(std::span(region.tets)));
        json["regions"][region.name]["tets_sha256"] = hash.hex();
    }
    json["seed"] = excitation.seed;
    json["trajectories"] = plan.trajectories;
    if (plan.scene) {
        plan.scene->add_to_plan(json);
    } else {
        json["frames"] = excitation.frames;
        json["frame_interval"] = excitation.frame_interval;
        json["steps_per_frame"] = excitation.steps_per_frame;
    }
    json["contact"] = "barrier";
    json["solver"] = "iterative";
    json["attempts"] = plan.attempts;
    json["held_out"] = plan.held_out_share;
    json["per_shard"] = plan.per_shard;
    // Only where they are asked for: a dataset without them keeps the plan, and so the key, of older ones.
    if (!plan.hold_out.empty()) json["hold_out"] = plan.hold_out;
    for (const FrameFieldName& field : frame_fields)
        if (plan.extras.fields[field.field]) json["extras"].push_back(field.name);
    if (plan.extras.contact_edges) json["extras"].push_back(contact_edges_name);
    if (!plan.scene) json["recipe"] = nlohmann::ordered_json::parse(to_json(excitation.ranges));
    return json.dump(2) + "\n";
}

void check_trajectories(const DatasetPlan& plan, const Body& body) {
    if (plan.scene) return;  // it has checked them
    const LocalThickness thickness(body.tets);
    check_excitation_config(plan.excitation);
    check_duration(plan.excitation, natural_scales(body, thickness));
}

std::string plan_key(const std::string& plan) {
    h5::Sha256 hash;
    hash.add(std::as_bytes(std::span(plan)));
    return hash.hex();
}

std::string plan_difference(const std::string& there, const std::string& wanted) {
    const nlohmann::json a = parse_json(there).flatten(), b = parse_json(wanted).flatten();
    for (const auto* keys : {&b, &a})
        for (const auto& [key, value] : keys->items()) {
            if (a.contains(key) && b.contains(key) && a[key] == b[key]) continue;
            std::string name = key.substr(1);
            for (char& c : name)
                if (c == '/') c = '.';
            return fmt::format("{} {}, not {}", name, shown(a, key), shown(b, key));
        }
    return {};
}

void begin_dataset(const ShardFolder& folder, const std::string& plan) {
    const auto refuse_other = [&](const std::string& there) {
        const std::string difference = plan_difference(there, plan);
        if (!difference.empty())
            throw std::runtime_error(
                fmt::format("{}: was started with {}; allowed: the same options, or another name",
                            folder.view().string(), difference));
    };
    if (folder.path() == folder.view())
        throw std::runtime_error(
            fmt::format("{}: this is the name of the folder for the frames; allowed: another extension",
                        folder.view().string()));
    if (std::filesystem::exists(folder.plan())) {
        try {
            refuse_other(file_text(folder.plan()));
        } catch (const std::invalid_argument& error) {
            throw std::runtime_error(fmt::format("{}: {}", folder.plan().string(), error.what()));
        }
        return;
    }
    if (is_dataset_view(folder.view()))
        refuse_other(read_dataset_manifest(folder.view()).plan);
    else if (std::filesystem::exists(folder.view()))
        throw std::runtime_error(fmt::format(
            "{}: already exists and is not a dataset that can be continued; allowed: another name",
            folder.view().string()));
    std::error_code error;
    std::filesystem::create_directories(folder.path(), error);
    if (error)
        throw std::runtime_error(
            fmt::format("{}: cannot create this folder: {}", folder.path().string(), error.message()));
    h5::AtomicFile file(folder.plan());
    file.out() << plan;
    file.commit();
}

}  // namespace nbd
