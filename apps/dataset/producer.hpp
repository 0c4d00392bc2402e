#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "apps/dataset/plan.hpp"
#include "apps/dataset/shard_folder.hpp"
#include "apps/sharing/claims.hpp"
#include "sim/excitation/excitation.hpp"

namespace nbd {

/// What a producer tells its user.
struct ProducerHooks {
    std::function<void(const std::string&)> warn;  // one call at a time, from any thread; so is the next
    std::function<void(int there)> progress;       // trajectories of the dataset that are there
    std::function<void()> stop_if_asked;           // throws where the user wants to stop; several at a time
};

/// Makes the trajectories of a dataset, together with any number of other processes that work in the same
/// folder, at the same time or later. Frames go to the disk as they come.
class Producer {
 public:
    Producer(Body body, const DatasetPlan& plan, ShardFolder folder, ProducerHooks hooks);

    /// Removes files that are damaged, so that they are made anew. mine: which of the shards to look at.
    void verify(const std::function<bool(int shard)>& mine);

    /// Returns once all trajectories with mine(index) are there. Where another process works at one, waits
    /// for it and, should that process end without it, makes it. threads: in all, > 0. start: trajectory to
    /// begin with, so that processes that set out together do not fight for the first one.
    void produce(const std::function<bool(int trajectory)>& mine, int threads, int start);

    /// Writes the merged view unless it is there and true. Returns false where a file turned out to be
    /// damaged and has been removed: produce() again.
    bool merge();

    const std::string& key() const noexcept { return key_; }

 private:
    void warn(const std::string& line);
    void simulate(int index);
    void make(int index, bool wait);
    void finish_shard(int shard);
    /// Removes temporary files of processes that were killed. All is there, so nobody writes any.
    void remove_leftovers() const;
    bool fits(int shard, const std::string& sha256, const std::string& wanted);

    DatasetPlan plan_;
    std::string plan_text_, key_, body_hash_;
    Body body_;
    Excitation excitation_;
    ShardFolder folder_;
    Claims claims_;
    ProducerHooks hooks_;
    std::mutex speaking_, packing_;
};

}  // namespace nbd
