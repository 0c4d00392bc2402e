#include "apps/cli/mesh_file.hpp"

#include <fmt/core.h>
#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/cli/fill_surface.hpp"
#include "collision/geometry/far_origin.hpp"
#include "meshing/body/make_body.hpp"
#include "meshing/body/rigid_body.hpp"
#include "meshing/cage/clean_soup.hpp"
#include "meshing/formats/read_surface.hpp"
#include "meshing/formats/read_tets.hpp"
#include "meshing/surface/check_surface.hpp"
#include "meshing/surface/face_groups.hpp"
#include "meshing/surface/solid_boundary.hpp"
#include "meshing/surface/weld.hpp"

namespace nbd {
namespace {

/// Reads a surface if there is room for it and for what follows. fills: the surface itself with tetrahedra.
TriMesh surface_of(const std::filesystem::path& path, bool fills, const Output& out,
                   std::vector<FaceGroup>& groups) {
    // Measured at the peak: reading, and filling the surface or wrapping it.
    constexpr double read_per_byte = 8, filled_per_face = 3500, wrapped_per_face = 900;
    std::error_code error;  // read_surface() says what is wrong
    const std::uintmax_t bytes = std::filesystem::file_size(path, error);
    if (!error)
        check_memory(fmt::format("{}: reading it", path.string()), read_per_byte * static_cast<double>(bytes),
                     "", out);
    out.work("reading the surface");
    TriMesh surface = read_surface(path, &groups);
    check_memory(fmt::format("{}: a surface of {} faces", path.string(), surface.F.rows()),
                 (fills ? filled_per_face : wrapped_per_face) * static_cast<double>(surface.F.rows()),
                 fills ? "; --cage needs less" : "", out);
    return surface;
}

std::vector<MaterialRegion> regions_of(const std::vector<TetGroup>& groups, const MeshFileConfig& config) {
    for (const auto& [name, change] : config.regions)
        if (std::ranges::find(groups, name, &TetGroup::name) == groups.end()) {
            std::vector<std::string_view> names;
            for (const TetGroup& group : groups) names.push_back(group.name);
            throw std::invalid_argument(fmt::format(
                "it has no group \"{}\" of tetrahedra; allowed: {}", name,
                names.empty() ? "none, the file has no groups" : fmt::to_string(fmt::join(names, ", "))));
        }
    std::vector<MaterialRegion> regions;
    for (const TetGroup& group : groups) {
        Material material = config.material;
        if (const auto change = config.regions.find(group.name); change != config.regions.end())
            change->second.apply(material);
        regions.push_back({.name = group.name, .material = material, .tets = group.tets});
    }
    return regions;
}

/// make_solid_boundary(), with a way out where a surface is open.
SolidBoundary solid_boundary_of(TriMesh surface, const SolidBoundaryConfig& allowed = {}) {
    try {
        return make_solid_boundary(std::move(surface), allowed);
    } catch (const SurfaceNotClosed& error) {
        throw std::invalid_argument(
            fmt::format("{}; --weld LENGTH, in scenes meshing.weld, closes cracks up to a length, --cage "
                        "takes any surface as it is",
                        error.what()));
    }
}

/// What scaling and welding made of a surface, for the message about what is wrong with it: the size if that
/// is out of all proportion, and the faces that welding dropped. scaled, faces: before welding.
std::string changes_of(const Nodes& scaled, double scale, const WeldReport& weld, Eigen::Index faces) {
    constexpr double least = 1e-9, most = 1e9;  // metres
    std::string text;
    const double length =
        scaled.rows() > 0 ? (scaled.colwise().maxCoeff() - scaled.colwise().minCoeff()).maxCoeff() : 1;
    if (scale != 1 && !(length >= least && length <= most))
        text += fmt::format("; the scale {:.3g} makes it {:.3g} m long: choose another", scale, length);
    if (weld.dropped_faces > 0)
        text += fmt::format(
            "; welding within {:.3g} m merged {} of {} vertices and dropped {} of {} faces: "
            "choose a shorter length",
            weld.length, weld.merged_vertices, scaled.rows(), weld.dropped_faces, faces);
    return text;
}

Body rigid_body_of(const std::filesystem::path& path, TriMesh surface, double density,
                   const MeshFileConfig& config, const Output& out) {
    const Eigen::Vector3d origin = far_origin(surface.X, surface.F);
    surface.X.rowwise() -= origin.transpose();
    const SolidBoundary boundary = solid_boundary_of(std::move(surface), {.allow_components = true});
    out.text(fmt::format("surface: {}", describe(boundary.report)));
    TriMesh fine = subdivide(boundary.mesh, config.scheme, config.levels).mesh;
    Body body = make_rigid_body(path.stem().string(), std::move(fine), density);
    body.origin += origin;
    tell_origin(body.origin, out);
    return body;
}

/// Gives a body the groups of the surface that it was made of, and tells them. surface: counted from zero as
/// the body's origin is.
void take_groups(Body& body, TriMesh surface, const std::vector<FaceGroup>& groups, const Output& out) {
    if (groups.size() > max_regions)
        return out.text(
            fmt::format("{} groups of faces are left out; allowed: at most {}", groups.size(), max_regions));
    surface.X.rowwise() -= body.origin.transpose();
    body.face_groups = groups_on(body.surface, surface, groups);
    for (const FaceGroup& group : body.face_groups)
        out.text(fmt::format("group \"{}\": {} faces", group.name, group.faces.size()));
}

/// Within a surface, or in a cage where nothing within it bends rightly. Where that was not asked for, but is
/// usual, the surface has to be closed, and is filled as it is where nothing bends rightly.
MeshedFile filled(const std::filesystem::path& path, const TriMesh& surface, const MeshFileConfig& config,
                  const Output& out) {
    const double allowed = config.error_to_search_for();
    const bool is_asked = allowed > 0 && config.error;
    SolidBoundary boundary;
    try {
        boundary = solid_boundary_of(surface);
    } catch (const std::invalid_argument& error) {
        if (!is_asked) throw;
        return searched_cage(path, surface, config, allowed, error.what(), out);
    }
    out.text(fmt::format("surface: {}", describe(boundary.report)));
    if (allowed == 0) return body_within(path, boundary.mesh, config, out);
    try {
        return searched(path, boundary.mesh, config, allowed, out);
    } catch (const std::invalid_argument& error) {
        if (is_asked) throw;
        out.warning(
            fmt::format("{}: {}; so linear ones have its own triangles", path.string(), error.what()));
        return body_within(path, boundary.mesh, config, out);
    }
}

/// Of a surface that has its size. path: for messages.
MeshedFile body_of(const std::filesystem::path& path, TriMesh surface, const MeshFileConfig& config,
                   const Output& out) {
    const Nodes scaled = surface.X;
    const Eigen::Index faces = surface.F.rows();
    WeldReport weld;
    try {
        if (config.weld > 0) {
            surface = weld_within(surface, config.weld, weld);
            out.text(describe(weld));
        }
        if (config.cage > 0) {
            MeshedFile result =
                in_cage(path, std::move(surface), config, config.elements.value_or(Elements::linear), out);
            out.text(describe(*result.cage));
            tell_origin(result.body.origin, out);
            return result;
        }
        if (!config.inside.empty()) {
            out.work("embedding");
            const Body outer = load_body(config.inside);
            if (is_rigid(outer.tets))
                throw std::invalid_argument(config.inside + " is a rigid body, which holds no other");
            out.text(describe(clean_soup(surface)));
            tell_origin(outer.origin, out);
            return {make_body_inside(path.stem().string(), std::move(surface), outer), {}, {}};
        }
        out.work("checking the surface");
        if (config.rigid)
            return {rigid_body_of(path, std::move(surface), config.material.density, config, out), {}, {}};
        const Eigen::Vector3d origin = far_origin(surface.X, surface.F);
        surface.X.rowwise() -= origin.transpose();
        tell_origin(origin, out);
        MeshedFile result = filled(path, surface, config, out);
        result.body.origin += origin;
        return result;
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(fmt::format("{}: {}{}", path.string(), error.what(),
                                                changes_of(scaled, config.scale, weld, faces)));
    }
}

}  // namespace

bool holds_tets(const std::filesystem::path& path) {
    const std::string extension = path.extension().string();
    return extension == ".msh" || extension == ".vtk" || extension == ".vtu" || extension == ".mesh" ||
           extension == ".inp" || extension == ".h5";
}

Body body_of_tets(const std::filesystem::path& path, const MeshFileConfig& config, const Output& out) {
    const bool of_body = path.extension() == ".h5";
    std::vector<std::string> notes;
    TetMesh tets;
    Material material = config.material;
    std::vector<MaterialRegion> regions;
    std::vector<TetGroup> groups;
    std::vector<FaceGroup> face_groups;
    TriMesh with_groups;  // the surface that these are of
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
    TriMesh body_surface;  // of a body file that becomes a rigid body
    if (of_body) {
        Body body = load_body(path);
        if (is_rigid(body.tets) && !config.rigid)
            throw std::invalid_argument(
                fmt::format("{}: it is a rigid body, which has no tetrahedra of its own; allowed: --elements "
                            "rigid",
                            path.string()));
        if (config.rigid) {
            body.material = mean_material(body);
            body_surface = std::move(body.surface);
            body_surface.X = config.sized(body_surface.X);
        }
        origin = config.sized(body.origin.transpose()).transpose();
        face_groups = std::move(body.face_groups);
        with_groups = body_surface.F.rows() > 0 ? body_surface : std::move(body.surface);
        if (!config.rigid) with_groups.X = config.sized(with_groups.X);
        tets = std::move(body.tets);
        material = body.material;
        regions = std::move(body.regions);
    } else {
        tets = read_tets(path, &notes, &groups, &face_groups);
    }
    for (const std::string& note : notes) out.text(note);
    tets.X = config.sized(tets.X);
    if (!of_body) with_groups = {tets.X, boundary_faces(tets)};
    out.work("making the body");
    if (groups.size() > max_regions) {
        out.text(fmt::format("{} groups of tetrahedra are left out; regions of material: at most {}",
                             groups.size(), max_regions));
        groups.clear();
    }
    for (const TetGroup& group : groups)
        out.text(fmt::format("region \"{}\": {} tetrahedra", group.name, group.tets.size()));
    try {
        if (config.rigid) {
            TriMesh surface = of_body ? std::move(body_surface) : boundary_surface(tets);
            Body body = rigid_body_of(path, std::move(surface), material.density, config, out);
            take_groups(body, with_groups, face_groups, out);
            body.origin += origin;
            return body;
        }
        if (!of_body) regions = regions_of(groups, config);
        tets = as_elements(std::move(tets), config.elements);
        Body body = make_body(path.stem().string(), std::move(tets), material, config.levels, config.scheme);
        body.regions = std::move(regions);
        take_groups(body, with_groups, face_groups, out);
        body.origin += origin;
        check_body(body);
        tell_origin(body.origin, out);
        return body;
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(fmt::format("{}: {}", path.string(), error.what()));
    }
}

MeshedFile body_of_surface(const std::filesystem::path& path, const MeshFileConfig& config,
                           const Output& out) {
    std::vector<FaceGroup> groups;
    TriMesh surface = surface_of(path, config.cage == 0 && config.inside.empty(), out, groups);
    surface.X = config.sized(surface.X);
    if (groups.empty()) return body_of(path, std::move(surface), config, out);
    MeshedFile result = body_of(path, surface, config, out);
    take_groups(result.body, std::move(surface), groups, out);
    return result;
}

MeshedFile mesh_file(const std::filesystem::path& path, const MeshFileConfig& config, const Output& out) {
    if (holds_tets(path)) return {body_of_tets(path, config, out), {}, {}};
    return body_of_surface(path, config, out);
}

}  // namespace nbd
