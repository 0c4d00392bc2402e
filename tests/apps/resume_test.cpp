#include <gtest/gtest.h>

#include <chrono>
#include <random>
#include <thread>

#include "tests/apps/small_files.hpp"
#include "tests/support/edit_file.hpp"
#include "tests/support/file_damage.hpp"

namespace nbd::test {
namespace {

namespace fs = std::filesystem;

/// A table without its columns of times.
std::string without_times(const std::string& csv) {
    std::string result;
    std::vector<bool> keep;
    for (const std::string& line : lines(csv)) {
        std::size_t column = 0;
        for (const std::string& cell : cells(line)) {
            if (keep.size() <= column) keep.push_back(!cell.ends_with("_us"));
            if (keep[column++]) result += cell + ',';
        }
        result += '\n';
    }
    return result;
}

class ResumeTest : public SmallFiles {
 protected:
    static void SetUpTestSuite() {
        SmallFiles::SetUpTestSuite();
        write("scene.json", R"({
            "bodies": [
                {"body": "box.h5", "name": "the lower", "bounds": "affine", "transform": {"translate": [0, 0, 0.07]},
                 "grips": [{"region": {"box": {"min": [-1, -1, 0.07], "max": [1, 1, 1]}}, "take": 0.03, "release": 0.09,
                            "motion": [{"time": 0.03}, {"time": 0.07, "translate": [0, 0, 0.01]}]}]},
                {"surface": "box.obj", "transform": {"translate": [0.1, 0, 0.2]}, "velocity": [0, 0, -2],
                 "angular_velocity": [0, 3, 0]}],
            "obstacles": [{"plane": {}, "motion": [{"time": 0}, {"time": 0.1, "rotate": {"degrees": 20}}]}],
            "time": {"dt": 0.002, "frames": 12, "steps_per_frame": 5},
            "output": {"csv": "run.csv", "reactions": "forces.csv", "vtu": "frames", "obj": "frames"}})");
        simulate("whole", "");
    }

    /// The run of a scene to `where`/run.h5, in a folder that is there then.
    static std::string command(const std::string& where, const std::string& more,
                               const std::string& scene = "scene.json") {
        fs::create_directories(folder() / where);
        return "simulate " + scene + " -o " + where + "/run.h5 -q --audit 3 " + more;
    }

    static void simulate(const std::string& where, const std::string& more) { make(command(where, more)); }

    /// Expects the files of the uninterrupted run, bit for bit except for measured times.
    static void expect_whole(const std::string& where) {
        const fs::path whole = folder() / "whole", other = folder() / where;
        ASSERT_EQ(listing(other), (std::set<std::string>{"run.h5", "run.csv", "forces.csv", "frames"}));
        ASSERT_GT(lines(read_bytes(whole / "forces.csv")).size(), 20u);
        EXPECT_EQ(read_bytes(other / "forces.csv"), read_bytes(whole / "forces.csv"));
        ASSERT_EQ(listing(other / "frames"), listing(whole / "frames"));
        ASSERT_EQ(listing(whole / "frames").size(), 3u * 13 + 1);
        EXPECT_TRUE(read_bytes(other / "run.h5") == read_bytes(whole / "run.h5"));
        EXPECT_EQ(without_times(read_bytes(other / "run.csv")), without_times(read_bytes(whole / "run.csv")));
        for (const std::string& name : listing(whole / "frames"))
            EXPECT_TRUE(read_bytes(other / "frames" / name) == read_bytes(whole / "frames" / name)) << name;
    }

    /// Runs until so many frames are in the journal, then stops the run as by Ctrl-C or by SIGKILL.
    static void run_and_stop(const std::string& line, int frames, bool politely = false) {
        const std::string action = politely ? "|interrupt" : "|kill";
        const Ran ran = run(line, {{"NBDTREE_AT", "frames|" + std::to_string(frames) + action}});
        ASSERT_EQ(ran.status, politely ? 130 : -9) << ran.err;
    }

