#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "tests/apps/command.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd::test {

/// An invalid command line, its exit status, and the text on stderr after "nbdtree: error: ". A text that
/// ends in "..." is only the beginning.
struct Refusal {
    std::string line;
    int status;
    std::string error;
};

/// Tests of commands in a folder with box.obj (108 faces) and box.h5 with 8 modes, made by the command.
class BoxFolder : public ::testing::Test {
 protected:
    static void SetUpTestSuite();
    static void TearDownTestSuite();

    static std::filesystem::path folder();
    static std::string bytes(std::string_view name);

    /// Writes a file in the folder.
    static void write(std::string_view name, std::string_view content);

    static Ran run(std::string_view line, const Environment& environment = {});

    /// Runs a command, which must succeed.
    static void make(std::string_view line);
    /// Runs a command, which must succeed, and returns what it printed, with --json as JSON.
    static std::string text(std::string_view line);
    static nlohmann::json result(const std::string& line);
    /// Runs a command, which must end with `status`, and returns what it printed as error.
    static std::string error(std::string_view line, int status = 1);

    /// The same of `nbdtree-bench`.
    static Ran bench(std::string_view line);
    static nlohmann::json bench_result(const std::string& line);

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
