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

void check_output(const std::string& path) {
    namespace fs = std::filesystem;
    const fs::path folder = fs::absolute(path).parent_path();
    if (!fs::is_directory(folder))
        throw std::runtime_error(
            fmt::format("{}: cannot be written: there is no folder {}", path, folder.string()));
    if (access(folder.c_str(), W_OK) != 0)
        throw std::runtime_error(
            fmt::format("{}: cannot be written: no permission in {}", path, folder.string()));
    if (fs::is_directory(path))
        throw std::runtime_error(fmt::format("{}: cannot be written: it is a folder", path));
}

}  // namespace nbd
