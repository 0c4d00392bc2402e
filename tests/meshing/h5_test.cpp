#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <iostream>
#include <thread>

#include "meshing/h5/inspect.hpp"
#include "meshing/h5/reader.hpp"
#include "meshing/h5/sha256.hpp"
#include "meshing/h5/writer.hpp"
#include "tests/support/edit_file.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"

namespace nbd::h5 {
namespace {

using test::error_of;
using H5Test = test::FileTest;

const Format format{"nbdtree test", 3};

TEST_F(H5Test, VirtualDatasetsNameTheirSource) {
    const std::vector<float> numbers(600, 2.5f);
    {
        Writer source(folder / "source.h5", format), view(folder / "view.h5", format);
        source.write("deep/numbers", {100, 6}, std::span<const float>(numbers));
        source.commit();
        view.write_virtual("numbers", Type::float32, {100, 6}, {"source.h5", "/deep/numbers"});
        view.write("plain", std::vector<int>{1, 2});
        view.commit();
    }
    const Reader view(folder / "view.h5", format);
    EXPECT_FALSE(view.virtual_source("plain"));
    const auto source = view.virtual_source("numbers");
    ASSERT_TRUE(source);
    EXPECT_EQ(source->file, "source.h5");
    EXPECT_EQ(source->dataset, "/deep/numbers");
    EXPECT_EQ(view.check("numbers", Type::float32, {any, 6}), (Shape{100, 6}));
    EXPECT_EQ(Reader(folder / source->file).read<float>(source->dataset, {100, 6}), numbers);
    EXPECT_EQ(error_of([&] {
                  view.read<float>("numbers", {100, 6});
              }),
              (folder / "view.h5").string() +
                  ": virtual dataset 'numbers' stores its numbers in another file; allowed: reading that "
                  "file instead");
    EXPECT_NE(inspect(folder / "view.h5").find("numbers: float32 100 x 6 -> source.h5:/deep/numbers"),
              std::string::npos);

    test::write_bytes(folder / "source.h5", test::read_bytes(folder / "source.h5").substr(0, 3000));
    test::expect_clear(error_of([&] { inspect(folder / "view.h5"); }), folder / "source.h5");
    std::filesystem::remove(folder / "source.h5");
    test::expect_clear(error_of([&] { inspect(folder / "view.h5"); }), folder / "source.h5");
}

TEST_F(H5Test, ReadsNothingOutsideOfTheFilesFolder) {
    std::filesystem::create_directories(folder / "in/shards");
    const auto path = folder / "in/view.h5";
    for (const char* secret : {"secret.h5", "in/shards/shard.h5"}) {
        Writer other(folder / secret, format);
        other.write("numbers", {6}, std::span<const float>(std::vector<float>(6, 1.5f)));
        other.commit();
    }
    const auto view_of = [&](const std::string& source) {
        Writer view(path, format);
        view.write_virtual("numbers", Type::float32, {6}, {source, "/numbers"});
        view.commit();
    };
    const std::string absolute = (folder / "secret.h5").string();
    for (const std::string& source :
         {std::string("../secret.h5"), std::string("shards/../../secret.h5"), absolute}) {
        view_of(source);
        const std::string expected =
            path.string() + ": virtual dataset 'numbers' reads '" + source +
            "', outside of the folder of the file; allowed: sources in that folder or "
            "below";
        EXPECT_EQ(error_of([&] { Reader(path, format).virtual_source("numbers"); }), expected);
        EXPECT_EQ(error_of([&] { inspect(path); }), expected);
    }
    for (const char* source : {"shards/shard.h5", "./shards/../shards/shard.h5"}) {
        view_of(source);
        EXPECT_EQ(error_of([&] { inspect(path); }), "") << source;
    }
    test::EditFile(path).link_elsewhere("linked", "../secret.h5", "/numbers");
    EXPECT_EQ(error_of([&] { Reader(path, format).read<float>("linked", {6}); }),
              path.string() + ": 'linked' is in another file; allowed: a complete file written by nbdtree");
    test::EditFile(path).store_elsewhere("stored", "../secret.h5");
    EXPECT_EQ(
        error_of([&] { Reader(path, format).read<float>("stored", {6}); }),
        path.string() +
            ": the numbers of 'stored' are in another file; allowed: a complete file written by nbdtree");
}

TEST_F(H5Test, RoundTripsNumbersTextsAndAttributes) {
    const auto path = folder / "a.h5";
    std::srand(1);
    const Eigen::MatrixXf column_major = Eigen::MatrixXf::Random(700, 1000);  // spans several chunks
    const Eigen::Vector3d vector(1, -0., 1e-300);
    const std::vector<std::uint64_t> large{0, ~std::uint64_t{0}};
    const std::string long_text = std::string(100000, 'q') + "\nend";
    {
        Writer file(path, format);
        file.write("a/matrix", column_major, Packing::deflate);
        file.write("a/b/vector", vector);
        file.write("a/large", large);
        file.write("empty", std::vector<int>{});
        file.write_text("text", long_text);
        file.write_text("nothing", "");
        file.link("alias", "/a");
        file.attribute("a", "id", -5);
        file.attribute("a", "seed", ~std::uint64_t{0});
        file.attribute("/", "ratio", 0.1f);
        file.attribute("/", "name", "K\u00f6rper");
        file.attribute("/", "none", "");
        file.commit();
    }
    const Reader file(path, format);
    EXPECT_EQ(file.matrix<Eigen::MatrixXf>("a/matrix", 700, 1000), column_major);
    EXPECT_EQ(file.matrix<Eigen::MatrixXf>("alias/matrix", any, any), column_major);
    EXPECT_EQ(file.matrix<Eigen::Vector3d>("a/b/vector", 3), vector);
    EXPECT_EQ(file.read<std::uint64_t>("a/large", {2}), large);
    EXPECT_TRUE(file.read<int>("empty", {any}).empty());
    EXPECT_EQ(file.read_text("text"), long_text);
    EXPECT_EQ(file.read_text("nothing"), "");
    EXPECT_EQ(file.attribute<std::int64_t>("a", "id"), -5);
    EXPECT_EQ(file.attribute<std::uint64_t>("a", "seed"), ~std::uint64_t{0});
    EXPECT_EQ(file.attribute<double>("/", "ratio"), static_cast<double>(0.1f));
    EXPECT_EQ(file.attribute<std::string>("/", "name"), "K\u00f6rper");
    EXPECT_EQ(file.attribute<std::string>("/", "none"), "");
    EXPECT_EQ(file.attribute<std::string>("/", "units"), "m, s, kg");
    EXPECT_EQ(file.children("a"), (std::vector<std::string>{"b", "large", "matrix"}));
    EXPECT_TRUE(file.is_group("a/b"));
    EXPECT_FALSE(file.has("a/none/deep"));
}

/// A damaged length must not be believed: as much would be allocated. The library's checksums find it first.
TEST_F(H5Test, RefusesATextAttributeOfADamagedLength) {
    const auto path = folder / "a.h5";
    constexpr std::uint32_t length = 23456, other = 0x7fffffff;
    {
        Writer file(path, format);
        file.write("a/numbers", std::vector<int>{1});
        file.attribute("a", "name", std::string(length, 'q'));
        file.commit();
    }
    EXPECT_EQ(Reader(path, format).attribute<std::string>("a", "name").size(), length);
    std::string bytes = test::read_bytes(path);
    const std::string stored(reinterpret_cast<const char*>(&length), sizeof length);
    const std::size_t at = bytes.find(stored);
    ASSERT_NE(at, std::string::npos);
    bytes.replace(at, sizeof other, reinterpret_cast<const char*>(&other), sizeof other);
    test::write_bytes(path, bytes);
    const std::string error = error_of([&] { Reader(path, format).attribute<std::string>("a", "name"); });
    test::expect_clear(error, path);
    EXPECT_NE(error.find("damaged"), std::string::npos) << error;
}

TEST_F(H5Test, GrowsSeveralDatasetsInterleaved) {
    const auto path = folder / "a.h5";
    Writer file(path, format);
    const int a = file.begin_growing("a", Type::float32, {2, 3}, 4);
    const int b = file.begin_growing("b", Type::float64, {}, 100);
    std::vector<float> written;
    for (int row = 0; row < 33; ++row) {
        const std::vector<float> values{row + .1f, row + .2f, row + .3f, row + .4f, row + .5f, row + .6f};
        written.insert(written.end(), values.begin(), values.end());
        file.append<float>(a, values);
        const double time = row;
        file.append<double>(b, std::span(&time, 1));
    }
    EXPECT_THROW(file.append<float>(a, std::vector<float>(5)), std::logic_error);
    file.end_growing(a);
    EXPECT_THROW(file.append<float>(a, std::vector<float>(6)), std::logic_error);
    file.commit();

    const Reader reader(path, format);
    EXPECT_EQ(reader.read<float>("a", {33, 2, 3}), written);
    EXPECT_EQ(reader.read<double>("b", {33})[32], 32);
    std::vector<float> some(5 * 6);
    reader.read_rows("a", 6, 5, some.data());
    EXPECT_TRUE(std::equal(some.begin(), some.end(), written.begin() + 6 * 6));
    EXPECT_NE(error_of([&] { reader.read_rows("a", 30, 4, some.data()); }), "");
}

TEST_F(H5Test, HashesStoredData) {
    const std::vector<int> cells(3000000, 7);
    const Eigen::Vector2d x(1, 2);
    Writer file(folder / "a.h5", format);
    file.write("cells", {1500000, 2}, std::span<const int>(cells), Packing::deflate);
    file.write("x", x);
    file.commit();
    Sha256 hash;
    add_dataset(hash, "cells", Type::int32, {1500000, 2}, cells.data());
    add_dataset(hash, "x", Type::float64, {2}, x.data());
    const std::vector<std::string> names{"cells", "x"};
    EXPECT_EQ(content_hash(Reader(folder / "a.h5"), names), hash.hex());
}

TEST_F(H5Test, RejectsForeignFiles) {
    const auto path = folder / "a.h5";
    const auto error = [&] { return error_of([&] { Reader(path, format); }); };
    const std::string ours = "; allowed: a file written by nbdtree";
    EXPECT_EQ(error(), path.string() + ": no such file");
    test::write_bytes(path, "");
    EXPECT_EQ(error(), path.string() + ": is empty" + ours);
    test::write_bytes(path, "solid cube\n");
    EXPECT_EQ(error(), path.string() + ": is not an HDF5 file" + ours);
    test::write_bytes(path, "\x89HDF\r\n\x1a\n");
    EXPECT_EQ(error().find(path.string() + ": is truncated or damaged: "), 0u) << error();
    std::filesystem::remove(path);
    std::filesystem::create_directory(path);
    EXPECT_EQ(error(), path.string() + ": is a folder" + ours);
    std::filesystem::remove(path);
    ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
    EXPECT_EQ(error(), path.string() + ": is not a regular file" + ours);
}

TEST_F(H5Test, PrintsNothingInAnyThread) {
    const auto path = folder / "a.h5";
    test::write_bytes(path, "\x89HDF\r\n\x1a\n");
    std::string errors[2];
    ::testing::internal::CaptureStderr();
    for (std::string& error : errors)
        std::thread([&] { error = error_of([&] { Reader(path, format); }); }).join();
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
    for (const std::string& error : errors) EXPECT_NE(error, "");
}

TEST_F(H5Test, RemovesItsTemporaryFileOnAnException) {
    const std::string error = error_of([&] {
        Writer file(folder / "a.h5", format);
        file.write("x", std::vector<int>(1000));
        file.write("x", std::vector<int>(1000));
    });
    EXPECT_EQ(error, (folder / "a.h5").string() + ": cannot write 'x': name already exists");
    EXPECT_EQ(files_in_folder(), 0u);
}

TEST_F(H5Test, RejectsAnAttributeThatNeedsADataset) {
    Writer file(folder / "a.h5", format);
    EXPECT_EQ(error_of([&] { file.attribute("/", "recipe", std::string(40000, 'x')); }),
              (folder / "a.h5").string() + ": attribute 'recipe' has 40000 bytes; allowed: at most 32768");
}

TEST_F(H5Test, TwoWritersOfOneNameBothSucceed) {
    const auto path = folder / "a.h5";
    Writer a(path, format), b(path, format);
    a.write("x", std::vector<int>{1});
    b.write("x", std::vector<int>{2});
    a.commit();
    EXPECT_EQ(Reader(path, format).read<int>("x", {1})[0], 1);
    b.commit();
    EXPECT_EQ(Reader(path, format).read<int>("x", {1})[0], 2);
    EXPECT_EQ(files_in_folder(), 1u);
}

TEST_F(H5Test, CanBeUsedOnSeveralThreads) {
    const auto work = [&](int id) {
        const auto path = folder / (std::to_string(id) + ".h5");
        std::vector<int> values(5000, id);
        for (int i = 0; i < 10; ++i) {
            Writer file(path, format);
            file.write("x", values, Packing::deflate);
            file.commit();
            EXPECT_EQ(Reader(path, format).read<int>("x", {5000}), values);
        }
    };
    std::thread other(work, 1);
    work(2);
    other.join();
    EXPECT_EQ(files_in_folder(), 2u);
}

/// Writes four datasets of 400 kB and a growing one under a limit on the file size, which acts like a disk
/// with `room` bytes free. Returns the error.
std::string write_into(const std::filesystem::path& path, rlim_t room) {
    test::limit_file_size(room);
    return error_of([&] {
        Writer file(path, format);
        const int growing = file.begin_growing("growing", Type::float32, {100}, 50);
        for (int i = 0; i < 4; ++i) {
            file.write(std::to_string(i) + "/x", std::vector<int>(100000, i));
            for (int k = 0; k < 100; ++k) file.append<float>(growing, std::vector<float>(100));
        }
        file.commit();
    });
}

TEST_F(H5Test, ReportsAFullDiskAtEveryPoint) {
    const auto path = folder / "a.h5";
    const int status = test::in_child([&] {  // the limit applies to the whole process
        const std::string expected = path.string() + ": cannot write: File too large";
        for (rlim_t room = 0; room < 1700000; room += 41234)
            if (const std::string error = write_into(path, room);
                error != expected || files_in_folder() > 0) {
                std::cerr << room << " gave " << error << std::endl;
                std::exit(1);
            }
        std::exit(write_into(path, RLIM_INFINITY).empty() ? 0 : 2);  // HDF5 must be able to shut down
    });
    EXPECT_EQ(status, 0);
    EXPECT_EQ(Reader(path, format).read<int>("3/x", {100000})[99999], 3);
    EXPECT_EQ(files_in_folder(), 1u);
}

}  // namespace
}  // namespace nbd::h5
