#include "apps/bench/threads/round_work.hpp"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <optional>
#include <stdexcept>

#include "apps/bench/threads/work_recorder.hpp"
#include "apps/cli/load_body.hpp"
#include "apps/dataset/producer.hpp"
#include "collision/base/stopwatch.hpp"
#include "meshing/h5/atomic_file.hpp"
#include "training/calibrate/calibrate.hpp"
#include "training/files/recording.hpp"

namespace nbd {

std::vector<MeasuredTimes> count_rounds(const std::function<void(int threads)>& round, int repeats,
                                        WorkCount& count) {
    std::vector<MeasuredTimes> times;
    for (const int threads : threads_here()) times.push_back({threads, {}});
    std::optional<WorkRecord> record;
    for (int repeat = 0; repeat < repeats; ++repeat) {
        WorkRecord again;
        tbb::task_arena(1).execute([&] {
            WorkRecorder recorder;
            round(1);
            again = recorder.take();
        });
        if (record)
            take_shorter_times(*record, again);
        else
            record = std::move(again);
        for (MeasuredTimes& measured : times) {
            const Stopwatch watch;
            tbb::task_arena(measured.threads).execute([&] { round(measured.threads); });
            measured.seconds.push_back(watch.seconds());
        }
    }
    count.add(record.value());
    return times;
}

void make_dataset_round(const Body& body, int trajectories, int frames, int threads) {
    const h5::ScratchFolder files;
    DatasetPlan plan;
    plan.trajectories = trajectories;
    plan.excitation.frames = frames;
    const ShardFolder folder(files.path() / "poses.h5", plan.trajectories, plan.per_shard);
    check_trajectories(plan, body);
    begin_dataset(folder, plan_json(plan, body));
    Producer producer(body, plan, folder,
                      {.warn = [](const std::string&) {}, .progress = [](int) {}, .stop_if_asked = [] {}});
    const auto all = [](int) { return true; };
    producer.verify(all);
    producer.produce(all, threads, 0);
    if (!producer.merge()) throw std::runtime_error("a file of the dataset was damaged");
}

void make_training_round(const Body& body, const std::filesystem::path& recording,
                         const TrainConfig& config) {
    SurfaceBody surface = surface_body(body);
    const RecordingReader reader(recording);
    FrameSource source(surface.W, reader);
    TreeFile file = train_tree(std::move(surface), source, config);
    if (!file.facts.split.calibration_trajectories.empty()) calibrate(file, source, CalibrateConfig{});
}

}  // namespace nbd
