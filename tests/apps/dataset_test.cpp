// Datasets as users make them: interruptions and distribution do not change the resulting files.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "tests/apps/small_files.hpp"
#include "tests/support/file_damage.hpp"

namespace nbd::test {
namespace {

namespace fs = std::filesystem;

class DatasetTest : public BoxFolder {
 protected:
    static void SetUpTestSuite() {
        BoxFolder::SetUpTestSuite();
        make(command("whole"));
    }

    /// Returns the command line that makes the dataset NAME/data.h5.
    static std::string command(const std::string& name, const std::string& more = "") {
        fs::create_directory(folder() / name);
        return "dataset box.h5 -o " + name + "/data.h5 --trajectories 9 --per-shard 4 --frames 12 -q " + more;
    }

    /// Content of a dataset's files by name, except the claims.
    static std::map<std::string, std::string> files(const std::string& name) {
        std::map<std::string, std::string> result;
        for (const auto& entry : fs::recursive_directory_iterator(folder() / name))
            if (entry.is_regular_file() && entry.path().filename() != ".claims")
                result[fs::relative(entry.path(), folder() / name)] = read_bytes(entry.path());
        return result;
    }

    /// is_killed: whether a process was killed, which leaves the file that it is writing under its temporary
    /// name. Open MPI 5 may kill ranks beside one that was.
    static void expect_like_whole(const std::string& name, bool is_killed = false) {
        const auto expected = files("whole");
        auto found = files(name);
        if (is_killed) std::erase_if(found, [](const auto& file) { return file.first.ends_with(".tmp"); });
        ASSERT_EQ(expected.size(), 6u);  // view, plan, card, three shards
        for (const auto& [file, bytes] : expected)
            EXPECT_TRUE(found.contains(file) && found.at(file) == bytes) << file;
        for (const auto& [file, bytes] : found) EXPECT_TRUE(expected.contains(file)) << file;
    }

