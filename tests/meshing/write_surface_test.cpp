#include "meshing/formats/write_surface.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "meshing/formats/read_surface.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd {
namespace {

using namespace test;

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
