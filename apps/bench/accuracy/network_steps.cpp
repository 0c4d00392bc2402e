#include "apps/bench/accuracy/network_steps.hpp"

#include <fmt/format.h>

#include <iterator>

#include "apps/bench/measure/processor_time.hpp"
#include "training/calibrate/calibrate.hpp"

namespace nbd {
namespace {

struct Deviation {
    const char* name;
    void (*add)(TrainConfig& config, const TrainConfig& ours);
};

/// All deviations, in the order in which they are added; the last one makes the default.
constexpr Deviation deviations[] = {
    {"with label frame", [](TrainConfig& c, const TrainConfig& ours) { c.label_frame = ours.label_frame; }},
    {"with linear centre",
     [](TrainConfig& c, const TrainConfig& ours) { c.linear_centre = ours.linear_centre; }},
    {"with weight decay",
     [](TrainConfig& c, const TrainConfig& ours) { c.mlp.weight_decay = ours.mlp.weight_decay; }},
    {"with byte weights",
     [](TrainConfig& c, const TrainConfig& ours) { c.network_numbers = ours.network_numbers; }},
    {"default", [](TrainConfig& c, const TrainConfig& ours) { c.mlp.arithmetic = ours.mlp.arithmetic; }}};

double node_bytes(const NbdModel& model) {
    const auto nodes = static_cast<double>(model.networks.count());
    const auto columns = static_cast<double>(model.centre_map.cols());
    const auto column_bytes = static_cast<double>(sizeof(float)) +
                              static_cast<double>(sizeof(std::int16_t)) *
                                  static_cast<double>(FixedVector::padded(model.centre_map.rows()));
    return (static_cast<double>(model.networks.memory()) + columns * column_bytes) / nodes;
}

NetworkStep train_step(const SurfaceBody& body, FrameSource& source, const TrainConfig& config) {
    double start = 0;
    TrainRun run;
    run.stage = [&](std::string_view stage) {
        if (stage == "clustering modes") start = processor_seconds();
    };
    TreeFile file = train_tree(body, source, config, run);
    NetworkStep step;
    step.processor_seconds = processor_seconds() - start;
    step.node_bytes = node_bytes(*file.tree.nbd);
    step.poses = file.facts.poses;
    calibrate(file, source, {});
    constexpr BoundKind nbd[] = {BoundKind::nbd};
    step.accuracy = measure_accuracy(file, source.recording(), nbd);
    return step;
}

}  // namespace

std::vector<NetworkStep> train_network_steps(const SurfaceBody& body, const RecordingReader& recording,
                                             const TrainConfig& config, bool one_by_one,
                                             const std::function<void(int, int)>& progress) {
    SurfaceBody surface = body;
    surface.solid = {};  // no certified bounds
    FrameSource source(surface.W, recording);
    TrainConfig current = config;
    current.bounds = {BoundKind::nbd};
    const TrainConfig ours = current;
    use_paper_networks(current);
    const int total = one_by_one ? 1 + static_cast<int>(std::size(deviations)) : 2;
    std::vector<NetworkStep> steps;
    const auto train = [&](const char* name) {
        if (progress) progress(static_cast<int>(steps.size()), total);
        steps.push_back(train_step(surface, source, current));
        steps.back().network = name;
    };
    train("paper");
    for (const Deviation& deviation : deviations) {
        deviation.add(current, ours);
        if (one_by_one || &deviation == std::end(deviations) - 1) train(deviation.name);
    }
    return steps;
}

std::string to_csv(const std::string& body, const std::vector<NetworkStep>& steps) {
    std::string text;
    for (const NetworkStep& step : steps)
        for (const Accuracy& accuracy : step.accuracy)
            text += fmt::format("{},{},{},{:.1f},{:.0f},{}\n", body, step.network, step.poses,
                                step.processor_seconds, step.node_bytes, accuracy_cells(accuracy));
    return text;
}

}  // namespace nbd
