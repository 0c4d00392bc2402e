#include "apps/bench/threads/scene_work.hpp"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <memory>
#include <optional>
#include <stdexcept>

#include "apps/bench/threads/work_recorder.hpp"
#include "collision/base/stopwatch.hpp"
#include "sim/world/world.hpp"

namespace nbd {
namespace {

/// A world that steps on a number of threads.
class ThreadedWorld {
 public:
    ThreadedWorld(const SceneSpec& spec, std::span<const LoadedBody> bodies, int threads)
        : threads_(threads), arena_(threads) {
        std::vector<StartMove> moves;
        arena_.execute([&] { world_ = std::make_unique<World>(build_world(spec, bodies, &moves)); });
    }

    int threads() const noexcept { return threads_; }
    World& world() noexcept { return *world_; }

    /// Returns the seconds that it takes.
    double step(double dt) {
        WorldReport report;
        double seconds = 0;
        arena_.execute([&] {
            const Stopwatch watch;
            report = world_->step(dt);
            seconds = watch.seconds();
        });
        check(report);
        return seconds;
    }

    WorkRecord recorded_step(double dt) {
        WorldReport report;
        WorkRecord record;
        arena_.execute([&] {
            WorkRecorder recorder;
            report = world_->step(dt);
            record = recorder.take();
        });
        check(report);
        return record;
    }

 private:
    static void check(const WorldReport& report) {
        if (!report.failure.empty())
            throw std::runtime_error(fmt::format("a step failed: {}", report.failure));
    }

    int threads_;
    tbb::task_arena arena_;
    std::unique_ptr<World> world_;
};

bool are_alike(const World& a, const World& b) {
    for (int body = 0; body < a.body_count(); ++body)
        if (a.state(body).x != b.state(body).x || a.state(body).v != b.state(body).v) return false;
    return true;
}

}  // namespace

std::vector<MeasuredTimes> count_scene(const SceneSpec& spec, std::span<const LoadedBody> bodies,
                                       const SceneWorkConfig& config,
                                       const std::function<void(int, int)>& progress, WorkCount& count) {
    const double dt = spec.time.dt;
    const int total = config.skip + config.steps;
    std::vector<std::unique_ptr<ThreadedWorld>> recorded, measured;
    std::vector<MeasuredTimes> times;
    for (int k = 0; k < config.repeats; ++k)
        recorded.push_back(std::make_unique<ThreadedWorld>(spec, bodies, 1));
    for (const int threads : threads_here()) {
        measured.push_back(std::make_unique<ThreadedWorld>(spec, bodies, threads));
        times.push_back({threads, {}});
    }
    // One world goes ahead to where the count begins; all continue from there.
    ThreadedWorld& ahead = *measured.back();
    for (int k = 0; k + 1 < config.skip; ++k) {
        ahead.step(dt);
        progress(k + 1, total);
    }
    const WorldSnapshot start = ahead.world().snapshot();
    for (auto* worlds : {&recorded, &measured})
        for (auto& each : *worlds) {
            if (config.skip > 1) each->world().restore(start);
            each->step(dt);
        }
    for (int k = 0; k < config.steps; ++k) {
        std::optional<WorkRecord> record;
        for (auto& each : recorded) {
            WorkRecord again = each->recorded_step(dt);
            if (record)
                take_shorter_times(*record, again);
            else
                record = std::move(again);
        }
        count.add(*record);
        for (std::size_t m = 0; m < measured.size(); ++m) times[m].seconds.push_back(measured[m]->step(dt));
        for (auto& each : measured)
            if (!are_alike(each->world(), recorded.front()->world()))
                throw std::runtime_error(fmt::format("step {} has other bits on {} threads than on one",
                                                     config.skip + k + 1, each->threads()));
        progress(config.skip + k + 1, total);
    }
    return times;
}

}  // namespace nbd
