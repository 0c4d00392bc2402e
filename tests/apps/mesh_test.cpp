#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "meshing/body/body.hpp"
#include "tests/apps/small_files.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"

namespace nbd {
namespace {

using Mesh = test::BoxFolder;

/// A tetrahedron with another on one of its faces; `height` is that of the other.
std::string two_tetrahedra(double height) {
    const double at = (1 + height) / 3;
    return fmt::format(
        "MeshVersionFormatted 2\nDimension 3\nVertices\n5\n"
        "0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n{0} {0} {0} 0\n"
        "Tetrahedra\n2\n1 2 3 4 0\n2 3 4 5 0\nEnd\n",
        at);
}

TEST_F(Mesh, WarnsOfTetrahedraThatMakeStepsStiff) {
    write("flat.mesh", two_tetrahedra(0.02));
    const test::Ran flat = run("mesh flat.mesh -o flat.h5 --json");
    EXPECT_EQ(flat.status, 0) << flat.err;
    EXPECT_THAT(flat.err,
                testing::StartsWith("nbdtree: warning: 1 of 2 tetrahedra have a radius ratio below 0.1, "
                                    "the worst is tetrahedron 1 with "));
    EXPECT_EQ(nlohmann::json::parse(flat.out)["slivers"], 1);

    write("good.mesh", two_tetrahedra(1));
    const test::Ran good = run("mesh good.mesh -o good.h5 --json");
    EXPECT_EQ(good.status, 0) << good.err;
    EXPECT_THAT(good.err, testing::Not(testing::HasSubstr("radius ratio")));
    EXPECT_EQ(nlohmann::json::parse(good.out)["slivers"], 0);
}

TEST_F(Mesh, KeepsGroupsOfTetrahedraAsRegions) {
    EXPECT_THAT(text("mesh " NBD_ASSETS "/block.mesh -o block.h5 --law stable_neo_hookean "
                     "--region 'group 2:young=5e6,density=700'"),
                testing::HasSubstr("region \"group 1\": 300 tetrahedra"));
    const Body body = load_body(folder() / "block.h5");
    EXPECT_EQ(body.material.law, MaterialLaw::stable_neo_hookean);
    ASSERT_EQ(body.regions.size(), 2U);
    EXPECT_EQ(body.regions[0].material, body.material);
    EXPECT_EQ(body.regions[1].name, "group 2");
    EXPECT_EQ(body.regions[1].tets.size(), 450U);
    EXPECT_EQ(body.regions[1].material.young, 5e6);
    EXPECT_EQ(body.regions[1].material.density, 700);
    EXPECT_EQ(body.regions[1].material.law, MaterialLaw::stable_neo_hookean);
    // Another surface in the same tetrahedra, and their boundary as surface, keep the regions.
    write("small.obj",
          "v -0.1 -0.1 -0.1\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
    for (const char* line : {"mesh small.obj -o x.h5 --inside block.h5", "mesh block.h5 -o x.h5"}) {
        make(line);
        EXPECT_TRUE(load_body(folder() / "x.h5").regions == body.regions);
    }
}

TEST_F(Mesh, TellsTheFiguresOfACage) {
    write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 2 3 4\n");
    const auto said = result("mesh open.obj -o open.h5 --cage 300");
    const auto& cage = said["cage"];
    EXPECT_GT(cage["faces"], 100);
    EXPECT_EQ(cage["faces"].get<int>(), 2 * cage["vertices"].get<int>() - 4);  // a closed shape without holes
    EXPECT_NEAR(cage["volume"].get<double>(), said["volume"].get<double>(), 1e-12);
    EXPECT_GE(cage["distance"], cage["offset"]);
    EXPECT_LT(cage["distance"], 0.5);
    EXPECT_EQ(cage["defects"]["duplicate_faces"], 1);
    EXPECT_EQ(cage["defects"]["open_edges"], 2);
    EXPECT_EQ(cage["defects"]["crowded_edges"], 2);
    EXPECT_EQ(cage["defects"]["shells"], 1);
    EXPECT_FALSE(result("mesh box.obj -o closed.h5").contains("cage"));
}

/// From CAD's twelve triangles.
TEST_F(Mesh, FindsQuadraticTetrahedraThatBendRightly) {
    write("bar.obj", test::obj_file(test::box(1, 0.1, 0.1, 1)));
    const auto coarse = result("mesh bar.obj -o coarse.h5 --elements linear");
    EXPECT_GT(coarse["bending_error"], 0.9);
    const auto usual = result("mesh bar.obj -o usual.h5");
    EXPECT_LE(usual["bending_error"], 0.03);
    EXPECT_EQ(result("mesh bar.obj -o same.h5 --error 0.03")["body_sha256"], usual["body_sha256"]);
    for (const char* told : {"--nodes 8", "--grading 0.2", "--edge 0.05", "--elements quadratic"})
        EXPECT_NE(result("mesh bar.obj -o told.h5 " + std::string(told))["body_sha256"], usual["body_sha256"])
            << told;
    const auto said = result("mesh bar.obj -o bar.h5 --error 0.05");
    EXPECT_LE(said["bending_error"], 0.05);
    EXPECT_EQ(said["faces"], 12) << "the file's triangles are the collision surface";
    EXPECT_NEAR(said["volume"].get<double>(), 0.01, 1e-8);
    const Body body = load_body(folder() / "bar.h5");
    EXPECT_TRUE(body.tets.is_quadratic());
    EXPECT_EQ(body.bending_error, said["bending_error"].get<double>());
    // Other commands take it as any body.
    make("modes bar.h5 -m 4");
    make("mesh bar.h5 -o its_boundary.h5");
    EXPECT_TRUE(load_body(folder() / "its_boundary.h5").tets.is_quadratic());
    EXPECT_THAT(error("mesh bar.h5 -o linear.h5 --elements linear"),
                testing::HasSubstr("bar.h5: its tetrahedra are quadratic and cannot become linear"));
}

/// Tetrahedra around a finer, round surface hold it, so that bounds by nodes are sure, and have its mass.
TEST_F(Mesh, HoldsARoundSurfaceInTetrahedraOfItsMass) {
    const TriMesh ball = test::icosphere(3);
    write("ball.obj", test::obj_file(ball));
    double volume = 0;
    for (const auto& f : ball.F.rowwise())
        volume +=
            Eigen::Vector3d(ball.X.row(f[0])).cross(Eigen::Vector3d(ball.X.row(f[1]))).dot(ball.X.row(f[2])) /
            6;
    for (const char* how : {"", " --edge 0.7", " --edge 0.7 --elements quadratic"}) {
        const auto said = result("mesh ball.obj -o ball.h5" + std::string(how));
        EXPECT_GT(said["volume"], volume) << how;
        const Body body = load_body(folder() / "ball.h5");
        EXPECT_EQ(body.surface.F.rows(), ball.F.rows());
        EXPECT_GT(body.W.coeffs().minCoeff(), -1e-9) << how;
        double filled = 0;
        for (int t = 0; t < body.tets.T.rows(); ++t)
            filled += nbd::volume(body.tets, t) * body.tets.filled(t);
        EXPECT_NEAR(filled, volume, 1e-3 * volume) << how;
        EXPECT_TRUE(said.contains("bending_error"));
    }
    write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n");
    EXPECT_THAT(error("mesh open.obj -o open.h5"), testing::HasSubstr("--cage takes any surface as it is"));
}

TEST_F(Mesh, KeepsGroupsOfFacesHoweverTheSurfaceIsMeshed) {
    const TriMesh bar = test::box(1, 0.1, 0.2, 1);
    std::string text = test::obj_file({bar.X, Faces(0, 3)});
    for (const bool is_end : {false, true}) {
        text += is_end ? "g end\n" : "g sides\n";
        for (int f = 0; f < bar.F.rows(); ++f)
            if ((bar.X(bar.F(f, 0), 0) + bar.X(bar.F(f, 1), 0) + bar.X(bar.F(f, 2), 0) == 0) == is_end)
                text += fmt::format("f {} {} {}\n", bar.F(f, 0) + 1, bar.F(f, 1) + 1, bar.F(f, 2) + 1);
    }
    write("bar.obj", text);
    for (const char* how : {"", " --elements rigid --scale 3", " --edge 0.04", " --subdivide 2",
                            " --cage 100", " --elements quadratic"}) {
        SCOPED_TRACE(how);
        make("mesh bar.obj -o bar.h5" + std::string(how));
        const Body body = load_body(folder() / "bar.h5");
        ASSERT_EQ(body.face_groups.size(), 2u);
        EXPECT_EQ(body.face_groups[0].name, "sides");
        EXPECT_EQ(body.face_groups[0].faces.size() + body.face_groups[1].faces.size(),
                  static_cast<std::size_t>(body.surface.F.rows()));
        for (const int f : body.face_groups[1].faces)
            for (const int vertex : body.surface.F.row(f)) EXPECT_LT(body.surface.X(vertex, 0), 1e-6);
    }
    make("mesh bar.h5 -o again.h5");
    EXPECT_EQ(load_body(folder() / "again.h5").face_groups.size(), 2u);
}

TEST_F(Mesh, TakesAnEdgeLengthForBothKindsOfElements) {
    write("bar.obj", test::obj_file(test::box(1, 0.1, 0.1, 1)));
    const auto linear = result("mesh bar.obj -o linear.h5 --edge 0.05"),
               quadratic = result("mesh bar.obj -o quadratic.h5 --edge 0.05 --elements quadratic");
    EXPECT_EQ(linear["tets"], quadratic["tets"]);
    EXPECT_GT(quadratic["nodes"], 4 * linear["nodes"].get<int>());
    EXPECT_LT(quadratic["bending_error"], 0.2 * linear["bending_error"].get<double>());
    write("ball.obj", test::obj_file(test::icosphere(2)));
    EXPECT_THAT(
        error("mesh ball.obj -o x.h5 --edge 50"),
        testing::HasSubstr("ball.obj: with edges of 50 m: triangles with edges of 50 m do not follow the "
                           "surface; choose a shorter edge, or --cage N"));
    EXPECT_THAT(error("mesh bar.obj -o x.h5 --edge 1e-7"), testing::HasSubstr("longer edges need less"));
    write("sheet.obj", test::obj_file(test::box(1, 1, 0.01, 1)));
    const auto caged = result("mesh sheet.obj -o caged.h5 --error 0.05");
    EXPECT_LE(caged["bending_error"], 0.05);
    EXPECT_NEAR(caged["cage"]["material"].get<double>(), 0.01, 1e-4) << "not the volume of the cage";
    EXPECT_GT(caged["cage"]["volume"], 0.02);
    EXPECT_FALSE(caged["cage"]["wraps_solid"]);
    const TriMesh apart = test::joined(test::tetrahedron(), test::moved(test::tetrahedron(), 100, 0, 0));
    write("apart.obj", test::obj_file(apart));
    EXPECT_THAT(
        error("mesh apart.obj -o x.h5 --error 0.05"),
        testing::HasSubstr("no cage of at most 8000 tetrahedra bends to an error of 0.05: the surface "
                           "falls into 2 parts"));
}

TEST_F(Mesh, RefusesSurfacesThatNeedMoreMemoryThanThereIs) {
    constexpr std::int64_t faces = 4'000'000'000, vertices = faces / 2;
    const std::string ply = fmt::format(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
        "property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices, faces);
    write("huge.ply", ply);
    write("huge.off", fmt::format("OFF\n{} {} 0\n", vertices, faces));
    for (const char* name : {"huge.ply", "huge.off"})  // sparse: the disk holds no more than the header
        std::filesystem::resize_file(folder() / name, 20 * faces);
    for (const std::string name : {"huge.ply", "huge.off"}) {
        const std::string said = error("mesh " + name + " -o huge.h5 --cage 500");
        EXPECT_THAT(said, testing::StartsWith(fmt::format(
                              "nbdtree: error: {}: reading it takes about 596.0 GiB of memory, but ", name)));
        EXPECT_EQ(std::ranges::count(said, '\n'), 1);
        EXPECT_FALSE(std::filesystem::exists(folder() / "huge.h5"));
    }
    write("short.ply", ply);  // too short for what its header says
    EXPECT_THAT(error("mesh short.ply -o x.h5 --cage 500"), testing::HasSubstr("the file ends early"));
}

}  // namespace
}  // namespace nbd
