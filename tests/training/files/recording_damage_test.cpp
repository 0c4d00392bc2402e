#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>

#include "tests/support/edit_file.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/training/files/example_recording.hpp"
#include "training/files/recording_hash.hpp"

namespace nbd {
namespace {

using test::EditFile;
using test::write_recording;
using RecordingFile = test::FileTest;

std::string read_recording(const std::filesystem::path& path) {
    const RecordingReader file(path);
    std::ostringstream text;
    text << hash_recording(file).hex;
    for (int i = 0; const TrajectoryInfo& t : file.trajectories()) {
        text << t.id << t.seed << t.body_hash << t.recipe << t.failure << t.frames;
        for (const double time : file.times(i++)) text << time << ' ';
    }
    return text.str();
}

TEST_F(RecordingFile, DetectsRandomDamage) {
    write_recording(folder / "data.h5", 12);  // more than fit into the header of an HDF5 group
    test::expect_damage_is_found(folder / "data.h5", read_recording);
}

class BrokenRecordingFile : public RecordingFile, public ::testing::WithParamInterface<test::BrokenFile> {};

TEST_P(BrokenRecordingFile, IsRejectedInOneLine) {
    const auto path = folder / "data.h5";
    write_recording(path, 2);
    test::expect_refused(path, GetParam(), [](const auto& file) { read_recording(file); });
}

constexpr const char* second = "trajectories/000001";

const test::BrokenFile broken_recordings[] = {
    {"is a file of format 'nbdtree body'; allowed: 'nbdtree recording'",
     [](EditFile& f) { f.set_attribute("/", "format", "nbdtree body"); }},
    {"is a file of 'nbdtree recording' version 9",
     [](EditFile& f) { f.set_attribute("/", "format_version", 9); }},
    {"attribute 'format' is not a text", [](EditFile& f) { f.set_attribute("/", "format", 1); }},
    {"has no 'trajectories'; allowed: a file with this item", [](EditFile& f) { f.remove("trajectories"); }},
    {"has no 'trajectories/000001/recipe'; allowed: a file with this item",
     [](EditFile& f) { f.remove("trajectories/000001/recipe"); }},
    {"has no 'trajectories/000001/positions'",
     [](EditFile& f) { f.remove("trajectories/000001/positions"); }},
    {"dataset 'trajectories/000001/positions' holds float64; allowed: float32",
     [](EditFile& f) {
         f.replace("trajectories/000001/positions", {11, 7, 3}, std::vector<double>(231));
     }},
    {"dataset 'trajectories/000001/positions' is 11 x 21; allowed: n x n x 3",
     [](EditFile& f) {
         f.replace("trajectories/000001/positions", {11, 21}, std::vector<float>(231));
     }},
    {"'trajectories/000001/positions' has no nodes; allowed: at least 1",
     [](EditFile& f) {
         f.replace("trajectories/000001/positions", {11, 0, 3}, std::vector<float>());
     }},
    {"dataset 'trajectories/000001/times' is 11; allowed: 12",
     [](EditFile& f) {
         f.replace("trajectories/000001/positions", {12, 7, 3}, std::vector<float>(252));
     }},
    {"frame 4 of 'trajectories/000001' has time 0.1 s; allowed: finite, later than 0.3",
     [](EditFile& f) { f.set("trajectories/000001/times", 4, 0.1); }},
    {"frame 0 of 'trajectories/000001' has time nan s",
     [](EditFile& f) { f.set("trajectories/000001/times", 0, std::nan("")); }},
    {"node 4 in frame 2 of trajectory 1 is not finite; allowed: finite positions",
     [](EditFile& f) { f.set("trajectories/000001/positions", 2 * 21 + 4 * 3 + 1, std::nanf("")); }},
    {"'trajectories/000001' has id -1; allowed: 0 to 2147483647",
     [](EditFile& f) { f.set_attribute(second, "id", -1); }},
    {"has id 0, which another trajectory has too; allowed: each id once",
     [](EditFile& f) { f.set_attribute(second, "id", 0); }},
    {"has no attribute 'seed' of 'trajectories/000001'",
     [](EditFile& f) { f.remove_attribute(second, "seed"); }},
    {"attribute 'seed' of 'trajectories/000001' is not a whole number",
     [](EditFile& f) { f.set_attribute(second, "seed", "seven"); }},
    {"attribute 'failure' of 'trajectories/000001' is not a text",
     [](EditFile& f) { f.set_attribute(second, "failure", 3); }},
    {"'trajectories/000001/recipe' is not a text",
     [](EditFile& f) { f.replace("trajectories/000001/recipe", {1}, std::vector<int>(1)); }},
    {"has no attribute 'id' of 'trajectories/stray'",
     [](EditFile& f) { f.replace("trajectories/stray", {1}, std::vector<int>(1)); }},
};

INSTANTIATE_TEST_SUITE_P(All, BrokenRecordingFile, ::testing::ValuesIn(broken_recordings));

}  // namespace
}  // namespace nbd
