#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace nbd {

/// Allowed range of the constants of materials, of scales and of lengths, where they must be positive, so
/// that products of several of them are neither infinite nor zero.
constexpr double least_constant = 1e-30, max_constant = 1e30;

/// Allowed range of Poisson's ratio. At -1 and 0.5 a linear material is infinitely stiff; close to them
/// eigensolvers fail and four-node tetrahedra lock.
constexpr double least_poisson = -0.999, max_poisson = 0.4999;

/// How stress follows from strain. All laws agree for small strains.
enum class MaterialLaw {
    corotated,            // linear in the strain without the rotation [MuellerGross04]
    stable_neo_hookean,   // rubber and flesh, also inverted [SmithDeGoesKim18]
    st_venant_kirchhoff,  // linear in Green's strain; softens below 58 % of a length and does not resist
                          // inversion
};

/// Names in files: "corotated", "stable_neo_hookean", "st_venant_kirchhoff".
std::string_view name(MaterialLaw law) noexcept;
std::optional<MaterialLaw> material_law(std::string_view name) noexcept;
constexpr std::array<MaterialLaw, 3> material_laws{MaterialLaw::corotated, MaterialLaw::stable_neo_hookean,
                                                   MaterialLaw::st_venant_kirchhoff};

/// Isotropic elastic material. Young's modulus and Poisson's ratio are those at small strains. Ranges:
/// those above.
struct Material {
    double young = 1e5;                // Pa, least_constant to max_constant
    double poisson = 0.40;             // least_poisson to max_poisson
    double density = 1000;             // kg/m3, likewise
    double rayleigh_mass = 0.1;        // 1/s, 0 to max_constant
    double rayleigh_stiffness = 1e-3;  // s, likewise
    MaterialLaw law = MaterialLaw::corotated;
    bool operator==(const Material&) const = default;
};

/// Constants that replace those of a material.
struct MaterialChange {
    std::optional<double> young{}, poisson{}, density{}, rayleigh_mass{}, rayleigh_stiffness{};
    std::optional<MaterialLaw> law{};
    void apply(Material& material) const;
};

/// Tetrahedra of another material than the rest of their body, with the same damping.
struct MaterialRegion {
    std::string name;
    Material material;
    std::vector<int> tets;  // ascending
    bool operator==(const MaterialRegion&) const = default;
};

constexpr std::size_t max_regions = 1000;  // of a body

/// The material of each tetrahedron. The arguments must outlive the result.
std::vector<const Material*> materials_of_tets(const Material& material,
                                               const std::vector<MaterialRegion>& regions, int tets);

/// Throws std::invalid_argument naming the first constant outside the range given in Material.
void check_material(const Material& material);

/// Throws std::invalid_argument naming the first region with a material out of range or with other damping
/// than the body's, a tetrahedron out of range or in two regions, no tetrahedra, or a name that is empty or
/// taken; and for more than max_regions.
void check_regions(const std::vector<MaterialRegion>& regions, const Material& material, int tets);

}  // namespace nbd
