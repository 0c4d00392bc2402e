#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tests/apps/command.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd::test {

/// An invalid command line, its exit status, and the text on stderr after "nbdtree: error: ". A text that
/// ends in "..." is only the beginning.
struct Refusal {
    std::vector<std::string> arguments;
    int status;
    std::string error;
};

/// A folder with box.obj (108 faces) and box.h5 with 8 modes, made by the command.
class BoxFolder : public ::testing::Test {
 protected:
    static void SetUpTestSuite();
    static void TearDownTestSuite();

    static std::filesystem::path folder();

    /// Writes a file in the folder.
    static void write(std::string_view name, std::string_view content);

    /// Runs a command, which must succeed.
    static void make(const std::vector<std::string>& arguments);

    /// Expects one line on stderr, nothing on stdout and no new file in the folder.
    static void expect_refused(const std::vector<Refusal>& cases);

 private:
    static inline std::unique_ptr<TemporaryFolder> folder_;
};

/// Adds data.h5 (3 trajectories of 50 frames) and tree.h5.
class SmallFiles : public BoxFolder {
 protected:
    static void SetUpTestSuite();
};

}  // namespace nbd::test
