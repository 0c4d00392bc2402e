// Training by several processes at once gives the same tree file as by one.
#include <gtest/gtest.h>

#include "tests/apps/mpi.hpp"
#include "tests/apps/small_files.hpp"

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
        if (!has_mpirun()) GTEST_SKIP() << "there is no mpirun here";
    }
};

TEST_F(SharedTrainingTest, AnyNumberOfRanksGivesTheSameTree) {
    for (const char* ranks : {"1", "2", "3"}) {
        const std::string name = std::string("ranks") + ranks + ".h5";
        const Ran ran = run_mpi(folder(), std::string("-n ") + ranks, train(name));
        ASSERT_EQ(ran.status, 0) << ran.err;
        EXPECT_TRUE(bytes(name) == bytes("alone.h5")) << ranks;
        EXPECT_FALSE(fs::exists(folder() / (name + ".networks")));
    }
}

TEST_F(SharedTrainingTest, GoesOnWithWhatAnEarlierRunLeftAndWithNothingOfAnotherTraining) {
    auto other = train("kept.h5");
    other.insert(other.end(), {"--seed", "9"});
    // A rank of two leaves the networks where the other would find them.
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
    EXPECT_FALSE(fs::exists(folder() / "kept.h5.networks")) << "the last one removes it";
}

}  // namespace
}  // namespace nbd::test
