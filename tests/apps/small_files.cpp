#include "tests/apps/small_files.hpp"

#include <algorithm>

#include "tests/meshing/shapes.hpp"
#include "tests/meshing/surface_files.hpp"
#include "tests/support/file_damage.hpp"

namespace nbd::test {

void BoxFolder::SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    folder_->write("box.obj", obj_file(box(0.4, 0.1, 0.1, 3)));
    make("mesh box.obj -o box.h5 --elements linear -q");
    make("modes box.h5 -m 8 -q");
}

void BoxFolder::TearDownTestSuite() { folder_.reset(); }

std::filesystem::path BoxFolder::folder() { return *folder_ / ""; }

std::string BoxFolder::bytes(std::string_view name) { return read_bytes(folder() / name); }

void BoxFolder::write(std::string_view name, std::string_view content) { folder_->write(name, content); }

Ran BoxFolder::run(std::string_view line, const Environment& environment) {
    return test::run(folder(), line, environment);
}

void BoxFolder::make(std::string_view line) {
    const Ran ran = run(line);
    ASSERT_EQ(ran.status, 0) << line << ": " << ran.err;
}

std::string BoxFolder::text(std::string_view line) {
    const Ran ran = run(line);
    EXPECT_EQ(ran.status, 0) << line << ": " << ran.err;
    return ran.out;
}

nlohmann::json BoxFolder::result(const std::string& line) {
    return nlohmann::json::parse(text(line + " --json"), nullptr, false);
}

std::string BoxFolder::error(std::string_view line, int status) {
    const Ran ran = run(line);
    EXPECT_EQ(ran.status, status) << line << ": " << ran.out << ran.err;
    return ran.err;
}

Ran BoxFolder::bench(std::string_view line) { return Running(folder(), line, NBD_BENCH_COMMAND).wait(); }

nlohmann::json BoxFolder::bench_result(const std::string& line) {
    const Ran ran = bench(line + " --json");
    EXPECT_EQ(ran.status, 0) << line << ": " << ran.err;
    return nlohmann::json::parse(ran.out, nullptr, false);
}

void BoxFolder::expect_refused(const std::vector<Refusal>& cases) {
    for (const auto& [line, status, error] : cases) {
        SCOPED_TRACE("nbdtree " + line);
        const auto before = listing(folder());
        const Ran ran = run(line);
        EXPECT_EQ(ran.status, status);
        EXPECT_EQ(ran.out, "");
        const std::string expected = "nbdtree: error: " + error + '\n';
        if (error.ends_with("..."))
            EXPECT_TRUE(ran.err.starts_with(expected.substr(0, expected.size() - 4))) << ran.err;
        else
            EXPECT_EQ(ran.err, expected);
        EXPECT_EQ(std::ranges::count(ran.err, '\n'), 1) << ran.err;
        EXPECT_LT(ran.err.size(), 400u) << ran.err;
        EXPECT_EQ(listing(folder()), before);
    }
}

void SmallFiles::SetUpTestSuite() {
    BoxFolder::SetUpTestSuite();
    make("dataset box.h5 -o data.h5 --trajectories 3 --steps-per-frame 1 -q");
    make("train box.h5 data.h5 -o tree.h5 --depth 2 -m 8 -k 16 --epochs 5 --held-out 0 --calibration 0 -q");
}

}  // namespace nbd::test
