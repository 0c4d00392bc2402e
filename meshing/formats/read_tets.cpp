#include "meshing/formats/read_tets.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <stdexcept>
#include <utility>

#include "collision/base/file_name.hpp"
#include "meshing/formats/tet_formats.hpp"

namespace nbd {
namespace {

TetFileContent read_file(const std::filesystem::path& path) {
    const auto read = has_extension(path, ".msh")    ? read_gmsh
                      : has_extension(path, ".mesh") ? read_medit
                      : has_extension(path, ".vtk")  ? read_vtk
                      : has_extension(path, ".vtu")  ? read_vtu
                      : has_extension(path, ".inp")  ? read_inp
                                                     : nullptr;
    if (!read)
        throw std::runtime_error(
            fmt::format("{}: tetrahedra are read from .msh, .mesh, .vtk, .vtu and .inp, not from '{}'",
                        path.string(), path.extension().string()));
    FileCursor in(path);
    return read(in);
}

/// Keeps only nodes of tetrahedra, in their order. Returns the number of dropped nodes.
int drop_unused_nodes(TetFileContent& content) {
    std::vector<int> row(content.nodes.size(), -1);
    for (const auto& tet : content.tets)
        for (const int node : tet) row[node] = 0;
    int kept = 0;
    for (std::size_t n = 0; n < row.size(); ++n) {
        if (row[n] < 0) continue;
        content.nodes[kept] = content.nodes[n];
        row[n] = kept++;
    }
    for (auto& tet : content.tets)
        for (int& node : tet) node = row[node];
    for (auto& triangle : content.triangles)
        for (int& node : triangle) node = row[node];
    for (NodeSet& set : content.node_sets) {
        for (int& node : set.nodes) node = row[node];
        std::erase(set.nodes, -1);
    }
    const int dropped = content.nodes.size() - kept;
    content.nodes.resize(kept);
    return dropped;
}

/// Flips tetrahedra of negative volume and returns their number. Throws std::runtime_error naming a flat or
/// non-finite one.
int orient(TetMesh& tets) {
    constexpr double flat = 1e-13;  // relative to the cube of the longest edge at corner 0; covers rounding
    int turned = 0;
    for (int t = 0; t < tets.T.rows(); ++t) {
        for (int c = 0; c < 4; ++c)
            if (!tets.X.row(tets.T(t, c)).allFinite())
                throw std::runtime_error(fmt::format("tetrahedron {} has a corner that is not finite", t));
        const Eigen::RowVector3d a = tets.X.row(tets.T(t, 0));
        const Eigen::RowVector3d ab = tets.X.row(tets.T(t, 1)) - a, ac = tets.X.row(tets.T(t, 2)) - a,
                                 ad = tets.X.row(tets.T(t, 3)) - a;
        const double length = std::max({ab.norm(), ac.norm(), ad.norm()});
        const double det = ab.cross(ac).dot(ad);
        if (!(std::abs(det) > flat * length * length * length))
            throw std::runtime_error(fmt::format("tetrahedron {} has no volume", t));
        if (det < 0) {
            std::swap(tets.T(t, 2), tets.T(t, 3));
            ++turned;
        }
    }
    return turned;
}

/// Throws std::runtime_error naming two tetrahedra that overlap: both lie on the same side of a shared face.
/// This also catches a face of more than two tetrahedra.
void check_faces(const TetMesh& tets) {
    // Sorted corners of the face; parity of the tetrahedron as (face, opposite corner); tetrahedron.
    std::vector<std::array<int, 5>> sides;
    sides.reserve(tets.T.size());
    for (int t = 0; t < tets.T.rows(); ++t)
        for (int skip = 0; skip < 4; ++skip) {
            std::array<int, 3> face{};
            for (int c = 0, k = 0; c < 4; ++c)
                if (c != skip) face[k++] = tets.T(t, c);
            const auto [a, b, c] = face;
            const int parity = (3 - skip + (a > b) + (a > c) + (b > c)) % 2;
            std::ranges::sort(face);
            sides.push_back({face[0], face[1], face[2], parity, t});
        }
    std::ranges::sort(sides);
    for (std::size_t i = 1; i < sides.size(); ++i)
        if (std::equal(sides[i].begin(), sides[i].begin() + 4, sides[i - 1].begin()))
            throw std::runtime_error(
                fmt::format("tetrahedra {} and {} overlap: they lie on the same side of their shared face",
                            sides[i - 1][4], sides[i][4]));
}

/// Groups by name; those of the same name are one.
template <class Group>
struct NamedGroups {
    std::map<std::string, Group> found{};
    bool has_names = false;  // whether the file names any of them

