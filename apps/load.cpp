#include "apps/load.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <filesystem>
#include <stdexcept>

namespace nbd {

SurfaceBody surface_body(const Body& body) {
    return make_surface_body(body.surface.X.cast<float>(), body.surface.F, body.W.cast<float>(), body.modes.U,
                             body_hash(body));
}

void check_output(const std::filesystem::path& path, const std::vector<std::filesystem::path>& inputs) {
    namespace fs = std::filesystem;
    const auto fail = [&](const std::string& why) {
        throw std::runtime_error(fmt::format("{}: cannot be written: {}", path.string(), why));
    };
    const fs::path folder = fs::absolute(path).parent_path();
    if (!fs::is_directory(folder)) fail("there is no folder " + folder.string());
    if (access(folder.c_str(), W_OK) != 0) fail("no permission in " + folder.string());
    std::error_code none_there;
    if (!fs::exists(path, none_there)) return;
    if (fs::is_directory(path)) fail("it is a folder");
    if (!fs::is_regular_file(path)) fail("it is a device or the like; allowed: a file");
    for (const fs::path& input : inputs)
        if (fs::equivalent(path, input, none_there)) fail("the command reads this very file");
}

}  // namespace nbd
