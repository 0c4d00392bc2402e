#include "apps/figures/scratch_folder.hpp"

#include <fmt/format.h>
#include <stdlib.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>

namespace nbd {

ScratchFolder::ScratchFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "nbdtree_XXXXXX").string();
    if (!mkdtemp(name.data()))
        throw std::runtime_error(
            fmt::format("{}: cannot create this folder: {}", name, std::strerror(errno)));
    path_ = name;
}

ScratchFolder::~ScratchFolder() {
    std::error_code remains;
    std::filesystem::remove_all(path_, remains);
}

}  // namespace nbd
