#include "training/networks/checkpoint.hpp"

#include <fmt/format.h>

#include <span>

#include "meshing/h5/reader.hpp"
#include "meshing/h5/sha256.hpp"
#include "meshing/h5/writer.hpp"

namespace nbd {

namespace {

const h5::Format checkpoint_format{"nbdtree checkpoint", 1};

}  // namespace

std::string training_key(const PoseRows& inputs, const PoseRows& targets, const MlpConfig& c) {
    h5::Sha256 hash;
    const std::string options =
        fmt::format("{} {} {} {} {} {} {} {} {} {} {} {}x{} {}x{}\n", name(c.arithmetic), c.hidden, c.batch,
                    c.learning_rate, c.min_learning_rate, c.weight_decay, c.decay, c.patience, c.improvement,
                    c.max_epochs, c.seed, inputs.rows(), inputs.cols(), targets.rows(), targets.cols());
    hash.add(std::as_bytes(std::span(options)));
    for (const PoseRows* data : {&inputs, &targets})
        hash.add(std::as_bytes(std::span(data->data(), data->size())));
    return hash.hex();
}

void save_checkpoint(const std::filesystem::path& path, const std::string& key,
                     const std::vector<TrainedMlp>& networks) {
    std::vector<int> nodes, epochs;
    std::vector<float> losses, weights;
    for (std::size_t i = 0; i < networks.size(); ++i) {
        const TrainedMlp& network = networks[i];
        if (network.weights.size() == 0) continue;
        nodes.push_back(i);
        epochs.push_back(network.epochs);
        losses.push_back(network.loss);
        weights.insert(weights.end(), network.weights.begin(), network.weights.end());
    }
    if (nodes.empty()) return;
    h5::Writer file(path, checkpoint_format);
    file.attribute("/", "key", key);
    file.write("node", nodes);
    file.write("epochs", epochs);
    file.write("loss", losses);
    file.write("weights", {nodes.size(), weights.size() / nodes.size()}, std::span<const float>(weights));
    file.commit();
}

int load_checkpoint(const std::filesystem::path& path, const std::string& key,
                    std::vector<TrainedMlp>& networks) {
    if (!std::filesystem::exists(path)) return 0;
    const h5::Reader file(path, checkpoint_format);
    if (file.attribute<std::string>("/", "key") != key) return 0;
    const auto nodes = file.read<int>("node", {h5::any});
    const auto epochs = file.read<int>("epochs", {nodes.size()});
    const auto losses = file.read<float>("loss", {nodes.size()});
    const auto weights = file.read<float>("weights", {nodes.size(), h5::any});
    const std::size_t each = nodes.empty() ? 0 : weights.size() / nodes.size();
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (nodes[i] < 0 || nodes[i] >= std::ssize(networks))
            file.refuse(fmt::format("node {}", nodes[i]), fmt::format("0 to {}", networks.size() - 1));
        TrainedMlp& network = networks[nodes[i]];
        network.weights = Eigen::Map<const Eigen::VectorXf>(weights.data() + i * each, each);
        network.loss = losses[i];
        network.epochs = epochs[i];
    }
    return nodes.size();
}

}  // namespace nbd
