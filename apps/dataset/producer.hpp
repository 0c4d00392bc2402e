#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "apps/dataset/claims.hpp"
#include "apps/dataset/plan.hpp"
#include "apps/dataset/shard_folder.hpp"
#include "apps/dataset/trajectory_source.hpp"
#include "apps/extras/contact_edges.hpp"

namespace nbd {

/// Callbacks of a producer. warn and progress: one call at a time, from any thread.
struct ProducerHooks {
    std::function<void(const std::string&)> warn;  // a warning line
    std::function<void(int there)> progress;       // number of existing trajectories
    std::function<void()> stop_if_asked;           // throws if the user wants to stop; concurrent calls
};

/// Makes the trajectories of a dataset, together with any number of other processes that work in the same
/// folder, at the same time or later. Writes frames to disk as they are simulated.
class Producer {
 public:
    Producer(Body body, const DatasetPlan& plan, ShardFolder folder, ProducerHooks hooks);

    /// Removes damaged files, so that they are made again. mine: the shards to check.
    void verify(const std::function<bool(int shard)>& mine);

    /// Makes all trajectories with mine(index). Waits for those that other processes are making, and makes
    /// them if such a process ends early. threads: in total, > 0. start: first trajectory to try, so that
    /// processes started together do not compete for the same one.
    void produce(const std::function<bool(int trajectory)>& mine, int threads, int start);

    /// Writes the merged view unless it exists and is up to date. Returns false if a damaged file was found
    /// and removed; then call produce() again.
    bool merge();

 private:
    void warn(const std::string& line);
    FrameContents contents() const;
    FrameExtras extras_of(const ExcitedFrame& frame, const Vertices& x, int index,
                          std::optional<ContactEdgeFinder>& finder) const;
    void simulate(int index);
    void tell_starts();
    void make(int index, bool wait);
    void finish_shard(int shard);
    /// Adds the split of the plan's rule; warns instead where failed trajectories leave a part of it empty.
    /// recipes: of the complete trajectories, by their ids.
    void add_split_by_parameter(const std::map<int, std::string>& recipes, DatasetManifest& manifest);
    /// Removes temporary files of killed processes of this machine.
    void remove_leftovers() const;
    bool fits(int shard, const std::string& sha256, const std::string& wanted);

    DatasetPlan plan_;
    std::string plan_text_, key_, body_hash_;
    Body body_;
    std::shared_ptr<const TrajectorySource> source_;
    std::shared_ptr<const CollisionTree> tree_;                  // of the surface
    std::shared_ptr<const ContactEdgeSurface> contact_surface_;  // null unless contact edges are asked for
    ShardFolder folder_;
    Claims claims_;
    ProducerHooks hooks_;
    std::mutex speaking_, packing_;
    // Of trajectories that were made here: overlaps at their starts, why they were drawn again, and what was
    // moved apart.
    std::map<int, std::string> overlaps_, drawn_again_, moved_;
};

}  // namespace nbd
