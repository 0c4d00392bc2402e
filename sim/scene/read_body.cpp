#include <fmt/format.h>

#include "meshing/body/material.hpp"
#include "sim/scene/length_unit.hpp"
#include "sim/scene/read_parts.hpp"

namespace nbd {
namespace {

SceneGrip read_grip(JsonObject& from) {
    SceneGrip grip{.key = key_of(from), .region = {}, .grip = {}};
    if (from.need("region")) grip.region = read_region(from.object("region"));
    grip.grip = read_held_motion(from);
    from.finish();
    return grip;
}

/// Of a region, which has no damping of its own.
MaterialChange read_elasticity(JsonObject& from) {
    MaterialChange material;
    std::vector<std::string> laws;
    for (const MaterialLaw law : material_laws) laws.emplace_back(name(law));
    material.law = material_law(from.choice("law", "", laws));
    material.young = from.optional_number("young", positive_number);
    material.poisson =
        from.optional_number("poisson", {least_poisson, max_poisson, "between -0.999 and 0.4999"});
    material.density = from.optional_number("density", positive_number);
    return material;
}

MaterialChange read_material(JsonObject from) {
    MaterialChange material = read_elasticity(from);
    material.rayleigh_mass = from.optional_number("rayleigh_mass", not_negative);
    material.rayleigh_stiffness = from.optional_number("rayleigh_stiffness", not_negative);
    from.finish();
    return material;
}

SceneMaterialRegion read_material_region(JsonObject& from) {
    SceneMaterialRegion region{.key = key_of(from), .where = {}, .material = {}};
    const std::string kind = from.need_one({"group", "region"});
    if (kind == "group") {
        const std::string name = from.text("group", "");
        if (name.empty()) from.problem("group", "must be the name of a group");
        region.where.part = NamedGroup{name};
    }
    if (kind == "region") region.where = read_region(from.object("region"));
    JsonObject material = from.object("material");
    region.material = read_elasticity(material);
    material.finish();
    from.finish();
    return region;
}

SceneMeshing read_meshing(JsonObject from, BodySource source) {
    SceneMeshing meshing;
    meshing.tets.nodes = from.integer("nodes", 0, {0, 1e8, "between 0 and 100000000"});
    meshing.tets.grading = from.number("grading", meshing.tets.grading, {0, 2, "between 0 and 2"});
    meshing.edge = from.number("edge", meshing.edge, not_negative);
    meshing.error = from.optional_number("error", {1e-4, 0.5, "between 0.0001 and 0.5"}).value_or(0);
    for (const char* key : {"nodes", "edge", "elements"})
        if (meshing.error > 0 && from.has(key)) from.problem(key, "must not be beside \"error\"");
    if (meshing.edge > 0 && meshing.tets.nodes > 0) from.problem("nodes", "must not be beside \"edge\"");
    const std::string elements = from.choice("elements", "linear", {"linear", "quadratic", "rigid"});
    meshing.rigid = elements == "rigid";
    if (from.has("elements") && !meshing.rigid)
        meshing.elements = elements == "linear" ? Elements::linear : Elements::quadratic;
    meshing.scale = from.number("scale", meshing.scale, positive_number) *
                    metres_in(from.choice("units", "m", length_unit_names()));
    meshing.stretch = from.vector("stretch", meshing.stretch);
    if (!(meshing.stretch.minCoeff() >= least_constant && meshing.stretch.maxCoeff() <= max_constant))
        from.problem("stretch", "must be three numbers between 1e-30 and 1e30");
    meshing.weld = from.number("weld", meshing.weld, not_negative);
    meshing.levels = from.integer("subdivide", 0, {0, 4, "between 0 and 4"});
    if (from.choice("subdivision", "midpoint", {"midpoint", "loop"}) == "loop")
        meshing.scheme = SubdivisionScheme::loop;
    if (source == BodySource::tets)
        for (const char* key : {"edge", "error", "nodes", "grading", "weld"})
            if (from.has(key))
                from.problem(key, "applies to surfaces only; given tetrahedra are not remeshed");
    for (const char* key : {"edge", "error", "nodes", "grading"})
        if (meshing.rigid && from.has(key))
            from.problem(key, "is not for rigid bodies, which have four nodes");
    from.finish();
    return meshing;
}

void read_source(JsonObject& from, const std::filesystem::path& base, SceneBody& body) {
    const std::string kind = from.need_one({"body", "surface", "tets"});
    body.source = kind == "surface" ? BodySource::surface
                  : kind == "tets"  ? BodySource::tets
                                    : BodySource::body;
    if (!kind.empty()) body.file = read_path(from, kind, base);
    body.meshing = read_meshing(from.object("meshing"), body.source);
    if (kind == "body" && from.has("meshing"))
        from.problem("meshing", "applies to surfaces and tetrahedra only; a body file is used unchanged");
}

void read_bounds(JsonObject& from, const std::filesystem::path& base, SceneBody& body) {
    body.tree = read_path(from, "tree", base);
    body.bounds = bound_kind(from.choice("bounds", "auto",
                                         {"exact", "boxes", "bd", "nbd", "learned_affine", "affine", "auto"},
                                         instead_of_bound));
    body.margin = from.optional_number("margin", {0, 10, "between 0 and 10"});
    if (!can_miss(body.bounds)) return;
    if (!from.has("tree"))
        from.problem("tree",
                     fmt::format("is missing: bounds \"{}\" are learned or precomputed and need a tree file",
                                 name(body.bounds)));
    if (body.placement.scale != 1)
        from.problem("transform.scale",
                     "must be 1 unless bounds are \"auto\", \"affine\", \"boxes\" or \"exact\"");
}

std::optional<RigidInertia> read_inertia(JsonObject from) {
    from.need("mass");
    RigidInertia inertia{.mass = from.optional_number("mass", positive_number).value_or(1)};
    if (from.has("centre")) inertia.centre = from.vector("centre", Eigen::Vector3d::Zero());
    const Eigen::Vector3d moments = from.vector("moments", Eigen::Vector3d::Zero()),
                          products = from.vector("products", Eigen::Vector3d::Zero());
    if (from.has("products")) from.need("moments");
    if (from.has("moments")) {
        inertia.moments.emplace(moments.asDiagonal());
        for (int k = 0; k < 3; ++k) {
            const int a = k < 2 ? 0 : 1, b = k == 0 ? 1 : 2;
            (*inertia.moments)(a, b) = (*inertia.moments)(b, a) = products[k];
        }
    }
    from.finish();
    return inertia;
}

}  // namespace

SceneBody read_body(JsonObject& from, const std::filesystem::path& base) {
    SceneBody body;
    from.integer("count", 1, {0, 1000, "between 0 and 1000"});
    if (from.has("count"))
        from.problem("count", "is for scenes with \"variables\", in whose copies they differ");
    read_source(from, base, body);
    body.name = from.text("name", "");
    if (body.name.empty()) body.name = body.file.stem().string();
    body.placement = read_placement(from.object("transform"));
    read_bounds(from, base, body);
    body.velocity = from.vector("velocity", body.velocity);
    body.angular_velocity = from.vector("angular_velocity", body.angular_velocity);
    body.material = read_material(from.object("material"));
    if (from.has("inertia")) {
        body.inertia = read_inertia(from.object("inertia"));
        if (body.material.density)
            from.problem("material.density", "must not be beside \"inertia\", which gives the mass");
    }
    for (JsonObject& region : from.objects("regions")) body.regions.push_back(read_material_region(region));
    for (JsonObject& pin : from.objects("pins")) {
        SceneGrip held{.key = key_of(pin), .region = {}, .grip = {}};
        held.region = read_region(std::move(pin));
        body.grips.push_back(std::move(held));
    }
    for (JsonObject& grip : from.objects("grips")) body.grips.push_back(read_grip(grip));
    for (JsonObject& load : from.objects("loads")) body.loads.push_back(read_load(load));
    for (JsonObject& muscle : from.objects("muscles")) body.loads.push_back(read_muscle(muscle));
    for (JsonObject& part : from.objects("friction")) body.friction.push_back(read_surface_friction(part));
    from.finish();
    return body;
}

}  // namespace nbd
