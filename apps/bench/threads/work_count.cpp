#include "apps/bench/threads/work_count.hpp"

#include <algorithm>
#include <deque>
#include <queue>
#include <stdexcept>
#include <tuple>

namespace nbd {
namespace {

using Kind = WorkMark::Kind;

/// A loop among the marks: where it begins and ends, and where its own tasks begin.
struct LoopMarks {
    std::size_t begin = 0, end = 0;
    std::vector<std::size_t> tasks;
};

/// All loops of the marks of one; the outermost is the first.
std::vector<LoopMarks> find_loops(std::span<const WorkMark> marks) {
    std::vector<LoopMarks> loops;
    std::vector<std::size_t> open;
    for (std::size_t i = 0; i < marks.size(); ++i) {
        if (marks[i].kind == Kind::begin_loop) {
            open.push_back(loops.size());
            loops.push_back({i, 0, {}});
        } else if (open.empty()) {
            throw std::invalid_argument("work: a task or an end of a loop outside of loops");
        } else if (marks[i].kind == Kind::begin_task) {
            loops[open.back()].tasks.push_back(i);
        } else if (marks[i].kind == Kind::end_loop) {
            loops[open.back()].end = i;
            open.pop_back();
        }
    }
    if (loops.empty() || !open.empty() || loops.front().end + 1 != marks.size())
        throw std::invalid_argument("work: a loop without an end");
    return loops;
}

/// Runs the tasks of a loop and of those inside of it on some threads.
class LoopSchedule {
 public:
    LoopSchedule(std::span<const WorkMark> marks, int threads)
        : marks_(marks), loops_(find_loops(marks)), free_(threads) {
        for (std::size_t k = 0; k < loops_.size(); ++k) loop_at_[loops_[k].begin] = k;
        runs_.resize(loops_.size());
    }

    double run() {
        strands_.push_back({0, 0});
        --free_;
        double now = 0;
        enter_loop(now, 0);
        share_loops(now);
        while (!events_.empty()) {
            const auto [time, order, strand] = events_.top();
            events_.pop();
            now = time;
            act(now, strand);
            share_loops(now);
        }
        return now;
    }

 private:
    /// Follows the marks of a task: `at` is the one that it works for.
    struct Strand {
        std::size_t at, loop;  // loop: whose task it is
    };
    struct Run {
        std::size_t owner = 0, left = 0,
                    next = 0;  // the strand that waits; tasks not done; the next to start
    };

    void act(double now, std::size_t strand) {
        Strand& s = strands_[strand];
        switch (marks_[s.at].kind) {
            case Kind::begin_loop:
                enter_loop(now, strand);
                return;
            case Kind::end_task:
                if (--runs_[s.loop].left > 0)
                    go_on_with(now, s.loop);
                else
                    leave_loop(now, s.loop);
                return;
            default:
                ++s.at;
                work_on(now, strand);
        }
    }

    /// The strand waits for the tasks of the loop at its mark; its thread takes the first.
    void enter_loop(double now, std::size_t strand) {
        const std::size_t loop = loop_at_.at(strands_[strand].at);
        runs_[loop] = {strand, loops_[loop].tasks.size(), 0};
        if (runs_[loop].left == 0) return leave_loop(now, loop);
        shared_.push_back(loop);
        go_on_with(now, loop);
    }

    /// The strand that waited for the loop goes on in the thread that ended its last task.
    void leave_loop(double now, std::size_t loop) {
        if (loop == 0) return;
        const std::size_t owner = runs_[loop].owner;
        strands_[owner].at = loops_[loop].end;
        work_on(now, owner);
    }

    bool has_more(std::size_t loop) const { return runs_[loop].next < loops_[loop].tasks.size(); }

    /// A thread takes the next task of the loop, or becomes free.
    void go_on_with(double now, std::size_t loop) {
        if (!has_more(loop)) {
            ++free_;
            return;
        }
        strands_.push_back({loops_[loop].tasks[runs_[loop].next++], loop});
        work_on(now, strands_.size() - 1);
    }

    /// Free threads take tasks of the loop that began first.
    void share_loops(double now) {
        while (free_ > 0 && !shared_.empty()) {
            const std::size_t loop = shared_.front();
            if (!has_more(loop)) {
                shared_.pop_front();
                continue;
            }
            --free_;
            go_on_with(now, loop);
        }
    }

