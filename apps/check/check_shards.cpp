#include "apps/check/check_shards.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <string>

#include "meshing/h5/sha256.hpp"
#include "meshing/progress/progress.hpp"

namespace nbd {

void check_shards(const std::filesystem::path& view, const DatasetManifest& manifest) {
    const auto all = static_cast<double>(manifest.shards.size());
    for (double done = 0; const DatasetShard& shard : manifest.shards) {
        tell_progress("files", done++, all);
        if (const std::string is = h5::file_sha256(view.parent_path() / shard.file); is != shard.sha256)
            throw std::runtime_error(
                fmt::format("{}: shard {} has SHA-256 {}; allowed: {}, as in the manifest", view.string(),
                            shard.file, is, shard.sha256));
    }
}

}  // namespace nbd
