#include "meshing/formats/read_surface.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "meshing/formats/write_surface.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

using namespace test;

std::vector<std::pair<std::string, std::string>> all_kinds(const TriMesh& mesh) {
    return {{"a.obj", obj_file(mesh)},
            {"a.off", off_file(mesh)},
            {"ascii.ply", ascii_ply_file(mesh)},
            {"little.ply", binary_ply_file(mesh, false)},
            {"big.ply", binary_ply_file(mesh, true)},
            {"ascii.stl", ascii_stl_file(mesh)},
            {"binary.stl", binary_stl_file(mesh)},
            {"a.glb", glb_file(mesh)},
            {"UPPER.OBJ", obj_file(mesh)}};
}

TEST(ReadSurface, ReadsTheSameFacesInOrderFromEveryFormat) {
    const TemporaryFolder folder;
    const TriMesh mesh = as_from_file(torus(1, 0.3, 12, 8));
    for (const auto& [name, content] : all_kinds(mesh)) {
        SCOPED_TRACE(name);
        const TriMesh read = read_surface(folder.write(name, content));
        ASSERT_EQ(read.F.rows(), mesh.F.rows());
        EXPECT_EQ(read.X.rows(), mesh.X.rows()) << "after welding";
        EXPECT_LT((corner_positions(read) - corner_positions(mesh)).cwiseAbs().maxCoeff(), 2e-7);
        EXPECT_EQ(corner_positions(read).cast<float>(), corner_positions(mesh).cast<float>());
    }
}

TEST(ReadSurface, WeldsOnlyEqualPositionsInTinyMeshes) {
    const TemporaryFolder folder;
    const TriMesh mesh = as_from_file(moved(icosphere(3), 0, 0, 0, 1e-6));
    const TriMesh read = read_surface(folder.write("tiny.stl", binary_stl_file(mesh)));
    EXPECT_EQ(read.X.rows(), 642);
    EXPECT_EQ(corner_positions(read), corner_positions(mesh));
}

TEST(ReadSurface, WeldsMinusZeroToZero) {
    const TemporaryFolder folder;
    TriMesh mesh = joined(tetrahedron(), tetrahedron());
    for (double& x : mesh.X.bottomRows(4).reshaped()) x = -x;  // some packets negate 0 to 0
    const TriMesh read = read_surface(folder.write("a.ply", binary_ply_file(mesh, false)));
    ASSERT_TRUE(std::signbit(mesh.X(4, 0)));
    EXPECT_EQ(read.X.rows(), 7);
    EXPECT_EQ(read.F(4, 0), 0);
    EXPECT_FALSE(std::signbit(read.X(0, 0))) << "welding keeps the first of equal positions";
}

TEST(ReadSurface, JoinsGroupsInFileOrder) {
    const TemporaryFolder folder;
    const TriMesh read = read_surface(folder.write("groups.obj",
                                                   "mtllib no_such.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
                                                   "o one\nusemtl A\nf 1 3 2\nusemtl B\nf 1 2 4\n"
                                                   "usemtl A\nf 2 3 4\nl 1 2\ng two\nf 1 4 3\n"));
    Faces expected(4, 3);
    expected << 0, 1, 2, 0, 2, 3, 2, 1, 3, 0, 3, 1;  // numbered in order of first appearance
    EXPECT_EQ(read.F, expected);
    EXPECT_EQ(read.X.rows(), 4);
}

TEST(ReadSurface, ReadsNormalsTextureCoordinatesAndNegativeIndices) {
    const TemporaryFolder folder;
    const TriMesh read =
        read_surface(folder.write("a.obj",
                                  "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvn 0 0 1\nvn 1 0 0\n"
                                  "f 1/1/1 3/2/1 2/1/2\nf -4//1 -3//2 -1//1\nf 2/1 3/2 4/1\nf 1 4 3\n"));
    EXPECT_EQ(read.F.rows(), 4);
    EXPECT_EQ(read.X.rows(), 4);
}

TEST(ReadSurface, AppliesTheTransformsOfNodes) {
    const TemporaryFolder folder;
    const TriMesh mesh = as_from_file(icosphere(0));
    const TriMesh read =
        read_surface(folder.write("a.glb", glb_file(mesh, R"("translation":[10,30,-20],"scale":[2,2,2])")));
    EXPECT_LT((corner_positions(read) - corner_positions(moved(mesh, 10, 20, 30, 2))).cwiseAbs().maxCoeff(),
              1e-5);
}

