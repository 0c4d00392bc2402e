#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <string>

#include "tests/support/temporary_folder.hpp"

// Helpers for tests of file formats.
namespace nbd::test {

/// Gives each test its own folder.
class FileTest : public ::testing::Test {
 private:
    TemporaryFolder own_;

 protected:
    std::size_t files_in_folder() const;

    const std::filesystem::path folder = own_.path();
};

/// `text` with the first `from` replaced, which it must hold.
std::string replaced(std::string text, const std::string& from, const std::string& to);

std::string read_bytes(const std::filesystem::path& path);

void write_bytes(const std::filesystem::path& path, const std::string& bytes);

/// Expects one line that begins with the path of the file.
void expect_clear(const std::string& error, const std::filesystem::path& path);

/// Truncates the file at `cuts` random places and changes one byte at `flips` random places. `load` returns
/// the content as text; for each damaged file it must throw one clear line or return the original content.
void expect_damage_is_found(const std::filesystem::path& file,
                            const std::function<std::string(const std::filesystem::path&)>& load,
                            int cuts = 60, int flips = 250);

/// Runs `action` in a process of its own, which ends with status 0 if the action returns. Returns the status.
int in_child(const std::function<void()>& action);

/// From now on writes beyond so many bytes of a file fail, as on a full disk. Holds for the whole process.
void limit_file_size(std::size_t bytes);

}  // namespace nbd::test
