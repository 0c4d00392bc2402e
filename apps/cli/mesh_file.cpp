#include "apps/cli/mesh_file.hpp"

#include <fmt/core.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "collision/geometry/far_origin.hpp"
#include "meshing/body/make_body.hpp"
#include "meshing/cage/clean_soup.hpp"
#include "meshing/formats/read_surface.hpp"
#include "meshing/formats/read_tets.hpp"
#include "meshing/remesh/remesh.hpp"
#include "meshing/surface/check_surface.hpp"
#include "meshing/surface/solid_boundary.hpp"
#include "meshing/surface/weld.hpp"
#include "meshing/tets/order_by_place.hpp"
#include "sim/fem/bending_error.hpp"

namespace nbd {
namespace {

constexpr std::uint64_t unlimited = std::numeric_limits<std::uint64_t>::max();

std::uint64_t of_meminfo() {
    std::ifstream file("/proc/meminfo");
    std::string name, unit;
    for (std::uint64_t kib = 0; file >> name >> kib && std::getline(file, unit);)
        if (name == "MemAvailable:") return kib * 1024;
    return unlimited;
}

/// The number in a file; unlimited for "max" and for a file that is not there.
std::uint64_t limit_in(const std::filesystem::path& path) {
    std::ifstream file(path);
    std::uint64_t bytes = 0;
    return file >> bytes ? bytes : unlimited;
}

/// The least limit of the process's control group and of those above it, in version 1 or 2.
std::uint64_t of_control_groups() {
    std::uint64_t least = unlimited;
    std::ifstream groups("/proc/self/cgroup");  // lines such as "0::/a/b" and "9:memory:/a/b"
    for (std::string line; std::getline(groups, line);) {
        const std::size_t first = line.find(':'), second = line.find(':', first + 1);
        if (second == line.npos) continue;
        const std::string controllers = line.substr(first + 1, second - first - 1);
        if (!controllers.empty() && controllers != "memory") continue;
        const std::filesystem::path root = controllers.empty() ? "/sys/fs/cgroup" : "/sys/fs/cgroup/memory";
        const char* file = controllers.empty() ? "memory.max" : "memory.limit_in_bytes";
        for (std::filesystem::path group = line.substr(second + 1);; group = group.parent_path()) {
            least = std::min(least, limit_in(root / group.relative_path() / file));
            if (!group.has_relative_path()) break;
        }
    }
    return least;
}

/// Bytes of memory that this process may still take: what /proc/meminfo calls available, or the limit of its
/// control group if that is less. The largest number where neither can be read.
std::uint64_t available_memory() { return std::min(of_meminfo(), of_control_groups()); }

/// Tells how much memory a step takes where it is much, and throws before it is taken if there is not as
/// much.
void check_memory(const std::string& what, double bytes, const char* help, const Output& out) {
    constexpr double gib = 1024. * 1024 * 1024;
    const double available = available_memory();
    const std::string wanted = fmt::format("{} takes about {:.1f} GiB of memory", what, bytes / gib);
    if (bytes > available)
        throw std::runtime_error(
            fmt::format("{}, but {:.1f} GiB are available{}", wanted, available / gib, help));
    if (bytes > gib) out.text(wanted);
}

/// Reads a surface if there is room for it and for what follows. fills: the surface itself with tetrahedra.
TriMesh surface_of(const std::filesystem::path& path, bool fills, const Output& out) {
    // Measured at the peak: reading, and filling the surface or wrapping it.
    constexpr double read_per_byte = 8, filled_per_face = 3500, wrapped_per_face = 500;
    std::error_code error;  // read_surface() says what is wrong
    const std::uintmax_t bytes = std::filesystem::file_size(path, error);
    if (!error)
        check_memory(fmt::format("{}: reading it", path.string()), read_per_byte * static_cast<double>(bytes),
                     "", out);
    out.work("reading the surface");
    TriMesh surface = read_surface(path);
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

void tell_origin(const Eigen::Vector3d& origin, const Output& out) {
    if (!origin.isZero(0))
        out.text(fmt::format("far from zero: the body's positions are counted from its origin ({}, {}, {})",
                             origin.x(), origin.y(), origin.z()));
}

/// make_solid_boundary(), with a way out where a surface is open.
SolidBoundary solid_boundary_of(TriMesh surface) {
    try {
        return make_solid_boundary(std::move(surface));
    } catch (const SurfaceNotClosed& error) {
        throw std::invalid_argument(
            fmt::format("{}; --weld LENGTH, in scenes meshing.weld, closes cracks up to a length, --cage "
                        "takes any surface as it is",
                        error.what()));
    }
}

/// tetrahedralize(), with a way out where the surface is too coarse for the nodes.
TetrahedralizeResult filling_of(const TriMesh& surface, const TetrahedralizeConfig& config) {
    try {
        return tetrahedralize(surface, config);
    } catch (const NodesOutOfReach& error) {
        throw std::invalid_argument(
            fmt::format("{}; the tetrahedra take the surface's own vertices, so {}", error.what(),
                        error.wants_more ? "for more nodes give a surface of more faces: divide its faces in "
                                           "another program, or --cage N, whose nodes do not depend on it"
                                         : "for fewer nodes give a surface of fewer faces, or --cage N, "
                                           "whose nodes do not depend on it"));
    }
}

/// The boundary of tetrahedra whose edges are about as long as told.
TriMesh remeshed(const std::filesystem::path& path, const TriMesh& surface, double edge, const Output& out) {
    constexpr double bytes_per_face = 6000;  // measured at the peak, of what follows, too
    const double faces = remeshed_faces(surface, edge);
    check_memory(fmt::format("{}: about {:.2g} triangles with edges of {:.3g} m", path.string(), faces, edge),
                 bytes_per_face * faces, "; longer edges need less", out);
    out.work("covering the surface anew");
    SolidBoundary coarse;
    try {
        coarse = make_solid_boundary(remesh(surface, edge));
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(fmt::format(
            "with edges of {:.3g} m: {}; choose a shorter edge, or --cage N", edge, error.what()));
    }
    out.text(fmt::format("covered by {} triangles with edges of about {:.3g} m", coarse.mesh.F.rows(), edge));
    return coarse.mesh;
}

/// Fills a closed surface, or what `edge` makes of it.
MeshedFile body_within(const std::filesystem::path& path, const TriMesh& surface,
                       const MeshFileConfig& config, const Output& out) {
    const TriMesh coarse = config.edge > 0 ? remeshed(path, surface, config.edge, out) : surface;
    out.work("filling with tetrahedra");
    TetrahedralizeResult filled = filling_of(coarse, config.tets);
    out.text(fmt::format("gmsh: grading {:.4g} after {} run(s)", filled.grading, filled.runs));
    if (filled.optimization.poor_before > 0) out.text(describe(filled.optimization));
    out.work("making the body");
    filled.tets = as_elements(std::move(filled.tets), config.elements);
    order_by_place(filled.tets);
    try {
        return {make_body(path.stem().string(), surface, std::move(filled.tets), config.material,
                          config.levels, config.scheme),
                filled.optimization,
                {}};
    } catch (const std::invalid_argument& error) {
        if (config.edge == 0) throw;
        throw std::invalid_argument(
            fmt::format("with edges of {:.3g} m: {}; choose a shorter edge", config.edge, error.what()));
    }
}

/// Shortens the edges of quadratic tetrahedra until they bend as rightly as is asked for.
MeshedFile searched(const std::filesystem::path& path, const TriMesh& surface, MeshFileConfig config,
                    const Output& out) {
    constexpr int rounds = 12, most_tets = 5000;
    config.elements = Elements::quadratic;
    // The thickness of a beam, twice that of a plate.
    config.edge = 4 * enclosed_volume(surface) / area(surface.X, surface.F);
    std::string last;
    for (int round = 0; round < rounds; ++round) {
        try {
            MeshedFile result = body_within(path, surface, config, out);
            Body& body = result.body;
            if (body.tets.T.rows() > most_tets) {
                last += fmt::format("{}edges of {:.3g} m give {} tetrahedra, allowed: {}",
                                    last.empty() ? "" : "; ", config.edge, body.tets.T.rows(), most_tets);
                break;
            }
            out.work("estimating how rightly it bends");
            body.bending_error = bending_error(body, 8 * most_tets);
            if (!body.bending_error) throw std::invalid_argument("its end cannot be held");
            if (*body.bending_error <= config.error) return result;
            last = fmt::format("edges of {:.3g} m leave {:.2g}", config.edge, *body.bending_error);
            config.edge *= std::clamp(0.9 * std::sqrt(config.error / *body.bending_error), 0.5, 0.9);
        } catch (const std::invalid_argument& error) {  // other edges may do
            last = error.what();
            config.edge *= 0.75;
        }
    }
    throw std::invalid_argument(
        fmt::format("no tetrahedra bend to an error of {:.2g}: {}; choose a larger error, or --edge",
                    config.error, last));
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

}  // namespace

bool holds_tets(const std::filesystem::path& path) {
    const std::string extension = path.extension().string();
    return extension == ".msh" || extension == ".vtk" || extension == ".vtu" || extension == ".mesh" ||
           extension == ".h5";
}

Body body_of_tets(const std::filesystem::path& path, const MeshFileConfig& config, const Output& out) {
    const bool of_body = path.extension() == ".h5";
    std::vector<std::string> notes;
    TetMesh tets;
    Material material = config.material;
    std::vector<MaterialRegion> regions;
    std::vector<TetGroup> groups;
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();
    if (of_body) {
        Body body = load_body(path);
        origin = config.scale * body.origin;
        tets = std::move(body.tets);
        material = body.material;
        regions = std::move(body.regions);
    } else {
        tets = read_tets(path, &notes, &groups);
    }
    for (const std::string& note : notes) out.text(note);
    tets.X *= config.scale;
    out.work("making the body");
    if (groups.size() > max_regions) {
        out.text(fmt::format("{} groups of tetrahedra are left out; regions of material: at most {}",
                             groups.size(), max_regions));
        groups.clear();
    }
    for (const TetGroup& group : groups)
        out.text(fmt::format("region \"{}\": {} tetrahedra", group.name, group.tets.size()));
    try {
        if (!of_body) regions = regions_of(groups, config);
        tets = as_elements(std::move(tets), config.elements);
        Body body = make_body(path.stem().string(), std::move(tets), material, config.levels, config.scheme);
        body.regions = std::move(regions);
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
    TriMesh surface = surface_of(path, config.cage == 0 && config.inside.empty(), out);
    surface.X *= config.scale;
    const Nodes scaled = surface.X;
    const Eigen::Index faces = surface.F.rows();
    WeldReport weld;
    try {
        if (config.weld > 0) {
            surface = weld_within(surface, config.weld, weld);
            out.text(describe(weld));
        }
        if (config.cage > 0) {
            out.work("wrapping and filling a cage");
            CageBody caged = make_cage_body(path.stem().string(), std::move(surface), config.cage,
                                            config.material, config.elements.value_or(Elements::linear));
            out.text(describe(caged.report));
            tell_origin(caged.body.origin, out);
            return {std::move(caged.body), caged.report.optimization, caged.report};
        }
        if (!config.inside.empty()) {
            out.work("embedding");
            const Body outer = load_body(config.inside);
            out.text(describe(clean_soup(surface)));
            tell_origin(outer.origin, out);
            return {make_body_inside(path.stem().string(), std::move(surface), outer), {}, {}};
        }
        out.work("checking the surface");
        const Eigen::Vector3d origin = far_origin(surface.X, surface.F);
        surface.X.rowwise() -= origin.transpose();
        tell_origin(origin, out);
        const SolidBoundary boundary = solid_boundary_of(std::move(surface));
        out.text(fmt::format("surface: {}", describe(boundary.report)));
        MeshedFile result = config.error > 0 ? searched(path, boundary.mesh, config, out)
                                             : body_within(path, boundary.mesh, config, out);
        result.body.origin += origin;
        return result;
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(fmt::format("{}: {}{}", path.string(), error.what(),
                                                changes_of(scaled, config.scale, weld, faces)));
    }
}

MeshedFile mesh_file(const std::filesystem::path& path, const MeshFileConfig& config, const Output& out) {
    if (holds_tets(path)) return {body_of_tets(path, config, out), {}, {}};
    return body_of_surface(path, config, out);
}

}  // namespace nbd