TEST(ReadSurface, SplitsPolygonsIntoTrianglesInPlace) {
    const TemporaryFolder folder;
    // An L-shaped prism: two non-convex hexagons and six quadrilaterals.
    std::ostringstream text;
    for (const char* z : {"0", "1"})
        for (const char* xy : {"0 0", "2 0", "2 1", "1 1", "1 2", "0 2"})
            text << "v " << xy << ' ' << z << '\n';
    text << "f 6 5 4 3 2 1\nf 7 8 9 10 11 12\n";
    for (int i = 1; i <= 6; ++i) {
        const int j = i % 6 + 1;
        text << "f " << i << ' ' << j << ' ' << j + 6 << ' ' << i + 6 << '\n';
    }
    const TriMesh read = read_surface(folder.write("l.obj", text.str()));
    ASSERT_EQ(read.F.rows(), 2 * 4 + 6 * 2);
    double volume = 0, area = 0;
    for (int f = 0; f < read.F.rows(); ++f) {
        const Eigen::RowVector3d a = read.X.row(read.F(f, 0)), b = read.X.row(read.F(f, 1)),
                                 c = read.X.row(read.F(f, 2));
        volume += a.dot(b.cross(c)) / 6;
        area += (b - a).cross(c - a).norm() / 2;
        EXPECT_EQ(f < 4, a[2] + b[2] + c[2] == 0) << "the first polygon's triangles come first";
    }
    EXPECT_NEAR(volume, 3, 1e-12);
    EXPECT_NEAR(area, 2 * 3 + 8, 1e-12) << "triangles overlap";
}

TEST(ReadSurface, RejectsOtherFilesInOneLine) {
    const TemporaryFolder folder;
    const std::string good = obj_file(tetrahedron());
    const std::vector<std::tuple<std::filesystem::path, std::string>> cases = {
        {folder / "missing.obj", "missing.obj: no such file"},
        {folder / "", ": is a directory, not a surface file"},
        {folder.write("a.xyz", good),
         "a.xyz: unknown kind of surface file \".xyz\"; allowed: .obj .ply .stl .off .glb"},
        {folder.write("none", good), "none: unknown kind of surface file \"\"; allowed: .obj"},
        {folder.write("empty.obj", ""), "empty.obj: the file is empty"},
        {folder.write("points.obj", "# only points\nv 0 0 0\nv 1 0 0\nv 0 1 0\n"), "points.obj: "},
        {folder.write("lines.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2\nl 2 3\n"), "no faces in the file"},
        {folder.write("foreign.stl", "this is not a surface at all"), "foreign.stl: "},
        {folder.write("foreign.glb", "this is not a surface at all"), "foreign.glb: "},
        {folder.write("other.glb", "quick3ds" + std::string(27, '\xff')),
         "other.glb: glTF: the file does not start as a .glb file does"},
        {folder.write("foreign.off", "this is not a surface at all"),
         "foreign.off, line 1: the file does not start with \"OFF\""},
        {folder.write("foreign.ply", "this is not a surface at all\n"), "does not start with \"ply\""},
        {folder.write("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n"),
         "range.obj: line 4: the face refers to vertex 7, but the file has 3 vertices"},
        {folder.write("nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n"),
         "nan.obj: vertex 1 is not finite: (nan, 0, 0)"},
        {folder.write("inf.off", "OFF\n3 1 0\n0 0 0\n1 0 inf\n0 1 0\n3 0 1 2\n"),
         "inf.off: vertex 1 is not finite: (1, 0, inf)"}};
    for (const auto& [path, text] : cases) {
        const std::string error = reading_error(path);
        EXPECT_NE(error.find(text), std::string::npos) << path << ": " << error;
        EXPECT_TRUE(error.starts_with(path.string())) << error;
        EXPECT_EQ(error.find('\n'), std::string::npos) << error;
    }
}

