#pragma once

#include <cstdint>
#include <filesystem>

namespace nbd {

/// About how many faces a surface file (.obj .ply .stl .off .glb) holds, without reading it into memory: by
/// its header (.ply .off, binary .stl), a count of its face lines (.obj), else by its size; never more than a
/// file of its size can hold. 0 for a file that cannot be read; read_surface() says why.
std::uint64_t estimate_faces(const std::filesystem::path& path);

}  // namespace nbd