    /// The group of a number. gmsh marks tetrahedra that a group has turned by a negative number.
    Group& of(int number, const std::map<int, std::string>& names) {
        number = std::abs(number);
        const auto given = names.find(number);
        const bool is_named = given != names.end() && !given->second.empty();
        has_names = has_names || is_named;
        const std::string name = is_named ? given->second : fmt::format("group {}", number);
        Group& group = found[name];
        group.name = name;
        return group;
    }
};

std::vector<TetGroup> groups_of(const TetFileContent& content) {
    NamedGroups<TetGroup> named;
    for (std::size_t t = 0; t < content.group_of_tet.size(); ++t)
        if (const int number = content.group_of_tet[t]; number != 0)
            named.of(number, content.group_names).tets.push_back(t);
    std::vector<TetGroup> groups;
    for (auto& [name, group] : named.found) groups.push_back(std::move(group));
    if (!named.has_names && groups.size() == 1 && groups[0].tets.size() == content.tets.size()) return {};
    return groups;
}

/// Groups of boundary faces that the file has as triangles, by name, but for a single one of all of them
/// without a name.
std::vector<FaceGroup> face_groups_of(TetFileContent& content, const TetMesh& tets) {
    const Faces boundary = boundary_faces(tets);
    std::map<std::array<int, 3>, int> row;
    for (Eigen::Index f = 0; f < boundary.rows(); ++f) row[sorted_corners(boundary, f)] = static_cast<int>(f);
    NamedGroups<FaceGroup> named;
    for (std::size_t k = 0; k < content.triangles.size(); ++k) {
        std::array<int, 3> corners = content.triangles[k];
        std::ranges::sort(corners);
        if (const auto face = row.find(corners); face != row.end())
            named.of(content.group_of_triangle[k], content.triangle_group_names)
                .faces.push_back(face->second);
    }
    for (const NodeSet& set : content.node_sets) {
        std::vector<char> is_in(tets.X.rows(), 0);
        for (const int node : set.nodes) is_in[node] = 1;
        FaceGroup group{.name = set.name, .faces = {}};
        for (int f = 0; f < boundary.rows(); ++f)
            if (is_in[boundary(f, 0)] && is_in[boundary(f, 1)] && is_in[boundary(f, 2)])
                group.faces.push_back(f);
        if (group.faces.empty())
            content.notes.push_back(
                fmt::format("set {} of {} nodes left out: no face has all of its corners in it", set.name,
                            set.nodes.size()));
        else if (std::ssize(group.faces) < boundary.rows())
            named.found.emplace(set.name, std::move(group));
        named.has_names = true;
    }
    std::vector<FaceGroup> groups;
    for (auto& [name, group] : named.found) {
        std::ranges::sort(group.faces);
        group.faces.erase(std::unique(group.faces.begin(), group.faces.end()), group.faces.end());
        groups.push_back(std::move(group));
    }
    if (!named.has_names && groups.size() == 1 && std::ssize(groups[0].faces) == boundary.rows()) return {};
    return groups;
}

}  // namespace

TetMesh read_tets(const std::filesystem::path& path, std::vector<std::string>* notes,
                  std::vector<TetGroup>* groups, std::vector<FaceGroup>* face_groups) {
    TetFileContent content = read_file(path);
    try {
        if (content.tets.empty()) throw std::runtime_error("the file holds no tetrahedra");
        const int dropped = drop_unused_nodes(content);
        TetMesh tets;
        tets.X = Eigen::Map<const Nodes>(content.nodes.front().data(), content.nodes.size(), 3);
        tets.T = Eigen::Map<const Tets>(content.tets.front().data(), content.tets.size(), 4);
        const int turned = orient(tets);
        check_faces(tets);
        if (groups) *groups = groups_of(content);
        if (face_groups) *face_groups = face_groups_of(content, tets);
        if (notes) {
            if (content.other_cells > 0)
                notes->push_back(
                    fmt::format("{} points, lines and surface cells left out", content.other_cells));
            if (dropped > 0) notes->push_back(fmt::format("{} nodes without a tetrahedron dropped", dropped));
            if (turned > 0) notes->push_back(fmt::format("{} tetrahedra turned to positive volume", turned));
            notes->insert(notes->end(), content.notes.begin(), content.notes.end());
        }
        return tets;
    } catch (const std::runtime_error& error) {
        throw std::runtime_error(fmt::format("{}: {}", path.string(), error.what()));
    }
}

}  // namespace nbd