TEST(ReadSurface, ReadsEveryFormatInDoublePrecision) {
    const TemporaryFolder folder;
    TriMesh mesh = tetrahedron();
    mesh.X = (0.1 * mesh.X).rowwise() + Eigen::RowVector3d(500'000, 5'400'000, 300);
    ASSERT_NE(mesh.X, mesh.X.cast<float>().cast<double>());
    const std::string glb =
        glb_file(moved(tetrahedron(), 0, 0, 0, 0.1), R"("translation":[500000,300,-5400000])");
    for (const auto& [name, text] : {std::pair{"a.off", off_file(mesh, 17)},
                                     {"a.ply", ascii_ply_file(mesh, 17)},
                                     {"a.obj", obj_file(mesh, 17)},
                                     {"a.stl", ascii_stl_file(mesh, 17)}})
        EXPECT_EQ(corner_positions(read_surface(folder.write(name, text))), corner_positions(mesh)) << name;
    EXPECT_LT((corner_positions(read_surface(folder.write("a.glb", glb))) - corner_positions(mesh))
                  .cwiseAbs()
                  .maxCoeff(),
              1e-8);
}

TEST(ReadSurface, NeverCrashesOnATruncatedFile) {
    const TemporaryFolder folder;
    const TriMesh mesh = as_from_file(torus(1, 0.3, 6, 5));
    for (const auto& [name, content] : all_kinds(mesh)) {
        SCOPED_TRACE(name);
        const bool knows_its_size = name.ends_with(".glb") || name.ends_with(".ply") ||
                                    name.ends_with(".off") || name == "binary.stl";
        int refused = 0, tried = 0;
        const std::size_t step = content.size() / 120 + 1;
        for (std::size_t size = 0; size + 2 < content.size(); size += step, ++tried) {
            const std::string error = reading_error(folder.write(name, content.substr(0, size)));
            refused += !error.empty();
            EXPECT_EQ(error.find('\n'), std::string::npos) << error;
            EXPECT_TRUE(!error.empty() || !knows_its_size)
                << size << " of " << content.size() << " bytes read";
        }
        EXPECT_GT(tried, 90);
        EXPECT_GT(refused, tried / 3);
    }
}

TEST(ReadSurface, NeverCrashesOnDamagedBytes) {
    const TemporaryFolder folder;
    const TriMesh mesh = as_from_file(torus(1, 0.3, 5, 4));
    std::uint32_t state = 1;
    for (const auto& [name, content] : all_kinds(mesh)) {
        SCOPED_TRACE(name);
        for (int i = 0; i < 60; ++i) {
            std::string damaged = content;
            for (int k = 0; k < 3; ++k) {
                state = state * 1664525u + 1013904223u;
                damaged[state % damaged.size()] = static_cast<char>(state >> 24);
            }
            const std::string error = reading_error(folder.write(name, damaged));
            EXPECT_EQ(error.find('\n'), std::string::npos) << error;
        }
    }
}

TEST(ReadSurface, OpensNoOtherFile) {
    const TemporaryFolder folder;
    ASSERT_EQ(mkfifo((folder / "endless.mtl").c_str(), 0600), 0);  // opening it would wait for a writer
    const std::string text = "mtllib endless.mtl\n" + obj_file(tetrahedron());
    EXPECT_EQ(read_surface(folder.write("a.obj", text)).F.rows(), 4);
}

TEST(WriteSurface, RoundTripsEveryBitOfFloat) {
    const TemporaryFolder folder;
    for (const double scale : {1e-3, 1., 1e4}) {
        const TriMesh mesh = as_from_file(moved(torus(1, 0.3, 20, 10), 0.1, 0.2, 0.3, scale));
        for (const char* name : {"a.obj", "a.ply"}) {
            SCOPED_TRACE(name);
            write_surface(folder / name, mesh.X, mesh.F);
            EXPECT_EQ(corner_positions(read_surface(folder / name)).cast<float>(),
                      corner_positions(mesh).cast<float>());
        }
    }
}

TEST(WriteSurface, LeavesNoFileBehindOnFailure) {
    const TemporaryFolder folder;
    const TriMesh mesh = tetrahedron();
    EXPECT_EQ(error_of([&] { write_surface(folder / "a.fbx", mesh.X, mesh.F); }),
              (folder / "a.fbx").string() + ": unknown kind of surface file; allowed: .obj .ply");
    EXPECT_EQ(
        error_of([&] { write_surface(folder / "no/a.obj", mesh.X, mesh.F); }),
        (folder / "no/a.obj").string() + ": cannot create a file in this folder: No such file or directory");
    std::filesystem::create_directory(folder / "taken.obj");
    EXPECT_NE(error_of([&] { write_surface(folder / "taken.obj", mesh.X, mesh.F); }), "");
    int entries = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder / "")) ++entries;
    EXPECT_EQ(entries, 1);
}

}  // namespace
}  // namespace nbd
