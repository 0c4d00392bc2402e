// What bodies of a scene are made of.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "meshing/body/rigid_body.hpp"
#include "sim/scene/build_world.hpp"

namespace nbd {
namespace {

/// Takes the tetrahedra from their regions and makes them a region of this material.
void cut_out(BodyMaterials& materials, const SceneMaterialRegion& change, Material material,
             std::vector<int> tets) {
    if (tets.empty())
        throw std::invalid_argument(
            fmt::format("{}: the region holds no centre of a tetrahedron of the body", change.key));
    for (MaterialRegion& region : materials.regions)
        std::erase_if(region.tets, [&](int t) { return std::ranges::binary_search(tets, t); });
    change.material.apply(material);
    materials.regions.push_back(
        {.name = "scene: " + change.key, .material = material, .tets = std::move(tets)});
}

/// A body's tetrahedra at its size in the scene.
TetMesh sized_tets(const SceneBody& spec, const Body& body) {
    TetMesh tets = body.tets;
    tets.X *= spec.placement.scale;
    return tets;
}

/// A rigid body has a density or an inertia, and no other constant.
BodyMaterials rigid_materials(const SceneBody& spec, const Body& body) {
    const MaterialChange& m = spec.material;
    if (m.young || m.poisson || m.law || m.rayleigh_mass || m.rayleigh_stiffness)
        throw std::invalid_argument("material: of a rigid body only \"density\" can be set");
    if (!spec.regions.empty()) throw std::invalid_argument("regions: a rigid body has none");
    TetMesh tets = sized_tets(spec, body);
    double density = m.density.value_or(body.material.density);
    std::optional<RigidInertia> inertia = spec.inertia;
    if (inertia) {
        if (inertia->centre) *inertia->centre = spec.placement.scale * (*inertia->centre - body.origin);
        try {
            density = set_inertia(tets, *inertia);
            check_material({.density = density});
        } catch (const std::invalid_argument& error) {
            throw std::invalid_argument(fmt::format("inertia: {}", error.what()));
        }
    }
    return {.material = rigid_material(tets, density), .regions = {}, .inertia = std::move(inertia)};
}

}  // namespace

Nodes placed(const Nodes& X, const Placement& placement) {
    return (placement.scale * X * placement.rotation().transpose()).rowwise() +
           placement.translate.transpose();
}

BodyMaterials scene_materials(const SceneBody& spec, const LoadedBody& loaded) {
    const Body& body = *loaded.body;
    if (is_rigid(body.tets)) return rigid_materials(spec, body);
    if (spec.inertia)
        throw std::invalid_argument(
            "inertia: only a rigid body is told its own; set \"density\" in \"material\"");
    BodyMaterials result{.material = body.material, .regions = body.regions};
    spec.material.apply(result.material);
    for (MaterialRegion& region : result.regions) {
        if (region.material == body.material) region.material = result.material;
        region.material.rayleigh_mass = result.material.rayleigh_mass;
        region.material.rayleigh_stiffness = result.material.rayleigh_stiffness;
    }
    const std::vector<MaterialRegion> groups = result.regions;
    const Nodes x = placed(body.tets.X, spec.placement);
    for (const SceneMaterialRegion& change : spec.regions) {
        std::vector<int> tets = parts_in(change.key, change.where, BodyPart::tet, {body, x});
        const auto* named = std::get_if<NamedGroup>(&change.where.part);
        const Material& material =
            named ? std::ranges::find(groups, named->name, &MaterialRegion::name)->material : result.material;
        cut_out(result, change, material, std::move(tets));
    }
    std::erase_if(result.regions, [](const MaterialRegion& region) { return region.tets.empty(); });
    return result;
}

std::shared_ptr<const ElasticBody> scene_elastic(const SceneBody& spec, const LoadedBody& loaded,
                                                 const BodyMaterials& materials) {
    TetMesh tets = sized_tets(spec, *loaded.body);
    if (materials.inertia) set_inertia(tets, *materials.inertia);
    return std::make_shared<const ElasticBody>(std::move(tets), materials.material, materials.regions);
}

}  // namespace nbd