    /// Leaves a journal with some frames in `where`.
    static void leave_journal(const std::string& where, const std::string& line) {
        run_and_stop(line, 5);
        ASSERT_GT(fs::file_size(folder() / where / "run.h5.journal"), 60'000u);
    }
};

TEST_F(ResumeTest, ARunStoppedAgainAndAgainGivesTheSameBits) {
    const std::string where = "killed";
    bool politely = false;
    for (const int frames : {0, 0, 1, 4, 4, 5, 9, 11}) {  // stops at once where so many are done
        run_and_stop(command(where, "--resume"), frames, politely);
        politely = !politely;
    }
    run_and_stop(command(where, "--resume"), 12);  // all frames are done, and no output is
    simulate(where, "--resume");
    expect_whole(where);
}

TEST_F(ResumeTest, AutoBoundsOfALearnedTreeBoundTheSameNodesAfterAKill) {
    // The tree has calibrated learned bounds, which `auto` leaves alone in scenes.
    make("dataset box.h5 -o fresh.h5 --trajectories 3 --seed 5 --steps-per-frame 1 -q");
    make("calibrate tree.h5 fresh.h5 -o calibrated.h5 --miss-rate 0.3 --confidence 0.5 -q");
    write("auto.json", R"({
        "bodies": [
            {"body": "box.h5", "tree": "calibrated.h5", "bounds": "auto", "transform": {"translate": [0, 0, 0.07]}},
            {"body": "box.h5", "tree": "calibrated.h5", "bounds": "auto",
             "transform": {"translate": [0.1, 0, 0.2]}, "velocity": [0, 0, -2]}],
        "obstacles": [{"plane": {}}],
        "time": {"dt": 0.002, "frames": 12, "steps_per_frame": 5}, "output": {"csv": "run.csv"}})");
    const auto command = [](const std::string& where) {
        return ResumeTest::command(where, "--resume", "auto.json");
    };
    make(command("auto_whole"));
    for (const int frames : {2, 5, 9}) run_and_stop(command("auto_killed"), frames);
    make(command("auto_killed"));
    const std::string table = bytes("auto_whole/run.csv");
    EXPECT_EQ(without_times(bytes("auto_killed/run.csv")), without_times(table));
    EXPECT_TRUE(bytes("auto_killed/run.h5") == bytes("auto_whole/run.h5"));
    // Nodes were bounded, and more of them in some steps than in others.
    std::set<std::string> bounded;
    for (const std::string& line : lines(table)) bounded.insert(cells(line)[4]);
    EXPECT_GT(bounded.size(), 2u);  // the column's name and two numbers
    EXPECT_TRUE(bounded.contains("nodes_bounded"));
}

TEST_F(ResumeTest, LeavesAFinishedRunAsItIs) {
    const std::string where = "finished";
    simulate(where, "");
    const auto written = fs::last_write_time(folder() / where / "run.h5");
    EXPECT_EQ(text("simulate scene.json --audit 3 --resume -o " + where + "/run.h5"),
              where + "/run.h5: is finished, nothing to continue; without --resume the scene runs anew\n");
    EXPECT_EQ(fs::last_write_time(folder() / where / "run.h5"), written);
    expect_whole(where);

    fs::remove(folder() / where / "run.csv");  // not all of it is there: runs anew
    simulate(where, "--resume");
    expect_whole(where);
}

TEST_F(ResumeTest, KeepsAFinishedRunOfAnotherSceneOrOfOtherFrames) {
    const std::string where = "other_run";
    simulate(where, "");
    const std::string before = read_bytes(folder() / where / "run.h5");
    EXPECT_NE(error(command(where, "--frames 14 --resume"))
                  .find("holds a finished run of 12 frames instead of 14; without --resume"),
              std::string::npos);
    write("other.json", bytes("scene.json") + "\n");
    EXPECT_NE(error(command(where, "--resume", "other.json"))
                  .find("holds a finished run of another scene; without --resume"),
              std::string::npos);
    EXPECT_TRUE(read_bytes(folder() / where / "run.h5") == before);
}

TEST_F(ResumeTest, KeepsAFinishedRunWithOtherOptions) {
    const std::string where = "other_options";
    simulate(where, "--bounds boxes");
    const std::string before = read_bytes(folder() / where / "run.h5");
    const auto says = [&](const std::string& more, const std::string& difference) {
        EXPECT_EQ(error(command(where, more + " --resume")),
                  "nbdtree: error: " + where + "/run.h5: holds a finished run with " + difference +
                      "; without --resume it is replaced\n");
    };
    says("", "--bounds boxes instead of no --bounds");
    says("--bounds exact", "--bounds boxes instead of --bounds exact");
    says("--bounds boxes --margin 0.3", "no --margin instead of --margin 0.3");
    EXPECT_EQ(
        error("simulate scene.json -o " + where + "/run.h5 --bounds boxes --resume"),
        "nbdtree: error: " + where +
            "/run.h5: holds a finished run with --audit 3 instead of no --audit; without --resume it is "
            "replaced\n");
    EXPECT_EQ(run(command(where, "--bounds boxes --resume")).err, "");
    EXPECT_TRUE(read_bytes(folder() / where / "run.h5") == before);
}

TEST_F(ResumeTest, SaysWhichOptionsAFinishedRunIgnores) {
    const std::string where = "ignoring", file = where + "/run.h5";
    simulate(where, "");
    const auto warning = [&](const std::string& more) {
        const Ran ran = run(command(where, more));
        EXPECT_EQ(ran.status, 0);
        return ran.err;
    };
    const std::string ignores = "nbdtree: warning: " + file + ": the run is finished, so it ignores ";
    EXPECT_EQ(warning("--resume"), "");
    EXPECT_EQ(warning("--resume --live"), ignores + "--live\n");
    EXPECT_EQ(warning("--resume --strict"), "");
    EXPECT_EQ(error(command(where, "--resume --live --strict")),
              "nbdtree: error: " + file + ": the run is finished, so it ignores --live\n");
    EditFile(folder() / file).remove_attribute("/", "options");  // as earlier versions wrote it
    EXPECT_EQ(warning("--resume --bounds boxes"), ignores + "--bounds, --audit\n");
}

TEST_F(ResumeTest, UsesADamagedJournalUpToTheDamage) {
    const std::string where = "damaged";
    leave_journal(where, command(where, "--resume"));
    const fs::path journal = folder() / where / "run.h5.journal";
    const std::string whole = read_bytes(journal);
    std::mt19937 random(6);
    for (int i = 0; i < 3; ++i) {
        std::string content = whole;
        if (i % 2 == 0)
            content.resize(random() % whole.size());
        else
            content[2000 + random() % (whole.size() - 2000)] ^= 0x10;
        write_bytes(journal, content);
        simulate(where, "--resume");
        expect_whole(where);
    }
}

TEST_F(ResumeTest, RejectsAJournalOfAnotherRun) {
    const std::string where = "foreign", path = where + "/run.h5.journal";
    leave_journal(where, command(where, "--resume"));
    const fs::path journal = folder() / path;
    const std::string unfinished = read_bytes(journal), at = "nbdtree: error: " + path + ": ";
    const auto begun_with = [&](const std::string& what) {
        return at + "its run was started with another " + what + "; remove the file to start over\n";
    };
    EXPECT_EQ(error(command(where, "")),
              at + "holds an unfinished run; continue it with --resume, or remove the file to start over\n");
    EXPECT_EQ(error(command(where, "--resume --frames 13")), begun_with("--frames"));
    EXPECT_EQ(error(command(where, "--resume --margin 0.1")), begun_with("--margin"));

    const std::string scene = bytes("scene.json"), box = bytes("box.obj");
    write("scene.json", scene + " ");
    EXPECT_EQ(error(command(where, "--resume")), begun_with("scene"));
    write("scene.json", scene);
    write("box.obj", box + "# changed\n");
    EXPECT_EQ(error(command(where, "--resume")), begun_with("box.obj"));
    write("box.obj", box);
    write_bytes(journal, "hello");
    EXPECT_EQ(error(command(where, "--resume")),
              at + "is not a journal of nbdtree; remove it or choose another output\n");
    EXPECT_EQ(read_bytes(journal), "hello");
    write_bytes(journal, unfinished);
    simulate(where, "--resume");
    expect_whole(where);
}

TEST_F(ResumeTest, WritesOutputsRequestedLaterFromTheJournal) {
    const std::string where = "later";
    const std::string bare = command(where, "--resume", "bare.json");
    std::string scene = bytes("scene.json");
    scene.resize(scene.find(",\n            \"output\""));
    write("bare.json", scene += '}');
    leave_journal(where, bare);
    make(bare + " --csv " + where + "/run.csv --reactions " + where + "/forces.csv --vtu " + where +
         "/frames --obj " + where + "/frames");
    fs::copy_file(folder() / "whole/run.h5", folder() / where / "run.h5",
                  fs::copy_options::overwrite_existing);
    expect_whole(where);  // the recording contains the text of the other scene
}

TEST_F(ResumeTest, RejectsASecondRunOnTheSameOutput) {
    write("long.json", R"({"bodies": [{"body": "box.h5"}], "time": {"frames": 1000000}})");
    const std::string line = "simulate long.json -o long.h5 -q --resume";
    Running first(folder(), line, NBD_COMMAND, Running::Start::plain,
                  {{"NBDTREE_AT", "frames|1|wait|never"}});
    while (!fs::exists(folder() / "long.h5.journal") && !first.has_ended())
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    EXPECT_EQ(error(line), "nbdtree: error: long.h5.journal: another run is writing this output\n");
    first.interrupt();
    EXPECT_EQ(first.wait().status, 130);
    fs::remove(folder() / "long.h5.journal");
}

TEST_F(ResumeTest, RejectsOutputsThatShareAFile) {
    const std::string same = " are the same file", box = (folder() / "box.h5").string();
    expect_refused({
        {"simulate scene.json -q -o x.h5 --csv whole/../x.h5", 1,
         "whole/../x.h5: cannot be written: recording and csv" + same},
        {"simulate scene.json -q -o x.h5 --picture x.h5.journal", 1,
         "x.h5.journal: cannot be written: journal and picture" + same},
        {"simulate scene.json -q -o x.h5 --obj x.csv --csv x.csv", 1,
         "x.csv: cannot be written: csv and obj" + same},
        {"simulate scene.json -q -o x.h5 --vtu box.h5/frames", 1,
         "box.h5/frames: cannot be written: " + box + " is not a folder"},
    });
}

}  // namespace
}  // namespace nbd::test
