#include <fmt/format.h>

#include "sim/scene/read_parts.hpp"

namespace nbd {
namespace {

Eigen::AlignedBox3d read_box(JsonObject from) {
    const Eigen::AlignedBox3d box(from.vector("min", Eigen::Vector3d::Zero()),
                                  from.vector("max", Eigen::Vector3d::Zero()));
    if (from.need("min") && from.need("max") && box.isEmpty())
        from.problem("max", "must not be below \"min\"");
    from.finish();
    return box;
}

CapsuleShape read_capsule(JsonObject from) {
    CapsuleShape capsule;
    const auto point = [&](const char* key) {
        from.need(key);
        return from.vector(key, Eigen::Vector3d::Zero());
    };
    capsule.from = point("from");
    capsule.to = point("to");
    if (from.need("radius")) capsule.radius = from.optional_number("radius", positive_number).value_or(1);
    from.finish();
    return capsule;
}

NearSurface read_near(JsonObject from) {
    NearSurface near{.key = from.path(""), .body = {}, .obstacle = {}};
    const std::string kind = from.need_one({"body", "obstacle"});
    near.body = from.text("body", "");
    near.obstacle = from.text("obstacle", "");
    if (!kind.empty() && near.body.empty() && near.obstacle.empty()) from.problem(kind, "must be a name");
    if (from.need("distance")) near.distance = from.optional_number("distance", positive_number).value_or(1);
    from.finish();
    return near;
}

std::vector<int> read_rows(JsonObject& from, const std::string& key) {
    constexpr int most = 1 << 30;
    const nlohmann::json& list = *from.raw(key, "array");
    std::vector<int> rows;
    if (list.is_array())
        for (const nlohmann::json& row : list)
            if (row.is_number_integer() && row >= 0 && row <= most) rows.push_back(row.get<int>());
    if (!list.is_array() || list.empty() || rows.size() != list.size())
        from.problem(key, "must be a list of whole numbers from 0 on, not empty");
    return rows;
}

/// How deep regions may be made of regions.
constexpr int deepest_region = 8;

Region read_part(JsonObject from, int depth);

/// depth: in how many others the regions are that it is made of.
Region read_combination(JsonObject& from, const std::string& kind, int depth) {
    if (depth > deepest_region) {
        from.problem(kind, fmt::format("regions are made of regions {} deep here; allowed: {} at most", depth,
                                       deepest_region));
        return {};
    }
    if (kind == "not") return {.part = Combination::none, .of = {read_part(from.object(kind), depth)}};
    Region region{.part = kind == "all" ? Combination::all : Combination::any};
    for (JsonObject& one : from.objects(kind)) region.of.push_back(read_part(std::move(one), depth));
    if (region.of.empty()) from.problem(kind, "must be a list of regions, not empty");
    return region;
}

void add_with_parts(Region& region, std::vector<Region*>& all) {
    all.push_back(&region);
    for (Region& one : region.of) add_with_parts(one, all);
}

/// depth: in how many others it is.
Region read_part(JsonObject from, int depth) {
    const std::string kind =
        from.need_one({"box", "sphere", "capsule", "near", "group", "nodes", "faces", "all", "any", "not"});
    Region region;
    if (kind == "box") region.part = read_box(from.object("box"));
    if (kind == "sphere") region.part = read_ball(from.object("sphere"));
    if (kind == "capsule") region.part = read_capsule(from.object("capsule"));
    if (kind == "near") region.part = read_near(from.object("near"));
    if (kind == "group") {
        region.part = NamedGroup{from.text("group", "")};
        if (std::get<NamedGroup>(region.part).name.empty())
            from.problem("group", "must be the name of a group");
    }
    if (kind == "nodes") region.part = NodeList{read_rows(from, "nodes")};
    if (kind == "faces") region.part = FaceList{read_rows(from, "faces")};
    if (kind == "all" || kind == "any" || kind == "not") region = read_combination(from, kind, depth + 1);
    from.finish();
    return region;
}

}  // namespace

Region read_region(JsonObject from) { return read_part(std::move(from), 0); }

std::vector<Region*> regions_of(SceneSpec& spec) {
    std::vector<Region*> all;
    for (SceneBody& body : spec.bodies) {
        for (SceneMaterialRegion& one : body.regions) add_with_parts(one.where, all);
        for (SceneGrip& grip : body.grips) add_with_parts(grip.region, all);
        for (SceneLoad& load : body.loads)
            if (load.region) add_with_parts(*load.region, all);
        for (SceneFriction& part : body.friction)
            if (part.region) add_with_parts(*part.region, all);
    }
    for (SceneJoint& joint : spec.joints)
        if (joint.region) add_with_parts(*joint.region, all);
    return all;
}

void check_regions(const JsonObject& top, SceneSpec& spec) {
    const SceneNames names(spec);
    for (const Region* region : regions_of(spec)) {
        const auto* near = std::get_if<NearSurface>(&region->part);
        if (near && !near->body.empty()) names.body(top, near->key + ".body", near->body);
        if (near && !near->obstacle.empty()) names.obstacle(top, near->key + ".obstacle", near->obstacle);
    }
}

}  // namespace nbd
