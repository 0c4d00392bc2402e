#include "tests/apps/small_files.hpp"

#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"

namespace nbd::test {

void BoxFolder::SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    folder_->write("box.obj", obj_file(box(0.4, 0.1, 0.1, 3)));
    make({"mesh", "box.obj", "-o", "box.h5", "-q"});
    make({"modes", "box.h5", "-m", "8", "-q"});
}

void BoxFolder::TearDownTestSuite() { folder_.reset(); }

std::filesystem::path BoxFolder::folder() { return *folder_ / ""; }

void BoxFolder::write(std::string_view name, std::string_view content) { folder_->write(name, content); }

void BoxFolder::make(const std::vector<std::string>& arguments) {
    const Ran ran = run(folder(), arguments);
    ASSERT_EQ(ran.status, 0) << ran.err;
}

void SmallFiles::SetUpTestSuite() {
    BoxFolder::SetUpTestSuite();
    make({"dataset", "box.h5", "-o", "data.h5", "--trajectories", "3", "--steps-per-frame", "1", "-q"});
    make({"train", "box.h5", "data.h5", "-o", "tree.h5", "--depth", "2", "-m", "8", "-k", "16", "--epochs",
          "5", "--held-out", "0", "--calibration", "0", "-q"});
}

}  // namespace nbd::test
