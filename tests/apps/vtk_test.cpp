// VTK's readers, which ParaView uses, open the frames of `nbdtree simulate` and find the data of the
// recording.
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/apps/small_files.hpp"

namespace nbd::test {
namespace {

using VtkTest = SmallFiles;

TEST_F(VtkTest, FramesAndSurfacesAgreeWithTheRecording) {
    if (std::system("/usr/bin/python3 -c 'import h5py, vtkmodules.vtkIOXML' 2>/dev/null") != 0)
        GTEST_SKIP() << "/usr/bin/python3 has no vtkmodules (Debian: python3-vtk9) or no h5py";
    write("scene.json", R"({
        "bodies": [{"body": "box.h5", "name": "lower", "transform": {"translate": [0, 0, 0.06]}},
                   {"body": "box.h5", "name": "upper", "transform": {"translate": [0, 0.02, 0.18]},
                    "velocity": [0, 0, -2]}],
        "obstacles": [{"plane": {}}],
        "time": {"dt": 0.002, "frames": 20, "steps_per_frame": 1}})");
    make({"simulate", "scene.json", "-o", "run.h5", "--vtu", "frames", "--obj", "surfaces", "-q"});
    EXPECT_EQ(listing(folder() / "frames").size(), 22u);
    EXPECT_EQ(listing(folder() / "surfaces").size(), 42u);
    const std::string folder_name = folder().string();
    EXPECT_EQ(
        std::system(("cd '" + folder_name +
                     "' && /usr/bin/python3 " NBD_READ_WITH_VTK " run.h5 box.h5 frames surfaces 21 0.002")
                        .c_str()),
        0);
}

}  // namespace
}  // namespace nbd::test
