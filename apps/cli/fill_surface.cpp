#include "apps/cli/fill_surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <utility>

#include "collision/base/stop.hpp"
#include "collision/geometry/far_origin.hpp"
#include "meshing/body/enclose.hpp"
#include "meshing/body/make_body.hpp"
#include "meshing/remesh/remesh.hpp"
#include "meshing/surface/material_fill.hpp"
#include "meshing/surface/solid_boundary.hpp"
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

}  // namespace

void check_memory(const std::string& what, double bytes, const char* help, const Output& out) {
    constexpr double gib = 1024. * 1024 * 1024;
    const double available = available_memory();
    const std::string wanted = fmt::format("{} takes about {:.1f} GiB of memory", what, bytes / gib);
    if (bytes > available)
        throw std::runtime_error(
            fmt::format("{}, but {:.1f} GiB are available{}", wanted, available / gib, help));
    if (bytes > gib) out.text(wanted);
}

void tell_origin(const Eigen::Vector3d& origin, const Output& out) {
    if (!origin.isZero(0))
        out.text(fmt::format("far from zero: the body's positions are counted from its origin ({}, {}, {})",
                             origin.x(), origin.y(), origin.z()));
}

namespace {

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

/// The vertices of a surface, and points of its faces no farther apart than told, or than a million of them
/// are.
Nodes points_on(const TriMesh& surface, double spacing) {
    constexpr double most = 1e6;
    spacing = std::max(spacing, std::sqrt(2 * area(surface.X, surface.F) / most));
    std::vector<Eigen::RowVector3d> points;
    for (Eigen::Index v = 0; v < surface.X.rows(); ++v) points.emplace_back(surface.X.row(v));
    for (Eigen::Index f = 0; f < surface.F.rows(); ++f) {
        std::array<Eigen::RowVector3d, 3> corners;
        for (int k = 0; k < 3; ++k) corners[k] = surface.X.row(surface.F(f, k));
        // Rows along the longest edge, from a to b, up to c.
        int first = 0;
        const auto edge = [&](int k) { return corners[(k + 1) % 3] - corners[k]; };
        for (int k = 1; k < 3; ++k)
            if (edge(k).norm() > edge(first).norm()) first = k;
        const Eigen::RowVector3d a = corners[first], along = edge(first), up = corners[(first + 2) % 3] - a;
        const double longest = along.norm(), height = longest > 0 ? along.cross(up).norm() / longest : 0;
        const int rows = 1 + static_cast<int>(height / spacing);
        for (int j = 0; j < rows; ++j) {
            const double share = static_cast<double>(j) / rows;
            const int parts = 1 + static_cast<int>((1 - share) * longest / spacing);
            for (int i = 0; i <= parts; ++i)
                if (j > 0 || (i > 0 && i < parts))
                    points.emplace_back(a + share * up + (1 - share) * i / parts * along);
        }
    }
    Nodes result(std::ssize(points), 3);
    for (std::size_t p = 0; p < points.size(); ++p) result.row(p) = points[p];
    return result;
}

/// Lets the tetrahedra have the mass and stiffness of the solid that a surface bounds, where they reach
/// beyond it.
void take_fill(MeshedFile& meshed, const TriMesh& surface) {
    constexpr double rounding = 1e-9;  // of what a tetrahedron holds
    TetMesh& tets = meshed.body.tets;
    tets.fill = material_fill(tets, surface);
    bool is_full = true;
    for (Eigen::Index t = 0; t < tets.T.rows(); ++t) is_full = is_full && tets.filled(t) > 1 - rounding;
    if (is_full)
        tets.fill.resize(0, 10);
    else
        meshed.solid = surface;
}

}  // namespace

MeshedFile body_within(const std::filesystem::path& path, const TriMesh& surface,
                       const MeshFileConfig& config, const Output& out) {
    const TriMesh coarse = config.edge > 0 ? remeshed(path, surface, config.edge, out) : surface;
    out.work("filling with tetrahedra");
    TetrahedralizeResult filled = filling_of(coarse, config.tets);
    out.text(fmt::format("gmsh: grading {:.4g} after {} run(s)", filled.grading, filled.runs));
    if (filled.optimization.poor_before > 0) out.text(describe(filled.optimization));
    out.work("making the body");
    try {
        if (config.edge > 0) enclose(filled.tets, points_on(surface, config.edge / 2));
        filled.tets = as_elements(std::move(filled.tets), config.elements);
        order_by_place(filled.tets);
        MeshedFile result{make_body(path.stem().string(), surface, std::move(filled.tets), config.material,
                                    config.levels, config.scheme),
                          filled.optimization,
                          {}};
        if (config.edge > 0) take_fill(result, config.levels > 0 ? result.body.surface : surface);
        return result;
    } catch (const std::invalid_argument& error) {
        if (config.edge == 0) throw;
        throw std::invalid_argument(
            fmt::format("with edges of {:.3g} m: {}; choose a shorter edge", config.edge, error.what()));
    }
}