    void work_on(double now, std::size_t strand) {
        events_.emplace(now + static_cast<double>(marks_[strands_[strand].at].seconds), order_++, strand);
    }

    using Event = std::tuple<double, long, std::size_t>;  // time, order, strand
    std::span<const WorkMark> marks_;
    std::vector<LoopMarks> loops_;
    std::map<std::size_t, std::size_t> loop_at_;
    std::vector<Run> runs_;  // [loops]
    std::vector<Strand> strands_;
    std::deque<std::size_t> shared_;  // loops that may have tasks to start, in the order of their beginning
    std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
    int free_;
    long order_ = 0;
};

/// As LoopSchedule, for a loop without others inside.
double flat_time(std::span<const WorkMark> marks, int threads) {
    std::vector<double> ends;  // of the threads, a heap with the first one on top
    double last = 0;
    for (std::size_t i = 1; i + 1 < marks.size(); i += 2) {
        const double task = static_cast<double>(marks[i].seconds) + static_cast<double>(marks[i + 1].seconds);
        double begin = 0;
        if (std::ssize(ends) == threads) {
            std::ranges::pop_heap(ends, std::greater{});
            begin = ends.back();
            ends.pop_back();
        }
        last = std::max(last, begin + task);
        ends.push_back(begin + task);
        std::ranges::push_heap(ends, std::greater{});
    }
    return last;
}

/// Whether tasks alone lie in the loop, one after the other.
bool is_flat(std::span<const WorkMark> marks) {
    if (marks.size() < 2 || marks.size() % 2 != 0 || marks.front().kind != Kind::begin_loop ||
        marks.back().kind != Kind::end_loop)
        return false;
    for (std::size_t i = 1; i + 1 < marks.size(); ++i)
        if (marks[i].kind != (i % 2 == 1 ? Kind::begin_task : Kind::end_task)) return false;
    return true;
}

}  // namespace

void take_shorter_times(WorkRecord& record, const WorkRecord& other) {
    const auto is_same = [&](const WorkMark& a, const WorkMark& b) {
        return a.kind == b.kind && record.labels.at(a.label) == other.labels.at(b.label);
    };
    if (!std::ranges::equal(record.marks, other.marks, is_same))
        throw std::runtime_error("two runs of the same steps did not do the same work");
    for (std::size_t i = 0; i < record.marks.size(); ++i)
        record.marks[i].seconds = std::min(record.marks[i].seconds, other.marks[i].seconds);
}

double scheduled_time(std::span<const WorkMark> loop, int threads) {
    return is_flat(loop) ? flat_time(loop, threads) : LoopSchedule(loop, threads).run();
}

WorkPlace& WorkCount::at(const std::string& phase, const std::string& place, bool is_loop) {
    const auto [found, is_new] = index_.try_emplace({{phase, place}, is_loop}, places_.size());
    if (is_new) places_.push_back({.phase = phase, .place = place, .is_loop = is_loop});
    return places_[found->second];
}

void WorkCount::add(const WorkRecord& record) {
    const std::span<const WorkMark> marks = record.marks;
    std::string phase = record.labels.at(0), before;
    for (std::size_t i = 0; i < marks.size(); ++i) {
        // What was before this mark, or the end of the loop at it, waits for the loop before and all else.
        WorkPlace& alone = at(phase, before, false);
        for (double& seconds : alone.seconds) seconds += static_cast<double>(marks[i].seconds);
        if (marks[i].kind == Kind::phase) {
            phase = record.labels.at(marks[i].label);
            before.clear();
            continue;
        }
        std::size_t end = i;
        long tasks = 0;
        for (int depth = 0; end < marks.size(); ++end) {
            depth += marks[end].kind == Kind::begin_loop;
            tasks += marks[end].kind == Kind::begin_task;
            if (marks[end].kind == Kind::end_loop && --depth <= 0) break;
        }
        const auto loop = marks.subspan(i, std::min(end + 1, marks.size()) - i);
        before = record.labels.at(marks[i].label);
        WorkPlace& place = at(phase, before, true);
        ++place.loops;
        place.tasks += tasks;
        for (std::size_t k = 0; k < counted_threads.size(); ++k)
            place.seconds[k] += scheduled_time(loop, counted_threads[k]);
        for (double& seconds : at(phase, before, false).seconds)
            seconds += static_cast<double>(loop.back().seconds);
        i = end;
    }
}

}  // namespace nbd
