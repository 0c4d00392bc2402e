#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <limits>
#include <stdexcept>
#include <vector>

#include "apps/bench/threads/thread_table.hpp"
#include "apps/bench/threads/work_count.hpp"
#include "apps/bench/threads/work_recorder.hpp"
#include "collision/base/stopwatch.hpp"
#include "meshing/parallel/parallel_for.hpp"

namespace nbd {
namespace {

using Kind = WorkMark::Kind;
using Marks = std::vector<WorkMark>;
constexpr int unlimited = std::numeric_limits<int>::max();

Marks operator+(Marks a, const Marks& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

Marks task_of(float seconds) { return {{Kind::begin_task}, {Kind::end_task, 0, seconds}}; }

/// A task that works before and after a loop.
Marks task_around(float before, Marks loop, float after) {
    loop.front().seconds = before;
    return Marks{{Kind::begin_task}} + loop + Marks{{Kind::end_task, 0, after}};
}

Marks loop_of(const std::vector<Marks>& tasks, std::uint16_t label = 0) {
    Marks marks{{Kind::begin_loop, label}};
    for (const Marks& task : tasks) marks = marks + task;
    return marks + Marks{{Kind::end_loop}};
}

std::vector<double> times_on(const Marks& loop, const std::vector<int>& threads) {
    std::vector<double> times;
    for (const int count : threads) times.push_back(scheduled_time(loop, count));
    return times;
}

TEST(ThreadCount, GivesTheNextTaskToWhoIsFree) {
    const Marks long_first = loop_of({task_of(4), task_of(1), task_of(1), task_of(1), task_of(1)});
    EXPECT_THAT(times_on(long_first, {1, 2, 4, unlimited}), testing::ElementsAre(8, 4, 4, 4));
    const Marks long_last = loop_of({task_of(1), task_of(1), task_of(4)});
    EXPECT_THAT(times_on(long_last, {1, 2, 3, unlimited}), testing::ElementsAre(6, 5, 4, 4));
    EXPECT_EQ(scheduled_time(loop_of({}), 4), 0);
}

TEST(ThreadCount, SharesLoopsInsideOfTasks) {
    const Marks inner = loop_of({task_of(1), task_of(1), task_of(1), task_of(1)});
    const Marks even = loop_of({task_around(1, inner, 1), task_around(1, inner, 1)});
    // On four threads, each of two tasks waits until all eight inner ones are done by four.
    EXPECT_THAT(times_on(even, {1, 2, 4, 8, unlimited}), testing::ElementsAre(12, 6, 4, 3, 3));
    const Marks uneven = loop_of({task_of(10), task_around(1, inner, 0)});
    EXPECT_THAT(times_on(uneven, {1, 2, 3, unlimited}), testing::ElementsAre(15, 10, 10, 10));
    const Marks empty_inside = loop_of({task_around(1, loop_of({}), 2), task_of(1)});
    EXPECT_THAT(times_on(empty_inside, {1, 2}), testing::ElementsAre(4, 3));
    // A third level, and one task alone: nothing to share but the innermost loop.
    const Marks deep = loop_of({task_around(1, loop_of({task_around(1, inner, 1)}), 1)});
    EXPECT_THAT(times_on(deep, {1, 2, 4}), testing::ElementsAre(8, 6, 5));
}

/// A step with the phases "" (0), "solve" (1): 1 s, a loop of two tasks of 3 s, 0.5 s; 2 s alone in the
/// solve, a loop of one task of 4 s there, and 1 s after it.
WorkRecord example_record() {
    Marks first = loop_of({task_of(3), task_of(3)}, 2), second = loop_of({task_of(4)}, 3);
    first.front().seconds = 1;
    second.front().seconds = 2;
    return {first + Marks{{Kind::phase, 1, 0.5F}} + second + Marks{{Kind::phase, 0, 1}, {Kind::phase, 0, 0}},
            {"", "solve", "a.cpp:1", "b.cpp:2"}};
}

TEST(ThreadCount, AddsWhatLiesBetweenLoopsAsALongestChain) {
    WorkCount count;
    count.add(example_record());
    count.add(example_record());
    ThreadTimes sum{};
    for (const WorkPlace& place : count.places())
        for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += place.seconds[k];
    EXPECT_THAT(sum, testing::ElementsAre(29, 23, 23, 23, 23, 23));  // twice 1 + 3 + 0.5 + 2 + 4 + 1
    const auto place = [&](const std::string& phase, const std::string& name, bool is_loop) {
        for (const WorkPlace& p : count.places())
            if (p.phase == phase && p.place == name && p.is_loop == is_loop) return p;
        ADD_FAILURE() << phase << ", " << name;
        return WorkPlace{};
    };
    EXPECT_EQ(place("", "", false).seconds[0], 2);
    EXPECT_EQ(place("", "a.cpp:1", true).seconds[0], 12);
    EXPECT_EQ(place("", "a.cpp:1", true).seconds[1], 6);
    EXPECT_EQ(place("", "a.cpp:1", true).loops, 2);
    EXPECT_EQ(place("", "a.cpp:1", true).tasks, 4);
    EXPECT_EQ(place("", "a.cpp:1", false).seconds[3], 1);
    EXPECT_EQ(place("solve", "", false).seconds[3], 4);
    EXPECT_EQ(place("solve", "b.cpp:2", true).seconds[3], 8);
    EXPECT_EQ(place("solve", "b.cpp:2", false).seconds[3], 2);

    const Rows rows = thread_rows("example", count, 2, {{1, {14.5, 14.5}}, {2, {12.5, 12.5}}});
    EXPECT_EQ(rows[0]["kind"], "counted");
    EXPECT_EQ(rows[0]["ms_1"], 14500);
    EXPECT_EQ(rows[0]["ms_16"], 11500);
    EXPECT_EQ(rows[0]["tasks"], 3);
    EXPECT_TRUE(rows[1]["ms_16"].is_null());
    EXPECT_THAT(thread_text(rows), testing::HasSubstr("on 2 threads the count is off by -8 %"));
}

TEST(ThreadCount, RefusesMarksThatAreNotPaired) {
    WorkCount count;
    EXPECT_THROW(count.add({{{Kind::begin_loop}, {Kind::begin_task}, {Kind::end_task}}, {""}}),
                 std::invalid_argument);
    EXPECT_THROW(count.add({{{Kind::end_task}, {Kind::phase}}, {""}}), std::invalid_argument);
}

TEST(ThreadCount, TakesTheShorterTimesOfTheSameWork) {
    WorkRecord record{loop_of({task_of(3), task_of(1)}), {""}};
    take_shorter_times(record, {loop_of({task_of(2), task_of(5)}), {""}});
    EXPECT_EQ(scheduled_time(record.marks, 1), 3);
    EXPECT_THROW(take_shorter_times(record, {loop_of({task_of(2)}), {""}}), std::runtime_error);
    EXPECT_THROW(take_shorter_times(record, {loop_of({task_of(2), task_of(5)}), {"elsewhere"}}),
                 std::runtime_error);
}

TEST(WorkRecorder, RecordsTheTasksOfParallelLoopsAndPhases) {
    WorkRecord record;
    double us = 0;
    tbb::task_arena(1).execute([&] {
        WorkRecorder recorder;
        parallel_for(
            4, [](int) { parallel_for(1, [](int) {}); }, 2);
        timed(us, "solve", [] {
            try {
                parallel_for(3, [](int i) {
                    if (i == 0) throw std::runtime_error("a task fails");
                });
            } catch (const std::runtime_error&) {
            }
        });
        record = recorder.take();
    });
    EXPECT_EQ(work_log(), nullptr);
    std::vector<Kind> kinds;
    for (const WorkMark& mark : record.marks) kinds.push_back(mark.kind);
    const std::vector<Kind> inner{Kind::begin_loop, Kind::begin_task, Kind::end_task, Kind::end_loop};
    std::vector<Kind> expected{Kind::begin_loop};
    for (int task = 0; task < 2; ++task) {
        expected.push_back(Kind::begin_task);
        for (int call = 0; call < 2; ++call) expected.insert(expected.end(), inner.begin(), inner.end());
        expected.push_back(Kind::end_task);
    }
    expected.push_back(Kind::end_loop);
    expected.push_back(Kind::phase);
    expected.insert(expected.end(), inner.begin(), inner.end());
    expected.insert(expected.end(), {Kind::phase, Kind::phase});
    EXPECT_EQ(kinds, expected);
    EXPECT_THAT(record.labels, testing::Contains(testing::StartsWith("tests/bench/threads_test.cpp:")));
    EXPECT_THAT(record.labels, testing::Contains("solve"));
    WorkCount count;
    count.add(record);
    long loops = 0;
    for (const WorkPlace& place : count.places()) loops += place.loops;
    EXPECT_EQ(loops, 2);  // the inner ones belong to the outer one
}

}  // namespace
}  // namespace nbd
