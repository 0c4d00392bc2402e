#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "tests/apps/command.hpp"
#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd::test {

/// A folder with box.obj (108 faces) and box.h5 with 8 modes, made by the command.
class BoxFolder : public ::testing::Test {
 protected:
    static void SetUpTestSuite() {
        folder_ = std::make_unique<TemporaryFolder>();
        folder_->write("box.obj", obj_file(box(0.4, 0.1, 0.1, 3)));
        make({"mesh", "box.obj", "-o", "box.h5", "-q"});
        make({"modes", "box.h5", "-m", "8", "-q"});
    }
    static void TearDownTestSuite() { folder_.reset(); }

    static std::filesystem::path folder() { return *folder_ / ""; }

    /// Writes a file in the folder.
    static void write(std::string_view name, std::string_view content) { folder_->write(name, content); }

    /// Runs a command, which must succeed.
    static void make(const std::vector<std::string>& arguments) {
        const Ran ran = run(folder(), arguments);
        ASSERT_EQ(ran.status, 0) << ran.err;
    }

 private:
    static inline std::unique_ptr<TemporaryFolder> folder_;
};

/// Adds data.h5 (3 trajectories of 50 frames) and tree.h5.
class SmallFiles : public BoxFolder {
 protected:
    static void SetUpTestSuite() {
        BoxFolder::SetUpTestSuite();
        make({"dataset", "box.h5", "-o", "data.h5", "--trajectories", "3", "--steps-per-frame", "1", "-q"});
        make({"train", "box.h5", "data.h5", "-o", "tree.h5", "--depth", "2", "-m", "8", "-k", "16",
              "--epochs", "5", "--held-out", "0", "--calibration", "0", "-q"});
    }
};

}  // namespace nbd::test