MeshedFile in_cage(const std::filesystem::path& path, TriMesh surface, const MeshFileConfig& config,
                   Elements elements, const Output& out) {
    out.work("wrapping and filling a cage");
    CageBody caged =
        make_cage_body(path.stem().string(), std::move(surface), config.cage, config.material, elements);
    return {std::move(caged.body), caged.report.optimization, caged.report, std::move(caged.solid)};
}

namespace {

constexpr int most_tets_searched = 8000;

/// Shortens the edges of quadratic tetrahedra until they bend as rightly as is asked for.
MeshedFile searched_edge(const std::filesystem::path& path, const TriMesh& surface, MeshFileConfig config,
                         double error, const Output& out) {
    constexpr int rounds = 12, most_tets = most_tets_searched, most_refused = 3;
    config.elements = Elements::quadratic;
    // The thickness of a beam, twice that of a plate.
    config.edge = 4 * enclosed_volume(surface) / area(surface.X, surface.F);
    std::string last;
    int refused = 0;
    for (int round = 0; round < rounds && refused < most_refused; ++round) {
        stop_if_asked();
        try {
            if (const double faces = remeshed_faces(surface, config.edge); faces > most_tets) {
                last += fmt::format("{}edges of {:.3g} m give {:.0f} triangles, allowed: {} tetrahedra",
                                    last.empty() ? "" : "; ", config.edge, faces, most_tets);
                break;
            }
            MeshedFile result = body_within(path, surface, config, out);
            Body& body = result.body;
            if (body.tets.T.rows() > most_tets) {
                last += fmt::format("{}edges of {:.3g} m give {} tetrahedra, allowed: {}",
                                    last.empty() ? "" : "; ", config.edge, body.tets.T.rows(), most_tets);
                break;
            }
            out.work("estimating how rightly it bends");
            body.bending_error = bending_error(body, 8 * most_tets, result.solid_in_tets());
            if (!body.bending_error) throw std::invalid_argument("its error cannot be estimated");
            if (*body.bending_error <= error) return result;
            last = fmt::format("edges of {:.3g} m leave {:.2g}", config.edge, *body.bending_error);
            config.edge *= std::clamp(0.9 * std::sqrt(error / *body.bending_error), 0.5, 0.9);
        } catch (const std::invalid_argument& failure) {  // other edges may do
            last = failure.what();
            ++refused;
            config.edge *= 0.75;
        }
    }
    throw std::invalid_argument(fmt::format(
        "no tetrahedra bend to an error of {:.2g}: {}; choose a larger error, or --edge", error, last));
}

}  // namespace

MeshedFile searched_cage(const std::filesystem::path& path, const TriMesh& surface, MeshFileConfig config,
                         double error, const std::string& why, const Output& out) {
    constexpr int rounds = 16;
    out.text(fmt::format("in a cage, as it is not filled: {}", why));
    if (config.levels > 0) out.warning("--subdivide has no effect on a body in a cage");
    config.cage = min_cage_nodes;
    std::string last;
    int most_that_fit = 0, least_too_many = most_tets_searched;  // corners
    for (int round = 0; round < rounds && least_too_many > 1.1 * most_that_fit; ++round) {
        stop_if_asked();
        double more = 1.5;
        try {
            MeshedFile result = in_cage(path, surface, config, Elements::quadratic, out);
            Body& body = result.body;
            if (body.tets.T.rows() > most_tets_searched) {
                least_too_many = config.cage;
                config.cage = (most_that_fit + least_too_many) / 2;
                continue;
            }
            most_that_fit = config.cage;
            out.work("estimating how rightly it bends");
            body.bending_error = bending_error(body, 8 * most_tets_searched, result.solid_in_tets());
            if (!body.bending_error) throw std::invalid_argument("its error cannot be estimated");
            if (*body.bending_error <= error) {
                out.text(describe(*result.cage));
                return result;
            }
            last = fmt::format("a cage of {} leaves {:.2g}", config.cage, *body.bending_error);
            more = std::clamp(1.2 * std::pow(*body.bending_error / error, 0.75), 1.3, 4.0);
        } catch (const std::invalid_argument& failure) {  // more nodes may do
            last = failure.what();
        }
        config.cage =
            std::min(static_cast<int>(std::lround(more * config.cage)), (config.cage + least_too_many) / 2);
    }
    throw std::invalid_argument(fmt::format(
        "no cage of at most {} tetrahedra bends to an error of {:.2g}: {}; choose a larger error, or --cage N",
        most_tets_searched, error, last));
}

MeshedFile searched(const std::filesystem::path& path, const TriMesh& surface, const MeshFileConfig& config,
                    double error, const Output& out) {
    std::string why;
    try {
        return searched_edge(path, surface, config, error, out);
    } catch (const std::invalid_argument& failure) {
        why = failure.what();
    }
    return searched_cage(path, surface, config, error, why, out);
}

}  // namespace nbd
