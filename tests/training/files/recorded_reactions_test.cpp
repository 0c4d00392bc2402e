// Reactions in recordings.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "meshing/h5/reader.hpp"
#include "tests/support/edit_file.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/training/files/example_recording.hpp"
#include "training/files/recording.hpp"

namespace nbd {
namespace {

using test::EditFile;
using test::error_of;
using RecordedReactions = test::FileTest;

std::vector<RecordedReaction> example_rows() {
    return {
        {.frame = 1,
         .time = 0.05,
         .body = 0,
         .kind = "grip",
         .by = "pins[0]",
         .force = {1, -2, 1.0 / 3},
         .torque = {1e-12, 5, 6},
         .point = {0.5, 0, 1e6}},
        {.frame = 1,
         .time = 0.05,
         .body = 4,
         .kind = "cavity",
         .by = "cavity 0",
         .pressure = 1e5,
         .volume = 2e-3},
        {.frame = 1, .time = 0.1, .body = 4, .kind = "obstacle", .by = "flöör, \"2\"", .force = {0, 0, 9}},
        {.frame = 3, .time = 0.3, .body = 0, .kind = "grip", .by = "pins[0]"}};
}

void write_rows(const std::filesystem::path& path, const std::vector<std::vector<RecordedReaction>>& parts) {
    RecordingWriter file(path);
    for (const int id : {0, 4}) {
        const int handle = file.begin_trajectory(test::info_of(id), 7);
        for (int frame = 0; frame < 3; ++frame)
            file.add_frame(handle, 0.1 * frame, test::frame_of(id, frame, 7));
    }
    for (const auto& rows : parts) file.add_reactions(rows);
    file.finish();
}

TEST_F(RecordedReactions, ComeBackAsTheyWereGiven) {
    const auto path = folder / "data.h5";
    const std::vector<RecordedReaction> rows = example_rows();
    write_rows(path, {{}, {rows[0], rows[1]}, {}, {rows[2], rows[3]}});
    const RecordingReader file(path);
    EXPECT_TRUE(file.has_reactions());
    EXPECT_EQ(file.reactions(), rows);
    EXPECT_EQ(h5::Reader(path).read_text("reactions/names"),
              "grip\npins[0]\ncavity\ncavity 0\nobstacle\nflöör, \"2\"");
    write_rows(path, {rows});
    EXPECT_EQ(RecordingReader(path).reactions(), rows) << "parts do not matter";
    write_rows(path, {{}});
    EXPECT_TRUE(RecordingReader(path).has_reactions());
    EXPECT_TRUE(RecordingReader(path).reactions().empty());
    write_rows(path, {});
    EXPECT_FALSE(RecordingReader(path).has_reactions());
    EXPECT_TRUE(RecordingReader(path).reactions().empty());
}

TEST_F(RecordedReactions, KeepANameOnOneLine) {
    std::vector<RecordedReaction> rows = example_rows();
    rows[0].by = "two\nlines";
    write_rows(folder / "data.h5", {rows});
    EXPECT_EQ(RecordingReader(folder / "data.h5").reactions()[0].by, "two lines");
}

TEST_F(RecordedReactions, AreRefusedOutOfOrderAndWithoutNumbers) {
    const auto refusal = [&](const std::function<void(RecordedReaction&)>& spoil) {
        std::vector<RecordedReaction> rows = example_rows();
        spoil(rows[2]);
        return error_of<std::invalid_argument>([&] { write_rows(folder / "data.h5", {rows}); });
    };
    EXPECT_NE(
        refusal([](RecordedReaction& row) {
            row.time = 0.04;
        }).find("has a reaction of frame 1 at 0.04 s after one of frame 1 at 0.05 s; allowed: in order"),
        std::string::npos);
    EXPECT_NE(refusal([](RecordedReaction& row) { row.frame = 0; }).find("allowed: in order"),
              std::string::npos);
    EXPECT_NE(refusal([](RecordedReaction& row) {
                  row.force.y() = NAN;
              }).find("has a reaction of frame 1 that is not finite; allowed: finite numbers"),
              std::string::npos);
    EXPECT_NE(refusal([](RecordedReaction& row) { row.body = -1; }).find("allowed: at least 0"),
              std::string::npos);
}

class BrokenReactions : public RecordedReactions, public ::testing::WithParamInterface<test::BrokenFile> {};

TEST_P(BrokenReactions, AreRefusedInOneLine) {
    write_rows(folder / "data.h5", {example_rows()});
    test::expect_refused(folder / "data.h5", GetParam(),
                         [](const auto& path) { RecordingReader(path).reactions(); });
}

const test::BrokenFile broken_reactions[] = {
    {"has no 'reactions/names'", [](EditFile& f) { f.remove("reactions/names"); }},
    {"has no 'reactions/point'", [](EditFile& f) { f.remove("reactions/point"); }},
    {"'reactions/time' is 3",
     [](EditFile& f) {
         f.replace("reactions/time", {3}, std::vector<double>{0, 1, 2});
     }},
    {"'reactions/by' has text 6; allowed: 0 to 5",
     [](EditFile& f) {
         f.replace("reactions/by", {4}, std::vector<std::int32_t>{3, 4, 6, 3});
     }},
    {"a reaction acts on body 3; allowed: the id of a trajectory",
     [](EditFile& f) {
         f.replace("reactions/body", {4}, std::vector<std::int32_t>{0, 4, 3, 0});
     }},
    {"allowed: in order",
     [](EditFile& f) {
         f.replace("reactions/frame", {4}, std::vector<std::int32_t>{1, 1, 2, 1});
     }},
    {"is not finite",
     [](EditFile& f) {
         f.replace("reactions/volume", {4}, std::vector<double>{0, INFINITY, 0, 0});
     }},
};

INSTANTIATE_TEST_SUITE_P(All, BrokenReactions, ::testing::ValuesIn(broken_reactions));

}  // namespace
}  // namespace nbd
