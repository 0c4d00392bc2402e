#include "tests/fuzz/readers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

#include "apps/simulate/journal.hpp"
#include "apps/simulate/simulation_frame.hpp"
#include "collision/flat/flat_tree.hpp"
#include "collision/tree/posed_tree.hpp"
#include "meshing/body/body.hpp"
#include "meshing/formats/read_surface.hpp"
#include "meshing/formats/read_tets.hpp"
#include "meshing/h5/inspect.hpp"
#include "sim/excitation/recipe_ranges.hpp"
#include "sim/scene/scene.hpp"
#include "tests/fuzz/memory_meter.hpp"
#include "training/files/dataset_manifest.hpp"
#include "training/files/recording.hpp"
#include "training/files/tree_file.hpp"
#include "training/networks/checkpoint.hpp"

namespace nbd::test {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t longest_message = 2000;
/// Deflate packs at most 1032 to 1, and a reader may hold what it unpacks twice.
constexpr int deflated = 2100;
constexpr int plain = 200;

std::string text_of(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

void read_recording(const fs::path& file) {
    const RecordingReader recording(file);
    Vertices x;
    for (int t = 0; t < std::ssize(recording.trajectories()); ++t) {
        const int frames = recording.trajectories()[t].frames;
        recording.times(t);
        recording.facts(t);
        if (frames > 0) recording.read(t, frames - 1, 1, x);
        if (frames > 0) recording.read_extras(t, 0, 1);
    }
    recording.reactions();
}

/// A tree that loads must bear a pose.
void pose(const CollisionTree& tree, int vertices) {
    const Vertices x = Vertices::Zero(vertices, 3);
    PosedTree posed(std::make_shared<const CollisionTree>(tree), BoundKind::exact);
    posed.begin_pose(x);
}

void read_flat(const fs::path& file) {
    const CollisionTree tree = load_flat_tree(file);
    pose(tree, tree.faces.size() > 0 ? tree.faces.maxCoeff() + 1 : 0);
}

void read_journal(const fs::path& file) {
    Journal journal(file, {}, true);
    while (journal.next()) {
    }
}

void read_checkpoint(const fs::path& file) {
    std::vector<TrainedMlp> networks(3);
    load_checkpoint(file, "key", networks);
}

constexpr std::array list{
    Reader{"obj", ".obj", [](const fs::path& file) { read_surface(file); }, plain},
    Reader{"ply", ".ply", [](const fs::path& file) { read_surface(file); }, plain},
    Reader{"stl", ".stl", [](const fs::path& file) { read_surface(file); }, plain},
    Reader{"off", ".off", [](const fs::path& file) { read_surface(file); }, plain},
    Reader{"glb", ".glb", [](const fs::path& file) { read_surface(file); }, plain},
    Reader{"msh", ".msh", [](const fs::path& file) { read_tets(file); }, plain},
    Reader{"mesh", ".mesh", [](const fs::path& file) { read_tets(file); }, plain},
    Reader{"vtk", ".vtk", [](const fs::path& file) { read_tets(file); }, plain},
    Reader{"vtu", ".vtu", [](const fs::path& file) { read_tets(file); }, deflated},
    Reader{"inp", ".inp", [](const fs::path& file) { read_tets(file); }, plain},
    Reader{"scene", ".json", [](const fs::path& file) { parse_scene(text_of(file), file.parent_path()); },
           plain},
    Reader{"recipe", ".json", [](const fs::path& file) { parse_recipe_ranges(text_of(file)); }, plain},
    Reader{"body", ".h5", [](const fs::path& file) { load_body(file); }, deflated},
    Reader{"recording", ".h5", read_recording, deflated},
    Reader{"dataset", ".h5", [](const fs::path& file) { read_dataset_manifest(file); }, deflated},
    Reader{"tree", ".h5", [](const fs::path& file) { load_tree(file); }, deflated},
    Reader{"flat", ".nbd", read_flat, plain},
    Reader{"journal", ".journal", read_journal, plain},
    Reader{"frame", ".bin", [](const fs::path& file) { frame_from(text_of(file)); }, plain},
    Reader{"checkpoint", ".h5", read_checkpoint, deflated},
    Reader{"inspect", ".h5", [](const fs::path& file) { h5::inspect(file); }, deflated},
};

[[noreturn]] void complain(const Reader& reader, std::string_view what, std::string_view message) {
    fmt::print(stderr, "{}: {}: {}\n", reader.name, what, message);
    std::abort();
}

bool is_accepted(const Reader& reader, const fs::path& file) {
    try {
        reader.read(file);
        return true;
    } catch (const std::bad_alloc&) {
        complain(reader, "takes more memory than there is", "");
    } catch (const std::exception& error) {
        const std::string_view message = error.what();
        if (message.empty()) complain(reader, "no message", message);
        if (message.size() > longest_message) complain(reader, "a message that is too long", message);
        if (message.find('\n') != std::string_view::npos)
            complain(reader, "a message of several lines", message);
        return false;
    }
}

}  // namespace

std::span<const Reader> readers() { return list; }

const Reader* find_reader(std::string_view name) {
    const auto found = std::ranges::find(list, name, &Reader::name);
    return found == list.end() ? nullptr : &*found;
}

bool read_or_refuse(const Reader& reader, const fs::path& file) {
    const std::size_t size = fs::file_size(file);
    const MemoryMeter meter;
    const bool accepted = is_accepted(reader, file);
    if (const std::size_t most = meter.most();
        most > free_memory + static_cast<std::size_t>(reader.memory_per_byte) * size)
        complain(reader, "takes too much memory", fmt::format("{} bytes for a file of {} bytes", most, size));
    return accepted;
}

}  // namespace nbd::test