    /// Number of finished trajectories of a dataset.
    static int there(const std::string& name) {
        return result(command(name, "--shard 0/1000000")).value("there", -1);
    }
};

TEST_F(DatasetTest, ReportsItsContent) {
    const auto said = result(command("whole", "--csv modes.csv"));
    EXPECT_EQ(said["trajectories"], 9);
    EXPECT_EQ(said["shards"], 3);
    EXPECT_EQ(said["frames"].get<int>() + 12 * said["failed"].get<int>(), 9 * 12);
    const auto& variety = said["variety"];
    EXPECT_GT(variety["frames_in_contact"], 0);
    EXPECT_LT(variety["frames_in_contact"], variety["frames"]);
    EXPECT_TRUE(std::ranges::is_sorted(variety["stretch"]));
    EXPECT_LT(variety["stretch"][0], 0.97);
    EXPECT_GT(variety["stretch"][4], 1.03);
    EXPECT_EQ(variety["mode_std"].size(), 8u);
    EXPECT_GT(variety["mode_share"][7], 0.5);
    EXPECT_LE(variety["mode_share"][7], 1.0);
    EXPECT_EQ(std::ranges::count(bytes("modes.csv"), '\n'), 9);
}

TEST_F(DatasetTest, ASecondRunChangesNothing) {
    const auto before = fs::last_write_time(folder() / "whole/data.h5");
    make(command("whole"));
    EXPECT_EQ(fs::last_write_time(folder() / "whole/data.h5"), before);
}

TEST_F(DatasetTest, ContinuesAfterBeingKilledAgainAndAgain) {
    const auto arguments = command("killed", "--threads 2");
    for (const char* state : {"frames of trajectories|1", "frames of trajectories|3", "trajectories|1",
                              "frames of trajectories|20", "trajectories|2", "frames of trajectories|10"}) {
        const Ran ran = run(arguments, {{"NBDTREE_AT", std::string(state) + "|kill"}});
        ASSERT_EQ(ran.status, -SIGKILL) << state << ran.err;
    }
    EXPECT_GE(there("killed"), 3);
    make(arguments);
    expect_like_whole("killed");
}

TEST_F(DatasetTest, CtrlCKeepsFinishedTrajectoriesAndReportsThem) {
    const Ran ran = run(command("stopped", "--threads 1"), {{"NBDTREE_AT", "trajectories|2|interrupt"}});
    ASSERT_EQ(ran.status, 130) << ran.err;
    EXPECT_EQ(ran.err.rfind("nbdtree: error: interrupted: ", 0), 0u) << ran.err;
    EXPECT_NE(
        ran.err.find("2 of 9 trajectories are kept in stopped/data.shards; the same command continues\n"),
        std::string::npos)
        << ran.err;
    EXPECT_EQ(there("stopped"), 2);
    for (const auto& [file, bytes] : files("stopped")) EXPECT_FALSE(file.ends_with(".tmp")) << file;
    make(command("stopped"));
    expect_like_whole("stopped");
}

TEST_F(DatasetTest, RecreatesDamagedAndMissingShards) {
    make(command("damaged"));
    const fs::path shards = folder() / "damaged/data.shards";
    std::string bytes = read_bytes(shards / "000000-000003.h5");
    bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
    write_bytes(shards / "000000-000003.h5", bytes);
    fs::remove(shards / "000004-000007.h5");

    EXPECT_EQ(std::ranges::count(error("inspect damaged/data.h5"), '\n'), 1);
    EXPECT_EQ(error("train box.h5 damaged/data.h5 -o x.h5"),
              "nbdtree: error: damaged/data.h5: cannot read a shard: "
              "damaged/data.shards/000004-000007.h5: no such file\n");

    const Ran again = run(command("damaged"));
    EXPECT_EQ(again.status, 0);
    EXPECT_NE(again.err.find("remaking a damaged file: damaged/data.shards/000000-000003.h5"),
              std::string::npos)
        << again.err;
    expect_like_whole("damaged");
}

TEST_F(DatasetTest, RejectsOtherOptionsForAnExistingDataset) {
    const auto refused = [](const std::string& more, const std::string& difference) {
        const auto before = files("whole");
        EXPECT_EQ(error(command("whole", more)), "nbdtree: error: whole/data.h5: was started with " +
                                                     difference +
                                                     "; allowed: the same options, or another name\n");
        EXPECT_TRUE(files("whole") == before);
    };
    refused("--seed 7", "seed 1, not 7");
    refused("--strength 0.5", "recipe.strength 1.0, not 0.5");
    refused("--steps-per-frame 3", "steps_per_frame 2, not 3");
    write("other.h5", "hello\n");
    EXPECT_EQ(error("dataset box.h5 -o other.h5"),
              "nbdtree: error: other.h5: already exists and is not a dataset that can be continued; allowed: "
              "another name\n");
}

TEST_F(DatasetTest, CanBeMovedWithItsShards) {
    make(command("moving"));
    fs::create_directory(folder() / "elsewhere");
    fs::rename(folder() / "moving/data.h5", folder() / "elsewhere/renamed.h5");
    fs::rename(folder() / "moving/data.shards", folder() / "elsewhere/data.shards");
    make("inspect elsewhere/renamed.h5");
}

TEST_F(DatasetTest, ShardsOfAJobArrayMergeIntoTheSameDataset) {
    for (const std::string shard : {"1/3", "0/3", "2/3"}) make(command("array", "--shard " + shard));
    EXPECT_FALSE(fs::exists(folder() / "array/data.h5"));
    make(command("array"));
    expect_like_whole("array");
}

TEST_F(DatasetTest, ProcessesShareTheWorkOfOneFolder) {
    Running first(folder(), command("shared", "--threads 1"));
    Running second(folder(), command("shared", "--threads 1"));
    const Ran a = first.wait(), b = second.wait();
    EXPECT_EQ(a.status, 0) << a.err;
    EXPECT_EQ(b.status, 0) << b.err;
    expect_like_whole("shared");
}

TEST_F(DatasetTest, TheSlurmScriptRunsAJobArrayAndMerges) {
    const auto slurm = [](const std::string& environment) {
        std::string line = "cd '" + folder().string() +
                           "' && PATH=/usr/bin:/bin SLURM_CPUS_PER_TASK=1 NBDTREE='" NBD_COMMAND "' " +
                           environment + " bash '" NBD_ASSETS "/slurm/dataset.sh'";
        const std::string options = command("slurm");
        return std::system((line + options.substr(options.find(' '))).c_str());
    };
    for (const char* task : {"5", "6"})
        EXPECT_EQ(
            slurm(std::string("SLURM_ARRAY_TASK_MIN=5 SLURM_ARRAY_TASK_COUNT=2 SLURM_ARRAY_TASK_ID=") + task),
            0);
    EXPECT_EQ(there("slurm"), 9);
    make(command("slurm"));
    expect_like_whole("slurm");
}

TEST_F(DatasetTest, FollowsRecipeFiles) {
    write("thrown.json",
          R"({"kinds": {"drop": {"weight": 0}, "thrown": {"weight": 1}}, "contact_share": 1})");
    const auto kinds = result(command("thrown", "--recipe thrown.json"))["variety"]["kinds"];
    EXPECT_EQ(kinds.size(), 1u);
    EXPECT_EQ(kinds["thrown"]["trajectories"], 9);

    write("wrong.json", R"({"kinds": {"dorp": {}}})");
    EXPECT_EQ(error(command("wrong", "--recipe wrong.json")),
              "nbdtree: error: wrong.json: recipe.kinds: unknown key \"dorp\"; the nearest known one is "
              "\"drop\"\n");
    EXPECT_EQ(error(command("wrong", "--recipe none.json")), "nbdtree: error: none.json: no such file\n");
    EXPECT_TRUE(files("wrong").empty());
}

TEST_F(DatasetTest, RetriesFailuresWithSmallerStepsAndRecordsThem) {
    const Ran ran = run(command("wild", "--strength 1000 --seed 2 --attempts 2 --json"));
    ASSERT_EQ(ran.status, 1) << ran.err;
    EXPECT_NE(ran.err.find(" is left out: at "), std::string::npos) << ran.err;
    EXPECT_NE(ran.err.find("data.h5: every trajectory failed"), std::string::npos) << ran.err;
    EXPECT_GT(nlohmann::json::parse(ran.out)["failed"], 0);
    EXPECT_NE(text("inspect wild/data.h5").find(" failed: at "), std::string::npos);
    const Ran again = run(command("wild", "--strength 1000 --seed 2 --attempts 2"));
    EXPECT_EQ(again.err.find(" is left out: at "), std::string::npos) << again.err;
}

bool has_mpirun() { return std::system("mpirun --version >/dev/null 2>&1") == 0; }

/// Runs `nbdtree` under mpirun in a folder with one thread per rank. at: NBDTREE_AT of the last rank, see
/// apps/cli/test_points.hpp, whose exit status is then in the file last_rank.status; the others wait there
/// for it. options: mpirun's. Returns the status of std::system.
Ran run_mpi(const fs::path& folder, int ranks, const std::string& line, const std::string& at,
            const std::string& options) {
    const std::string command = "'" NBD_COMMAND "' " + line + " --threads 1";
    std::string job =
        "cd '" + folder.string() +
        "' && OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 ASAN_OPTIONS=detect_leaks=0 "
        "mpirun --oversubscribe " +
        options + fmt::format(" -n {} ", ranks);
    if (at.empty()) {
        job += command;
    } else {
        // The others leave work for the last one, however fast they are. Open MPI 5.0.7 crashes if ranks have
        // commands of their own.
        std::ofstream(folder / "rank.sh") << fmt::format(
            "if [ \"$OMPI_COMM_WORLD_RANK\" != {} ]; then\n"
            "    NBDTREE_AT='{}|wait|last_rank.status' exec {}\n"
            "fi\n"
            "NBDTREE_AT='{}' {}\n"
            "status=$?\necho $status >last_rank.status\nexit $status\n",
            ranks - 1, at.substr(0, at.rfind('|')), command, at, command);
        fs::remove(folder / "last_rank.status");
        job += "sh rank.sh";
    }
    job += " >mpi.out 2>mpi.err";
    const int status = std::system(job.c_str());
    return {status, read_bytes(folder / "mpi.out"), read_bytes(folder / "mpi.err")};
}

/// Runs the dataset command under mpirun.
class MpiTest : public DatasetTest {
 protected:
    void SetUp() override {
        if (!has_mpirun()) GTEST_SKIP() << "mpirun is not installed (Debian: openmpi-bin)";
    }

