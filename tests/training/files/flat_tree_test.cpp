#include "collision/flat/flat_tree.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "collision/flat/crc64.hpp"
#include "collision/flat/flat_file.hpp"
#include "collision/tree/posed_tree.hpp"
#include "tests/collision/wide_tree/hung_surface.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/training/example_tree.hpp"

namespace nbd {
namespace {

using test::error_of;
using Bytes = std::vector<std::byte>;

/// A calibrated tree with all models.
CollisionTree random_tree() { return test::example_tree({}).tree; }

/// A small surface in the tetrahedra of a lattice.
CollisionTree hung_tree() {
    const test::HungSurface hung = test::hung_on_tets(shapes::sphere(5, 6), 2);
    CollisionTree tree = make_exact_tree(hung.surface.X, hung.surface.F, {.depth = 1});
    hang_on_nodes(tree, hung.W, hung.rest);
    return tree;
}

/// A file of about 10 kB, small enough to flip every byte.
Bytes small_file() {
    CollisionTree tree = test::example_tree({.grid = 4, .depth = 1, .modes = 2, .representatives = 4}).tree;
    tree.nbd.reset();
    tree.calibrations.erase(BoundKind::nbd);
    return write_flat_tree(tree);
}

template <class T>
void put(Bytes& file, std::size_t at, T value) {
    std::memcpy(file.data() + at, &value, sizeof value);
}

/// Recomputes the checksum, as if the file had been written with this content.
void renew_checksum(Bytes& file) {
    const std::span<const std::byte> all(file);
    const std::size_t at = offsetof(FlatHeader, checksum);
    put(file, at, crc64(all.subspan(at + 8), crc64(all.first(at))));
}

std::vector<FlatEntry> table_of(const Bytes& file) {
    FlatHeader header;
    std::memcpy(&header, file.data(), sizeof header);
    std::vector<FlatEntry> table(header.arrays);
    std::memcpy(table.data(), file.data() + sizeof header, table.size() * sizeof table[0]);
    return table;
}

/// The file with another entry in its table, and a checksum as if it had been written so.
Bytes with_entry(Bytes file, std::size_t i, const FlatEntry& entry) {
    put(file, sizeof(FlatHeader) + i * sizeof entry, entry);
    renew_checksum(file);
    return file;
}

/// The table's entry of an array.
FlatEntry entry_of(const Bytes& file, std::string_view name) {
    for (const FlatEntry& entry : table_of(file))
        if (entry.name == name) return entry;
    throw std::logic_error("no array " + std::string(name));
}

std::string reading_error(const Bytes& file) {
    return error_of<std::runtime_error>([&] { read_flat_tree(file); });
}

/// The error of a file in which one number of an array has another value.
template <class T>
std::string error_with(Bytes file, std::string_view array, std::size_t index, T value) {
    put(file, entry_of(file, array).offset + index * sizeof(T), value);
    renew_checksum(file);
    return reading_error(file);
}

TEST(Crc64, MatchesTheXzFormat) {
    const std::string text = "123456789";
    const auto bytes = std::as_bytes(std::span(text));
    EXPECT_EQ(crc64(bytes), 0x995dc9bbdf1939fau);
    EXPECT_EQ(crc64(bytes.subspan(4), crc64(bytes.first(4))), crc64(bytes));
}

class FlatTree : public test::FileTest {};

TEST_F(FlatTree, RoundTripsAllModelsBitForBit) {
    CollisionTree with_floats = random_tree();
    with_floats.nbd->networks = test::float_networks(*with_floats.nbd);
    for (const CollisionTree& tree : {random_tree(), with_floats, hung_tree()}) {
        save_flat_tree(folder / "tree.nbd", tree);
        EXPECT_EQ(files_in_folder(), 1u);
        const CollisionTree again = load_flat_tree(folder / "tree.nbd");
        EXPECT_EQ(write_flat_tree(again), write_flat_tree(tree));
        EXPECT_EQ(again.faces, tree.faces);
        ASSERT_EQ(again.calibrations.size(), tree.calibrations.size());
        for (const BoundKind kind : bound_kinds) {
            ASSERT_EQ(has_bounds(again, kind), has_bounds(tree, kind)) << name(kind);
            if (!has_bounds(tree, kind)) continue;
            const bool needs_margin = can_miss(kind) && !tree.calibrations.contains(kind);
            const auto margin = needs_margin ? std::optional(0.f) : std::nullopt;
            PosedTree a(std::make_shared<const CollisionTree>(tree), kind, margin),
                b(std::make_shared<const CollisionTree>(again), kind, margin);
            const Vertices x = Vertices::Random(tree.vertex_count, 3);
            a.begin_pose(x);
            b.begin_pose(x);
            EXPECT_TRUE((a.whole().lo == b.whole().lo).all() && (a.whole().hi == b.whole().hi).all());
            for (int i = 0; !is_box(kind) && i < static_cast<int>(tree.spheres.nodes.size()); ++i) {
                EXPECT_EQ(a.sphere(i).c, b.sphere(i).c) << name(kind) << " of node " << i;
                EXPECT_EQ(a.sphere(i).r, b.sphere(i).r) << name(kind) << " of node " << i;
            }
        }
    }
}

TEST_F(FlatTree, HangsOnTheSameNodesAgain) {
    const CollisionTree tree = hung_tree(), again = read_flat_tree(write_flat_tree(tree));
    ASSERT_TRUE(again.affine);
    EXPECT_EQ(again.affine->rest(), tree.affine->rest());
    EXPECT_EQ(again.affine->rounding(), tree.affine->rounding());
    EXPECT_EQ(again.affine->weights().toDense(), tree.affine->weights().toDense());
    EXPECT_GT(tree.affine->weights().nonZeros(), 2 * tree.vertex_count);
}

TEST_F(FlatTree, RefusesRowsThatTakeNoRoom) {
    const Bytes file = small_file();
    const std::vector<FlatEntry> table = table_of(file);
    for (std::size_t i = 0; i < table.size(); ++i) {
        FlatEntry entry = table[i];
        if (!std::string_view(entry.name).starts_with("topology/")) continue;
        entry.rows = std::numeric_limits<std::int32_t>::max();
        entry.columns = 0;
        EXPECT_NE(reading_error(with_entry(file, i, entry)), "") << entry.name;
    }
    EXPECT_EQ(reading_error(with_entry(file, 1, table[0])), "lists " + std::string(table[0].name) + " twice");
}

TEST_F(FlatTree, ChecksTheWeightsAndNodesBehindAValidChecksum) {
    const Bytes file = write_flat_tree(hung_tree());
    ASSERT_EQ(reading_error(file), "");
    const auto nodes = static_cast<int>(entry_of(file, "affine/rest").rows);
    const auto entries = static_cast<int>(entry_of(file, "affine/weights").rows);
    EXPECT_EQ(error_with(file, "affine/weights", 0, -0.5f),
              "vertex 0 has the weight -0.5; allowed: 0 or more, but for rounding errors");
    EXPECT_NE(error_with(file, "affine/weights", 0, 7.f).find("the weights of vertex 0 sum to "),
              std::string::npos);
    EXPECT_NE(error_with(file, "affine/weights", 0, std::nanf("")).find("vertex 0 has the weight"),
              std::string::npos);
    EXPECT_EQ(error_with(file, "affine/rest", 7, std::numeric_limits<float>::infinity()),
              "the rest position of node 2 is not finite");
    EXPECT_EQ(error_with(file, "affine/columns", 0, nodes),
              "an embedding refers to node " + std::to_string(nodes) + ", but the node count is " +
                  std::to_string(nodes));
    EXPECT_EQ(error_with(file, "affine/columns", 0, -1),
              "an embedding refers to node -1, but the node count is " + std::to_string(nodes));
    EXPECT_NE(error_with(file, "affine/columns", 0, nodes - 1).find("; allowed: ascending"),
              std::string::npos);
    for (const int offset : {-1, entries + 1})
        EXPECT_NE(error_with(file, "affine/row_begin", 1, offset).find("the row offsets of an embedding"),
                  std::string::npos);
    // Wrong numbers anywhere in the new arrays are either harmless or one clear line.
    std::size_t found = 0;
    for (const char* array : {"affine/row_begin", "affine/columns", "affine/weights", "affine/rest"}) {
        const FlatEntry entry = entry_of(file, array);
        for (std::size_t i = 0; i < 4 * entry.rows * entry.columns; ++i) {
            Bytes damaged = file;
            damaged[entry.offset + i] ^= std::byte{0x80};
            renew_checksum(damaged);
            const std::string error = reading_error(damaged);
            found += !error.empty();
            ASSERT_EQ(error.find('\n'), std::string::npos) << error;
        }
    }
    EXPECT_GT(found, 100u);
}

TEST_F(FlatTree, RejectsTheNodesOfAnotherSurface) {
    CollisionTree tree = hung_tree();
    const Bytes file = write_flat_tree(tree);
    const test::HungSurface other = test::hung_on_tets(shapes::sphere(6, 6), 2);
    tree.affine =
        std::make_shared<const AffineModel>(other.surface.F, other.surface.X.rows(), other.W, other.rest);
    EXPECT_NE(test::refusal([&] { write_flat_tree(tree); }), "");
    EXPECT_EQ(error_with(file, "surface/vertex_count", 0, tree.vertex_count + 1),
              "the embedding has " + std::to_string(tree.vertex_count) +
                  " rows; allowed: one for each of the " + std::to_string(tree.vertex_count + 1) +
                  " vertices");
}

TEST_F(FlatTree, LoadsVersion3WhichHasNoAffineBounds) {
    CollisionTree tree = random_tree();
    tree.affine.reset();
    Bytes file = write_flat_tree(tree);
    const Bytes now = file;
    put(file, offsetof(FlatHeader, version), std::uint32_t{3});
    renew_checksum(file);
    EXPECT_EQ(write_flat_tree(read_flat_tree(file)), now);
}

TEST_F(FlatTree, StoresArraysAtTheOffsetsOfItsTable) {
    const CollisionTree tree = random_tree();
    const Bytes file = write_flat_tree(tree);
    FlatHeader header;
    std::memcpy(&header, file.data(), sizeof header);
    EXPECT_EQ(header.bytes, file.size());
    for (const FlatEntry& entry : table_of(file)) EXPECT_EQ(entry.offset % 64, 0u) << entry.name;
    const FlatEntry entry = entry_of(file, "learned_affine/growth");
    const auto& growth = tree.learned_affine->fit().growth;
    EXPECT_STREQ(entry.type, "<f4");
    ASSERT_EQ(entry.rows, growth.size());
    EXPECT_EQ(entry.columns, 1u);
    EXPECT_EQ(std::memcmp(file.data() + entry.offset, growth.data(), entry.rows * sizeof(float)), 0);
}

TEST_F(FlatTree, DetectsEveryFlippedByte) {
    const Bytes whole = small_file();
    ASSERT_EQ(reading_error(whole), "");
    Bytes file = whole;
    for (std::size_t i = 0; i < file.size(); ++i) {
        file[i] ^= std::byte{1} << i % 8;
        const std::string error = reading_error(file);
        ASSERT_NE(error, "") << "byte " << i;
        ASSERT_EQ(error.find('\n'), std::string::npos) << error;
        file[i] = whole[i];
    }
}

TEST_F(FlatTree, DetectsEveryTruncation) {
    const Bytes whole = small_file();
    for (std::size_t size = 0; size < whole.size(); ++size) {
        const std::string error =
            error_of<std::runtime_error>([&] { read_flat_tree(std::span(whole).first(size)); });
        ASSERT_NE(error, "") << size << " bytes";
    }
    Bytes longer = whole;
    longer.resize(whole.size() + 64);
    EXPECT_NE(reading_error(longer).find("according to its header"), std::string::npos);
}

TEST_F(FlatTree, ChecksTheTableBehindAValidChecksum) {
    // A renewed checksum hides the change, so the table of arrays must be checked itself.
    const Bytes whole = small_file();
    const std::size_t table_end = sizeof(FlatHeader) + table_of(whole).size() * sizeof(FlatEntry);
    std::size_t found = 0;
    for (std::size_t i = offsetof(FlatHeader, arrays); i < table_end; ++i)
        for (const auto flip : {std::byte{1}, std::byte{0x80}}) {
            Bytes file = whole;
            file[i] ^= flip;
            renew_checksum(file);
            found += !reading_error(file).empty();
        }
    EXPECT_GT(found, (table_end - sizeof(FlatHeader)) / 2);  // the other bytes are the zeros after a name
}

TEST_F(FlatTree, RejectsForeignFiles) {
    const auto path = folder / "tree.nbd";
    const auto refused = [&](Bytes file) {
        renew_checksum(file);
        test::write_bytes(path, {reinterpret_cast<const char*>(file.data()), file.size()});
        const std::string error = error_of<std::runtime_error>([&] { load_flat_tree(path); });
        test::expect_clear(error, path);
        return error.substr(path.string().size() + 2);
    };
    Bytes version = small_file(), order = version, other = version;
    put(version, offsetof(FlatHeader, version), std::uint32_t{1});
    EXPECT_EQ(refused(version),
              "is a flat tree of version 1; allowed: 3 to 4; write it again with `nbdtree export --flat`");
    put(version, offsetof(FlatHeader, version), std::uint32_t{5});
    EXPECT_EQ(refused(version), "is a flat tree of version 5; allowed: 3 to 4");
    put(order, offsetof(FlatHeader, byte_order), std::uint32_t{0x04030201});
    EXPECT_EQ(refused(order), "has its numbers in another byte order; allowed: little-endian");
    put(other, 0, 'N');
    EXPECT_EQ(refused(other), "is not a flat tree; allowed: files from `nbdtree export --flat`");

    save_tree(path, test::example_tree({}));
    EXPECT_EQ(error_of([&] { load_flat_tree(path); }),
              path.string() + ": is not a flat tree; allowed: files from `nbdtree export --flat`");
    EXPECT_EQ(error_of([&] { load_flat_tree(folder / "none.nbd"); }),
              (folder / "none.nbd").string() + ": no such file");
    EXPECT_EQ(error_of([&] { load_flat_tree(folder); }),
              folder.string() + ": cannot be read: Is a directory");
}

TEST_F(FlatTree, RejectsUnknownAndMissingArrays) {
    // A renamed array is both missing and unknown.
    const auto renamed = [](Bytes file, std::string_view begin, const std::string& becomes) {
        const std::vector<FlatEntry> table = table_of(file);
        for (std::size_t i = 0; i < table.size(); ++i) {
            FlatEntry entry = table[i];
            if (!std::string_view(entry.name).starts_with(begin)) continue;
            std::ranges::copy(becomes, entry.name);
            file = with_entry(std::move(file), i, entry);
        }
        return reading_error(file);
    };
    EXPECT_EQ(renamed(small_file(), "learned_affine/samples", "learned_affine/examples"),
              "has no array learned_affine/samples; allowed: flat trees with all arrays of their version");
    CollisionTree tree = random_tree();
    tree.calibrations.erase(BoundKind::bd);
    EXPECT_EQ(renamed(write_flat_tree(tree), "bd/", "Bd/"),
              "has an unknown array Bd/modes/representatives; allowed: the arrays that this version of the "
              "program knows");
}

TEST_F(FlatTree, ReportsWriteErrors) {
    const CollisionTree tree = random_tree();
    const auto path = folder / "no folder" / "tree.nbd";
    EXPECT_EQ(error_of([&] { save_flat_tree(path, tree); }),
              path.string() + ": cannot create a file in this folder: No such file or directory");
    std::filesystem::create_directory(folder / "taken");
    EXPECT_EQ(error_of([&] { save_flat_tree(folder / "taken", tree); }),
              (folder / "taken").string() + ": is a folder; allowed: the name of a file to write");
    EXPECT_EQ(files_in_folder(), 1u);
    CollisionTree bad = tree;
    bad.faces(0, 0) = tree.vertex_count;
    EXPECT_NE(test::refusal([&] { save_flat_tree(folder / "bad.nbd", bad); }), "");
    EXPECT_EQ(files_in_folder(), 1u);
}

TEST_F(FlatTree, AFailedWriteLeavesTheOldFileAndNoOther) {
    const CollisionTree tree = random_tree();
    const auto path = folder / "tree.nbd";
    test::write_bytes(path, "old");
    ASSERT_GT(write_flat_tree(tree).size(), 20'000u);
    const int status = test::in_child([&] {
        test::limit_file_size(10'000);
        const std::string error = error_of([&] { save_flat_tree(path, tree); });
        if (error != path.string() + ": cannot write: File too large") _exit(1);
    });
    EXPECT_EQ(status, 0);
    EXPECT_EQ(test::read_bytes(path), "old");
    EXPECT_EQ(files_in_folder(), 1u);
    save_flat_tree(path, tree);
    EXPECT_EQ(write_flat_tree(load_flat_tree(path)), write_flat_tree(tree));
    EXPECT_EQ(files_in_folder(), 1u);
}

}  // namespace
}  // namespace nbd
