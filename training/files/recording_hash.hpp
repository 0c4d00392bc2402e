#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "training/files/recording.hpp"

namespace nbd {

/// Hashes of what a recording holds.
struct RecordingHash {
    /// Hex SHA-256 over the ids, sizes, failures and positions of all trajectories: identifies the data
    /// whatever file holds them.
    std::string hex;
    std::vector<std::vector<std::uint64_t>> frames{};  // of the positions of each, [trajectories][frames]
};

/// The hash of a sequence, after one more number. Quick, and the same on every machine; it stops no forger.
inline std::uint64_t mixed(std::uint64_t hash, std::uint64_t number) noexcept {
    hash = (hash ^ number) * 0x9E3779B97F4A7C15u;
    return hash ^ hash >> 32;
}

/// Reads the whole recording in pieces. seen: receives the nodes of `count` frames from frame `begin` of each
/// piece, [count * N, 3], in order; may be empty. Throws what RecordingReader::read and `seen` throw.
RecordingHash hash_recording(
    const RecordingReader& recording,
    const std::function<void(int trajectory, int begin, int count, const Vertices& nodes)>& seen = {});

/// Trajectories that a tree has learned from, so that they are known in other files as well.
struct SeenTrajectories {
    std::vector<std::uint64_t> frames{};   // of the positions of each, ascending
    std::vector<std::uint64_t> origins{};  // hashes of seed, number and recipe, ascending
    bool operator==(const SeenTrajectories&) const = default;
};

/// Of the trajectories with these ids. hashes: of the recording.
SeenTrajectories seen_trajectories(const RecordingReader& recording, const RecordingHash& hashes,
                                   std::span<const int> ids);

/// Ids of the recording's trajectories that are among the seen ones, ascending: more than half of whose
/// frames are, whatever their order and number, or that have the seed, the number and the recipe of a seen
/// one, whatever surface carries them now. Trajectories without a recipe are known by their frames alone.
std::vector<int> known_trajectories(const RecordingReader& recording, const RecordingHash& hashes,
                                    std::span<const SeenTrajectories* const> seen);

/// Tells in one line, as a notice, that these trajectories of the recording are left out.
void tell_left_out(const RecordingReader& recording, std::span<const int> ids, const char* use);
/// Likewise that it cannot be told whether the tree has learned from them.
void tell_unknown(const RecordingReader& recording);

}  // namespace nbd
