// Training by several processes gives the same tree file as training by one.
#include <gtest/gtest.h>

#include "tests/apps/mpi.hpp"
#include "tests/apps/small_files.hpp"
#include "tests/support/file_damage.hpp"

namespace nbd::test {
namespace {

namespace fs = std::filesystem;

class SharedTrainingTest : public SmallFiles {
 protected:
    static std::vector<std::string> train(const std::string& output) {
        return {"train", "box.h5",   "data.h5", "-o",         output, "--depth",       "3", "-m", "8", "-k",
                "16",    "--epochs", "40",      "--held-out", "0",    "--calibration", "0", "-q"};
    }

    static void SetUpTestSuite() {
        SmallFiles::SetUpTestSuite();
        make(train("alone.h5"));
    }

    static std::string bytes(const std::string& name) { return read_bytes(folder() / name); }

    void SetUp() override {
        if (!has_mpirun()) GTEST_SKIP() << "mpirun is not installed (Debian: openmpi-bin)";
    }
};

TEST_F(SharedTrainingTest, AnyNumberOfRanksGivesTheSameTree) {
    for (const int ranks : {1, 2, 3}) {
        const std::string name = "ranks" + std::to_string(ranks) + ".h5";
        const Ran ran = run_mpi(folder(), ranks, train(name));
        ASSERT_EQ(ran.status, 0) << ran.err;
        EXPECT_TRUE(bytes(name) == bytes("alone.h5")) << ranks;
        EXPECT_FALSE(fs::exists(folder() / (name + ".networks")));
    }
}

TEST_F(SharedTrainingTest, ReusesNetworksOfAnEarlierRunOfTheSameTrainingOnly) {
    auto other = train("kept.h5");
    other.insert(other.end(), {"--seed", "9"});
    // Rank 1 of 2 leaves its networks in the folder where the next run looks.
    setenv("OMPI_COMM_WORLD_SIZE", "2", 1);
    setenv("OMPI_COMM_WORLD_RANK", "1", 1);
    const Ran first = run(folder(), other);
    ASSERT_EQ(first.status, 0) << first.err;
    EXPECT_FALSE(fs::exists(folder() / "kept.h5"));
    ASSERT_TRUE(fs::exists(folder() / "kept.h5.networks/000014.h5"));

    setenv("OMPI_COMM_WORLD_RANK", "0", 1);
    const Ran second = run(folder(), train("kept.h5"));
    unsetenv("OMPI_COMM_WORLD_SIZE");
    unsetenv("OMPI_COMM_WORLD_RANK");
    ASSERT_EQ(second.status, 0) << second.err;
    EXPECT_TRUE(bytes("kept.h5") == bytes("alone.h5"));
    EXPECT_FALSE(fs::exists(folder() / "kept.h5.networks")) << "the last rank removes the folder";
}

}  // namespace
}  // namespace nbd::test
