// Datasets of scenes whose bodies are there as often as drawn.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <csignal>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "meshing/body/body.hpp"
#include "tests/apps/small_files.hpp"
#include "tests/support/file_damage.hpp"
#include "training/files/recording.hpp"

namespace nbd::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class CountedBodies : public BoxFolder {
 protected:
    static std::map<std::string, std::string> files(const std::string& name) {
        std::map<std::string, std::string> result;
        for (const auto& entry : fs::recursive_directory_iterator(folder() / name))
            if (entry.is_regular_file() && entry.path().filename() != ".claims")
                result[fs::relative(entry.path(), folder() / name)] = read_bytes(entry.path());
        return result;
    }
};

/// Boxes that fly upward from drawn places, as many as drawn, beside one that is there once.
json counted_scene(int least) {
    return {{"variables",
             {{{"name", "n"}, {"integer", {least, 3}}},
              {{"name", "height"}, {"uniform", {0.5, 0.6}}, {"copies", 3}}}},
            {"gravity", {0, 0, 0}},
            {"bodies",
             {{{"body", "box.h5"}, {"name", "single"}},
              {{"body", "box.h5"},
               {"name", "box"},
               {"count", {{"var", "n"}}},
               {"transform", {{"translate", {{{"var", "copy"}, {"plus", 1}}, 0, {{"var", "height"}}}}}},
               {"velocity", {0, 0, 1}}}}},
            {"time", {{"dt", 0.004}, {"frames", 2}, {"steps_per_frame", 2}}}};
}

TEST_F(CountedBodies, RecordsTheCopiesThatEachTrajectoryHas) {
    write("counted.json", counted_scene(1).dump(2));
    const auto command = [](const std::string& name, const std::string& more) {
        fs::create_directory(folder() / name);
        return "dataset counted.json -o " + name +
               "/data.h5 --body box --trajectories 8 --per-shard 3 -q "
               "--hold-out variables.n=3.. " +
               more;
    };
    make(command("counted", "--threads 2 --values counted.csv"));
    const RecordingReader recording(folder() / "counted/data.h5");
    const Body box = load_body(folder() / "box.h5");
    std::set<int> counts, bodies;
    const std::vector<std::string> table = lines(bytes("counted.csv"));
    EXPECT_EQ(table[0], "trajectory,drawn_again,height.0,height.1,height.2,n,frames,failure");
    for (int i = 0; i < 8; ++i) {
        const json told = json::parse(recording.trajectories()[i].recipe.str()), values = told["variables"];
        const int n = values["n"], copy = i % n;
        counts.insert(n);
        EXPECT_EQ(told["body"], 1 + copy) << "the k-th of those that it has";
        bodies.insert(copy);
        EXPECT_EQ(std::stod(cells(table[i + 1])[2 + copy]),
                  values["height"][std::to_string(copy)].get<double>());
        Vertices x;
        recording.read(i, 0, 1, x);
        const Eigen::RowVector3d at(1 + copy, 0,
                                    values["height"][std::to_string(copy)].get<double>() + 0.008);
        EXPECT_LT((x.cast<double>() - (box.tets.X.rowwise() + at)).cwiseAbs().maxCoeff(), 1e-5) << i;
    }
    EXPECT_EQ(counts, (std::set{1, 2, 3}));
    EXPECT_GT(bodies.size(), 1u);
    const auto whole = files("counted");
    for (const std::string shard : {"1/2", "0/2"})
        make(command("counted_parts", "--threads 1 --shard " + shard));
    make(command("counted_parts", ""));
    EXPECT_TRUE(files("counted_parts") == whole);
    const Ran ran = run(command("counted_killed", "--threads 1"), {{"NBDTREE_AT", "trajectories|2|kill"}});
    ASSERT_EQ(ran.status, -SIGKILL) << ran.err;
    make(command("counted_killed", ""));
    auto found = files("counted_killed");
    std::erase_if(found, [](const auto& file) { return file.first.ends_with(".tmp"); });
    EXPECT_TRUE(found == whole);

    make("simulate counted.json -o counted_run.h5 -q --trajectory 2 --set n=2");
    EXPECT_EQ(RecordingReader(folder() / "counted_run.h5").trajectories().size(), 3u);
    make("validate counted.json");
    write("none.json", counted_scene(0).dump(2));
    EXPECT_NE(error("dataset none.json -o no.h5 --body box --trajectories 2").find("has no body \"box\" "),
              std::string::npos);
}

}  // namespace
}  // namespace nbd::test
