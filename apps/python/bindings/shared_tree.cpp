#include "apps/python/bindings/shared_tree.hpp"

#include <algorithm>
#include <stdexcept>
#include <vector>

namespace nbd::python {

UsePoses::UsePoses(std::span<PosedTreeObject* const> trees) {
    std::vector<PosingWorld*> worlds;
    for (PosedTreeObject* tree : trees) {
        uses_.emplace_back(tree->lock, "PosedTree");
        PosingWorld* world = tree->world.get();
        if (!world) continue;
        if (std::ranges::find(worlds, world) == worlds.end()) {
            worlds.push_back(world);
            uses_.emplace_back(world->lock, "the World of a PosedTree");
        }
        if (world->changes != tree->world_changes)
            throw std::runtime_error(
                "PosedTree: its world has moved since the pose; call World.begin_pose() again");
    }
}

}  // namespace nbd::python
