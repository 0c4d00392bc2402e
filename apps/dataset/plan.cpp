#include "apps/dataset/plan.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "collision/base/shortened.hpp"
#include "meshing/h5/sha256.hpp"
#include "meshing/h5/version.hpp"
#include "sim/json/json_object.hpp"
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
    json["frames"] = excitation.frames;
    json["frame_interval"] = excitation.frame_interval;
    json["steps_per_frame"] = excitation.steps_per_frame;
    json["self_contact"] = excitation.self_contact;
    json["intersection_free"] = excitation.intersection_free;
    json["solver"] = excitation.linear.solver == LinearSolver::iterative ? "iterative" : "direct";
    json["attempts"] = plan.attempts;
    json["held_out"] = plan.held_out_share;
    json["per_shard"] = plan.per_shard;
    // Only where they are asked for: a dataset without them keeps the plan, and so the key, of older ones.
    if (!plan.hold_out.empty()) json["hold_out"] = plan.hold_out;
    for (const FrameFieldName& field : frame_fields)
        if (plan.extras.fields[field.field]) json["extras"].push_back(field.name);
    if (plan.extras.contact_edges) json["extras"].push_back(contact_edges_name);
    json["recipe"] = nlohmann::ordered_json::parse(to_json(excitation.ranges));
    return json.dump(2) + "\n";
}

void check_trajectories(const DatasetPlan& plan, const Body& body) {
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

}  // namespace nbd
