#include "tests/apps/small_files.hpp"

#include <algorithm>

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

void BoxFolder::expect_refused(const std::vector<Refusal>& cases) {
    for (const Refusal& c : cases) {
        std::string line = "nbdtree";
        for (const std::string& argument : c.arguments) line += ' ' + argument;
        SCOPED_TRACE(line);
        const auto before = listing(folder());
        const Ran ran = run(folder(), c.arguments);
        EXPECT_EQ(ran.status, c.status);
        EXPECT_EQ(ran.out, "");
        std::string error = "nbdtree: error: " + c.error;
        std::string said = ran.err;
        if (error.ends_with("...")) {
            error.resize(error.size() - 3);
            said = said.substr(0, error.size());
        } else {
            error += '\n';
        }
        EXPECT_EQ(said, error);
        EXPECT_EQ(std::ranges::count(ran.err, '\n'), 1) << ran.err;
        EXPECT_LT(ran.err.size(), 400u) << ran.err;
        EXPECT_EQ(listing(folder()), before);
    }
}

}  // namespace nbd::test
