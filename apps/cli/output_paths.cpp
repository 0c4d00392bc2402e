#include "apps/cli/output_paths.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <map>
#include <stdexcept>
#include <system_error>

#include "collision/base/file_name.hpp"
#include "collision/base/temporary_files.hpp"
#include "meshing/h5/atomic_file.hpp"

namespace nbd {
namespace {

[[noreturn]] void cannot_write(const std::filesystem::path& path, const std::string& why) {
    throw std::runtime_error(fmt::format("{}: cannot be written: {}", path.string(), why));
}

void check_extension(const std::filesystem::path& path, std::string_view extension) {
    if (extension.empty() || has_extension(path, extension)) return;
    const std::string has = path.extension().string();
    cannot_write(path, has.empty() ? fmt::format("its name has no extension; allowed: {}", extension)
                                   : fmt::format("its name ends in {}; allowed: {}", has, extension));
}

}  // namespace

void check_output(const std::filesystem::path& path, const std::vector<std::filesystem::path>& inputs,
                  std::string_view extension) {
    namespace fs = std::filesystem;
    const auto fail = [&](const std::string& why) { cannot_write(path, why); };
    const fs::path folder = fs::absolute(path).parent_path();
    if (!fs::is_directory(folder)) fail("there is no folder " + folder.string());
    if (access(folder.c_str(), W_OK) != 0) fail("no permission in " + folder.string());
    remove_abandoned(path);
    std::error_code none_there;
    if (!fs::exists(path, none_there)) return check_extension(path, extension);
    if (fs::is_directory(path)) fail("it is a folder");
    if (!fs::is_regular_file(path)) fail("it is not an ordinary file; allowed: a file");
    for (const fs::path& input : inputs)
        if (fs::equivalent(path, input, none_there)) fail("the command also reads this file");
    check_extension(path, extension);
}

void check_outputs(const std::vector<OutputFile>& outputs, const std::vector<std::filesystem::path>& inputs) {
    std::vector<std::pair<std::string, std::filesystem::path>> named;
    for (const OutputFile& output : outputs) named.emplace_back(output.what, output.path);
    check_distinct(named);
    for (const OutputFile& output : outputs)
        if (!output.path.empty()) check_output(output.path, inputs, output.extension);
}

void check_output_folder(const std::filesystem::path& path) {
    namespace fs = std::filesystem;
    fs::path there = fs::absolute(path);
    std::error_code none;
    while (!fs::exists(there, none) && there.has_relative_path()) there = there.parent_path();
    if (!fs::is_directory(there, none)) cannot_write(path, there.string() + " is not a folder");
    if (access(there.c_str(), W_OK | X_OK) != 0) cannot_write(path, "no permission in " + there.string());
}

void check_within(const std::filesystem::path& folder, const std::filesystem::path& path,
                  const std::string& what) {
    namespace fs = std::filesystem;
    std::error_code error;
    const fs::path base = fs::weakly_canonical(fs::absolute(folder.empty() ? "." : folder), error),
                   place = fs::weakly_canonical(fs::absolute(path), error);
    const fs::path from_base = place.lexically_relative(base);
    if (error || from_base.empty() || *from_base.begin() == "..")
        cannot_write(path, fmt::format("it is outside of {}, {}", base.string(), what));
}

void check_distinct(const std::vector<std::pair<std::string, std::filesystem::path>>& outputs) {
    std::map<std::filesystem::path, std::string> seen;
    for (const auto& [what, path] : outputs) {
        if (path.empty()) continue;
        std::error_code none;
        const auto place = std::filesystem::weakly_canonical(std::filesystem::absolute(path), none);
        const auto [other, is_new] = seen.emplace(place, what);
        if (!is_new) cannot_write(path, fmt::format("{} and {} are the same file", other->second, what));
    }
}

void write_text(const std::filesystem::path& path, std::string_view text) {
    if (path.empty()) return;
    h5::AtomicFile file(path);
    file.out() << text;
    file.commit();
}

void make_folder(const std::filesystem::path& path) {
    std::error_code error;
    std::filesystem::create_directories(path, error);
    if (error)
        throw std::runtime_error(
            fmt::format("{}: cannot create the directory: {}", path.string(), error.message()));
}

}  // namespace nbd
