#include "apps/train/shared_training.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <system_error>

#include "apps/sharing/claims.hpp"
#include "collision/base/stopwatch.hpp"
#include "meshing/parallel/parallel_for.hpp"
#include "training/networks/checkpoint.hpp"
#include "training/networks/pose_blocks.hpp"

namespace nbd {
namespace {

std::filesystem::path made(const std::filesystem::path& folder) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error)
        throw std::runtime_error(
            fmt::format("{}: cannot create this folder: {}", folder.string(), error.message()));
    return folder;
}

/// What a rank leaves behind that needs the folder no more. It names the run, whose marks stay if it is
/// killed.
std::filesystem::path mark(const std::filesystem::path& folder, const Rank& run, int rank) {
    return folder / fmt::format("left-{}-{}", run.job, rank);
}

/// Networks of one training, in this process and in the shared folder.
class Networks {
 public:
    Networks(const std::filesystem::path& folder, const PoseRows& inputs, const PoseRows& targets,
             const MlpConfig& config, const TrainingHooks& hooks, std::vector<TrainedMlp>& networks)
        : folder_(made(folder)),
          claims_(folder / ".claims"),
          key_(training_key(inputs, targets, config)),
          poses_(inputs, config.arithmetic, config.seed),
          targets_(targets),
          config_(config),
          hooks_(hooks),
          networks_(networks) {}

    bool has(int node) const { return networks_[static_cast<std::size_t>(node)].weights.size() > 0; }

    /// Trains a node's network unless it exists or another process is training it. In the latter case, `wait`
    /// waits until that process finishes it or ends.
    void make(int node, bool wait) {
        if (has(node) || load(node)) return tell();
        const auto held = wait ? claims_.wait_for(node, [&] { stop_if_asked(); }) : claims_.try_claim(node);
        if (!held) return;
        if (!load(node)) {
            const PoseRows own = targets_.middleCols(MlpShape::outputs * node, MlpShape::outputs);
            auto network = train_mlp(poses_, own, config_, static_cast<std::uint64_t>(node), hooks_.cancel);
            if (!network) return;
            std::vector<TrainedMlp> alone(networks_.size());
            alone[static_cast<std::size_t>(node)] = *network;
            save_checkpoint(file(node), key_, alone);
            networks_[static_cast<std::size_t>(node)] = std::move(*network);
        }
        tell();
    }

    void stop_if_asked() const {
        if (hooks_.cancel && hooks_.cancel->load()) throw TrainingCancelled("training was stopped");
    }

 private:
    std::filesystem::path file(int node) const { return folder_ / fmt::format("{:06}.h5", node); }

    bool load(int node) {
        std::vector<TrainedMlp> alone(networks_.size());
        if (load_checkpoint(file(node), key_, alone) == 0) return false;
        networks_[static_cast<std::size_t>(node)] = std::move(alone[static_cast<std::size_t>(node)]);
        return true;
    }

    /// Reports progress: the networks that this process has trained or loaded.
    void tell() {
        if (!hooks_.progress) return;
        const std::lock_guard lock(speaking_);
        TrainingProgress progress{.nodes_done = ++seen_, .nodes = static_cast<int>(networks_.size())};
        progress.seconds = watch_.seconds();
        progress.seconds_left = progress.seconds / seen_ * (progress.nodes - seen_);
        hooks_.progress(progress);
    }

    std::filesystem::path folder_;
    Claims claims_;
    std::string key_;
    PoseBlocks poses_;
    const PoseRows& targets_;
    const MlpConfig& config_;
    const TrainingHooks& hooks_;
    std::vector<TrainedMlp>& networks_;
    std::mutex speaking_;
    int seen_ = 0;
    Stopwatch watch_;
};

}  // namespace

SharedTraining::SharedTraining(std::filesystem::path folder, const Rank& rank)
    : folder_(std::move(folder)), rank_(rank) {}

void SharedTraining::train(const PoseRows& inputs, const PoseRows& targets, const MlpConfig& config,
                           const TrainingHooks& hooks, std::vector<TrainedMlp>& networks) const {
    check_mlp_config(config);
    Networks work(folder_, inputs, targets, config, hooks, networks);
    std::filesystem::remove(
        mark(folder_, rank_, rank_.number));  // a killed run without a name may have left it
    const int nodes = static_cast<int>(networks.size());
    const int start = static_cast<int>(std::int64_t{nodes} * rank_.number / rank_.count);
    // First the networks that no other process has claimed, then the rest.
    for (const bool wait : {false, true}) {
        std::vector<int> missing;
        for (int i = 0; i < nodes; ++i)
            if (const int node = (start + i) % nodes; !work.has(node)) missing.push_back(node);
        parallel_for(
            static_cast<int>(missing.size()),
            [&](int i) { work.make(missing[static_cast<std::size_t>(i)], wait); }, 1);
        work.stop_if_asked();
    }
}

void SharedTraining::leave() const {
    std::ofstream(mark(folder_, rank_, rank_.number)).flush();
    for (int rank = 0; rank < rank_.count; ++rank)
        if (!std::filesystem::exists(mark(folder_, rank_, rank))) return;
    std::error_code another_did;
    std::filesystem::remove_all(folder_, another_did);
}

}  // namespace nbd