    /// Kills the last rank while it is simulating where `kills`, and expects that it did.
    static Ran mpirun(int ranks, const std::string& name, bool kills = false,
                      const std::string& options = "") {
        const Ran ran =
            run_mpi(folder(), ranks, command(name), kills ? "frames of trajectories|5|kill" : "", options);
        if (kills) {
            EXPECT_EQ(bytes("last_rank.status"), "137\n") << ran.err;
        }
        return ran;
    }
};

TEST_F(MpiTest, AnyNumberOfRanksGivesTheSameFiles) {
    for (const int ranks : {1, 2, 3}) {
        const std::string name = "ranks" + std::to_string(ranks);
        const Ran ran = mpirun(ranks, name);
        ASSERT_EQ(ran.status, 0) << ran.err;
        expect_like_whole(name);
    }
}

TEST_F(MpiTest, OtherRanksTakeOverTheWorkOfAKilledRank) {
    const Ran ran = mpirun(3, "dying", true, "--enable-recovery");
    ASSERT_TRUE(fs::exists(folder() / "dying/data.h5")) << ran.err;
    expect_like_whole("dying", true);
}

TEST_F(MpiTest, AKilledRankCostsOnlyTheWorkInFlight) {
    const Ran ran = mpirun(2, "dead", true);  // mpirun then ends the other rank as well
    EXPECT_NE(ran.status, 0);
    make(command("dead"));
    expect_like_whole("dead");
}

}  // namespace
}  // namespace nbd::test
