#include "meshing/body/material.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

namespace nbd {

std::string_view name(MaterialLaw law) noexcept {
    switch (law) {
        case MaterialLaw::stable_neo_hookean:
            return "stable_neo_hookean";
        case MaterialLaw::st_venant_kirchhoff:
            return "st_venant_kirchhoff";
        case MaterialLaw::corotated:
            break;
    }
    return "corotated";
}

std::optional<MaterialLaw> material_law(std::string_view text) noexcept {
    for (const MaterialLaw law : material_laws)
        if (name(law) == text) return law;
    return {};
}

void MaterialChange::apply(Material& material) const {
    material.young = young.value_or(material.young);
    material.poisson = poisson.value_or(material.poisson);
    material.density = density.value_or(material.density);
    material.rayleigh_mass = rayleigh_mass.value_or(material.rayleigh_mass);
    material.rayleigh_stiffness = rayleigh_stiffness.value_or(material.rayleigh_stiffness);
    material.law = law.value_or(material.law);
}

void check_material(const Material& m) {
    const auto require = [](bool ok, const char* what, double value, const char* allowed) {
        if (!ok || !std::isfinite(value))
            throw std::invalid_argument(fmt::format("{} is {}; allowed: {}", what, value, allowed));
    };
    const auto is_positive = [](double value) { return value >= least_constant && value <= max_constant; };
    const auto is_damping = [](double value) { return value >= 0 && value <= max_constant; };
    require(is_positive(m.young), "Young's modulus", m.young, "between 1e-30 and 1e30 Pa");
    require(m.poisson >= least_poisson && m.poisson <= max_poisson, "Poisson's ratio", m.poisson,
            "between -0.999 and 0.4999");
    require(is_positive(m.density), "density", m.density, "between 1e-30 and 1e30 kg/m3");
    require(is_damping(m.rayleigh_mass), "Rayleigh mass damping", m.rayleigh_mass, "between 0 and 1e30 1/s");
    require(is_damping(m.rayleigh_stiffness), "Rayleigh stiffness damping", m.rayleigh_stiffness,
            "between 0 and 1e30 s");
}

std::vector<const Material*> materials_of_tets(const Material& material,
                                               const std::vector<MaterialRegion>& regions, int tets) {
    std::vector<const Material*> result(tets, &material);
    for (const MaterialRegion& region : regions)
        for (const int t : region.tets) result[t] = &region.material;
    return result;
}

void check_regions(const std::vector<MaterialRegion>& regions, const Material& material, int tets) {
    if (regions.size() > max_regions)
        throw std::invalid_argument(
            fmt::format("{} regions of material; allowed: at most {}", regions.size(), max_regions));
    std::set<std::string> names;
    std::vector<char> taken(tets, 0);
    for (const MaterialRegion& region : regions) {
        const auto refuse = [&](const std::string& reason) {
            throw std::invalid_argument(fmt::format("region \"{}\": {}", region.name, reason));
        };
        if (region.name.empty() || !names.insert(region.name).second)
            refuse("its name is empty or taken; allowed: a name of its own");
        try {
            check_material(region.material);
        } catch (const std::invalid_argument& e) {
            refuse(e.what());
        }
        if (region.material.rayleigh_mass != material.rayleigh_mass ||
            region.material.rayleigh_stiffness != material.rayleigh_stiffness)
            refuse("its damping differs; allowed: that of the body");
        if (region.tets.empty()) refuse("it has no tetrahedra; allowed: at least one");
        if (!std::ranges::is_sorted(region.tets)) refuse("its tetrahedra are not in ascending order");
        for (const int t : region.tets) {
            if (t < 0 || t >= tets)
                refuse(fmt::format("it has tetrahedron {}; allowed: 0 to {}", t, tets - 1));
            if (taken[t]++)
                refuse(fmt::format("tetrahedron {} is in a region already; allowed: one each", t));
        }
    }
}

}  // namespace nbd
