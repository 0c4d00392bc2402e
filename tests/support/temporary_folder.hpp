#pragma once

#include <filesystem>
#include <string_view>

namespace nbd::test {

/// A new folder for the files of one test, removed by the destructor.
class TemporaryFolder {
 public:
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    const std::filesystem::path& path() const noexcept { return path_; }
    std::filesystem::path operator/(std::string_view name) const { return path_ / name; }

    /// Writes a file in the folder and returns its path.
    std::filesystem::path write(std::string_view name, std::string_view content) const;

 private:
    std::filesystem::path path_;
};

}  // namespace nbd::test
