#include "meshing/surface/face_groups.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <set>
#include <stdexcept>
#include <utility>

#include "meshing/parallel/parallel_for.hpp"
#include "meshing/surface/box_tree.hpp"

namespace nbd {

void check_face_groups(const std::vector<FaceGroup>& groups, int faces) {
    std::set<std::string> names;
    for (const FaceGroup& group : groups) {
        if (group.name.empty()) throw std::invalid_argument("a group of faces has no name");
        if (!names.insert(group.name).second)
            throw std::invalid_argument(
                fmt::format("two groups of faces have the name \"{}\"; allowed: distinct names", group.name));
        int before = -1;
        for (const int face : group.faces) {
            if (face <= before || face >= faces)
                throw std::invalid_argument(
                    fmt::format("group \"{}\" has the face {} after {}; allowed: 0 to {}, ascending",
                                group.name, face, before, faces - 1));
            before = face;
        }
    }
}

std::vector<FaceGroup> groups_on(const TriMesh& to, const TriMesh& from,
                                 const std::vector<FaceGroup>& groups) {
    if (groups.empty()) return {};
    std::vector<BoxTree::Box> boxes(from.F.rows());
    for (Eigen::Index f = 0; f < from.F.rows(); ++f)
        for (const int v : from.F.row(f)) boxes[f].extend(from.X.row(v).transpose());
    const BoxTree tree(std::move(boxes));
    std::vector<int> nearest(to.F.rows());
    parallel_for(static_cast<int>(to.F.rows()), [&](int f) {
        const Eigen::Vector3d centre =
            (to.X.row(to.F(f, 0)) + to.X.row(to.F(f, 1)) + to.X.row(to.F(f, 2))).transpose() / 3;
        const auto corner = [&](int face, int k) -> Eigen::Vector3d { return from.X.row(from.F(face, k)); };
        nearest[f] = tree.nearest(centre,
                                  [&](int face) {
                                      return squared_distance_to_triangle(centre, corner(face, 0),
                                                                          corner(face, 1), corner(face, 2));
                                  })
                         .first;
    });
    std::vector<FaceGroup> result;
    for (const FaceGroup& group : groups) {
        std::vector<char> is_in(from.F.rows(), 0);
        for (const int face : group.faces) is_in[face] = 1;
        FaceGroup mine{.name = group.name, .faces = {}};
        for (std::size_t f = 0; f < nearest.size(); ++f)
            if (is_in[nearest[f]]) mine.faces.push_back(static_cast<int>(f));
        if (!mine.faces.empty()) result.push_back(std::move(mine));
    }
    return result;
}

}  // namespace nbd
