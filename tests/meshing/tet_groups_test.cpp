// Groups of tetrahedra, in files that gmsh itself writes.
#include <gmock/gmock.h>
#include <gmsh.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "meshing/formats/read_tets.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

/// A bar of three unit cubes along x: cubes 0 and 2 are the group "two ends", or of no group; the middle is
/// group 7 without a name.
void write_bar(const std::filesystem::path& path, double version, bool binary, bool ends_are_a_group,
               bool save_all) {
    gmsh::initialize(0, nullptr, false);
    gmsh::option::setNumber("General.Terminal", 0);
    gmsh::option::setNumber("Mesh.MeshSizeMin", 0.5);
    gmsh::option::setNumber("Mesh.MeshSizeMax", 0.5);
    gmsh::option::setNumber("Mesh.MshFileVersion", version);
    gmsh::option::setNumber("Mesh.Binary", binary ? 1 : 0);
    gmsh::option::setNumber("Mesh.SaveAll", save_all ? 1 : 0);  // version 2 then loses the groups
    std::vector<std::pair<int, int>> boxes, fragments;
    std::vector<std::vector<std::pair<int, int>>> map;
    for (int i = 0; i < 3; ++i) boxes.emplace_back(3, gmsh::model::occ::addBox(i, 0, 0, 1, 1, 1));
    gmsh::model::occ::fragment({boxes[0]}, {boxes[1], boxes[2]}, fragments, map);
    gmsh::model::occ::synchronize();
    gmsh::model::addPhysicalGroup(3, {map[1][0].second}, 7);
    if (ends_are_a_group) {
        const int ends = gmsh::model::addPhysicalGroup(3, {map[0][0].second, map[2][0].second}, 3);
        gmsh::model::setPhysicalName(3, ends, "two ends");
        gmsh::model::setPhysicalName(2, gmsh::model::addPhysicalGroup(2, {1}, 3), "a face");
    }
    gmsh::model::mesh::generate(3);
    gmsh::write(path.string());
    gmsh::finalize();
}

bool in_middle(const TetMesh& tets, int t) {
    double x = 0;
    for (int a = 0; a < 4; ++a) x += 0.25 * tets.X(tets.T(t, a), 0);
    return x > 1 && x < 2;
}

class TetGroups : public ::testing::TestWithParam<std::pair<double, bool>> {};

TEST_P(TetGroups, AreReadFromGmsh) {
    const test::TemporaryFolder folder;
    const auto path = folder / "bar.msh";
    write_bar(path, GetParam().first, GetParam().second, true, false);
    std::vector<TetGroup> groups;
    std::vector<FaceGroup> faces;
    const TetMesh tets = read_tets(path, nullptr, &groups, &faces);
    ASSERT_EQ(faces.size(), 1u);
    EXPECT_EQ(faces[0].name, "a face");
    const Faces boundary = boundary_faces(tets);
    std::vector<int> on_face;  // gmsh numbers the side of the first box at x = 0 first
    for (int f = 0; f < boundary.rows(); ++f)
        if (tets.X(boundary(f, 0), 0) < 1e-9 && tets.X(boundary(f, 1), 0) < 1e-9 &&
            tets.X(boundary(f, 2), 0) < 1e-9)
            on_face.push_back(f);
    EXPECT_EQ(faces[0].faces, on_face);
    ASSERT_EQ(groups.size(), 2u);
    EXPECT_EQ(groups[0].name, "group 7");
    EXPECT_EQ(groups[1].name, "two ends");
    EXPECT_EQ(groups[0].tets.size() + groups[1].tets.size(), static_cast<std::size_t>(tets.T.rows()));
    for (std::size_t g = 0; g < 2; ++g) {
        EXPECT_GT(groups[g].tets.size(), 10u);
        EXPECT_TRUE(std::ranges::is_sorted(groups[g].tets));
        for (const int t : groups[g].tets) EXPECT_EQ(in_middle(tets, t), g == 0);
    }
}

TEST(TetGroupsOfAPart, AreReadFromGmsh) {
    const test::TemporaryFolder folder;
    const auto path = folder / "bar.msh";
    write_bar(path, 4.1, true, false, true);
    std::vector<TetGroup> groups;
    const TetMesh tets = read_tets(path, nullptr, &groups);
    ASSERT_EQ(groups.size(), 1u);
    for (int t = 0; t < tets.T.rows(); ++t)
        EXPECT_EQ(std::ranges::binary_search(groups[0].tets, t), in_middle(tets, t));
}

INSTANTIATE_TEST_SUITE_P(Gmsh, TetGroups,
                         ::testing::Values(std::pair(2.2, false), std::pair(2.2, true), std::pair(4.1, false),
                                           std::pair(4.1, true)));

TEST(MeditGroups, AreReferenceNumbers) {
    const test::TemporaryFolder folder;
    const std::string text =
        "MeshVersionFormatted 2\nDimension 3\nVertices 5\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 1 1 0\n"
        "Tetrahedra 2\n1 2 3 4 5\n2 5 3 4 9\nEnd\n";
    std::vector<TetGroup> groups;
    read_tets(folder.write("two.mesh", text), nullptr, &groups);
    ASSERT_EQ(groups.size(), 2u);
    EXPECT_EQ(groups[0].name, "group 5");
    EXPECT_EQ(groups[1].tets, std::vector<int>{1});
    std::string alike = text;
    alike.replace(alike.find("4 9"), 3, "4 5");
    read_tets(folder.write("one.mesh", alike), nullptr, &groups);
    EXPECT_TRUE(groups.empty());
}

TEST(GmshGroups, NamesNeedQuotes) {
    const test::TemporaryFolder folder;
    const auto path = folder.write(
        "bad.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 core\n$EndPhysicalNames\n");
    EXPECT_THAT(test::error_of([&] { read_tets(path); }), testing::HasSubstr("expected a name in quotes"));
}

TEST(FaceGroups, AreReadFromMedit) {
    const test::TemporaryFolder folder;
    const auto read = [&](const std::string& triangles) {
        std::vector<FaceGroup> groups;
        const TetMesh tets = read_tets(
            folder.write(
                "a.mesh",
                "MeshVersionFormatted 1\nDimension 3\nVertices 5\n0 0 0 0\n1 0 0 0\n9 9 9 0\n0 1 0 0\n"
                "0 0 1 0\nTriangles " +
                    triangles + "\nTetrahedra 1\n1 2 4 5 0\nEnd\n"),
            nullptr, nullptr, &groups);
        const Faces boundary = boundary_faces(tets);
        std::vector<std::pair<std::string, std::array<int, 3>>> found;
        for (const FaceGroup& group : groups)
            for (const int face : group.faces) found.emplace_back(group.name, sorted_corners(boundary, face));
        return found;
    };
    // Vertex 3 is of no tetrahedron, and one triangle is no face of the boundary.
    EXPECT_THAT(read("4\n1 2 4 7\n2 5 4 7\n1 5 2 0\n1 2 3 8"),
                testing::UnorderedElementsAre(testing::Pair("group 7", testing::ElementsAre(0, 1, 2)),
                                              testing::Pair("group 7", testing::ElementsAre(1, 2, 3))));
    EXPECT_TRUE(read("4\n1 2 4 7\n2 5 4 7\n1 5 2 7\n1 5 4 7").empty());
    EXPECT_NE(test::error_of<std::runtime_error>([&] {
                  read("1\n1 2 6 7");
              }).find("triangle 0 refers to node 6; allowed: 1 to 5"),
              std::string::npos);
}

}  // namespace
}  // namespace nbd
