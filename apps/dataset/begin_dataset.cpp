#include "apps/dataset/begin_dataset.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "apps/dataset/plan.hpp"
#include "collision/base/file_text.hpp"
#include "meshing/h5/atomic_file.hpp"
#include "training/files/dataset_manifest.hpp"

namespace nbd {

void begin_dataset(const ShardFolder& folder, const std::string& plan) {
    const auto refuse_other = [&](const std::string& there) {
        const std::string difference = plan_difference(there, plan);
        if (!difference.empty())
            throw std::runtime_error(
                fmt::format("{}: was started with {}; allowed: the same options, or another name",
                            folder.view().string(), difference));
    };
    if (folder.path() == folder.view())
        throw std::runtime_error(
            fmt::format("{}: this is the name of the folder for the frames; allowed: another extension",
                        folder.view().string()));
    if (std::filesystem::exists(folder.plan())) {
        try {
            refuse_other(file_text(folder.plan()));
        } catch (const std::invalid_argument& error) {
            throw std::runtime_error(fmt::format("{}: {}", folder.plan().string(), error.what()));
        }
        return;
    }
    if (is_dataset_view(folder.view()))
        refuse_other(read_dataset_manifest(folder.view()).plan);
    else if (std::filesystem::exists(folder.view()))
        throw std::runtime_error(fmt::format(
            "{}: already exists and is not a dataset that can be continued; allowed: another name",
            folder.view().string()));
    std::error_code error;
    std::filesystem::create_directories(folder.path(), error);
    if (error)
        throw std::runtime_error(
            fmt::format("{}: cannot create this folder: {}", folder.path().string(), error.message()));
    h5::AtomicFile file(folder.plan());
    file.out() << plan;
    file.commit();
}

}  // namespace nbd
