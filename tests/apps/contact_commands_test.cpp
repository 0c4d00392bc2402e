// Contact as users see it: what runs tell, what they refuse, and the benchmarks of contact.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "tests/apps/small_files.hpp"

namespace nbd {
namespace {

using test::Ran;
using testing::HasSubstr;

class ContactCommands : public test::BoxFolder {
 protected:
    /// A box that falls onto a floor, in a scene with further keys.
    static void write_drop(const std::string& name, const std::string& more) {
        write(name, R"({"bodies": [{"body": "box.h5", "name": "box", "transform": {"translate": [0, 0, 0.1]},
                                    "velocity": [0, 0, -3]}],
                        "obstacles": [{"plane": {}}], "time": {"dt": 0.005, "frames": 8, "steps_per_frame": 2})" +
                        more + "}");
    }
    static Ran simulate(const std::string& scene_and_options) {
        return run("simulate -o run.h5 --csv run.csv --json " + scene_and_options);
    }
};

TEST_F(ContactCommands, StepsThatWentWrongAreTold) {
    write_drop("hard.json", R"(, "solver": {"newton_iterations": 8, "newton_tolerance": 1e-12})");
    const Ran told = simulate("hard.json");
    ASSERT_EQ(told.status, 0) << told.err;
    EXPECT_GT(nlohmann::json::parse(told.out)["troubled_steps"], 0);
    EXPECT_THAT(told.err, HasSubstr("of 16 steps were kept although something went wrong; the first: at "));
    EXPECT_THAT(bytes("run.csv"), HasSubstr(",newton,"));
    const Ran strict = simulate("hard.json --strict");
    EXPECT_EQ(strict.status, 1);
    EXPECT_THAT(strict.err, HasSubstr("Newton's iteration ends"));

    write_drop("easy.json", "");
    const Ran fine = simulate("easy.json --strict");
    EXPECT_EQ(fine.status, 0) << fine.err;
    EXPECT_EQ(nlohmann::json::parse(fine.out)["troubled_steps"], 0);
    EXPECT_THAT(fine.err, testing::Not(HasSubstr("went wrong")));
}

TEST_F(ContactCommands, TheTableHasTheColumnsThatHelpLists) {
    write_drop("drop.json", "");
    ASSERT_EQ(simulate("drop.json --audit 1").status, 0);
    const std::string table = bytes("run.csv"), header = table.substr(0, table.find('\n'));
    EXPECT_EQ(
        header,
        "frame,time,contacts,face_pairs,nodes_bounded,nodes_out_of_range,update_us,collision_us,detect_us,"
        "assemble_us,solve_us,rest_us,substeps,exact_parts,newton_iterations,solver_iterations,solver_converged,"
        "kinetic_energy,elastic_energy,gravity_energy,inverted_elements,near_pairs,near_pairs_missed,"
        "audit_tests,audit_exact_tests,audit_us,audit_exact_us,trouble,least_distance");
    const std::string help = run("simulate --help").out;
    for (const std::string& name : test::cells(header))
        EXPECT_NE(help.find("\n  " + name), std::string::npos) << name;
}

TEST_F(ContactCommands, AStartThatIntersectsIsRefusedOrMended) {
    const auto two = [](const std::string& contact) {
        return fmt::format(R"({{"bodies": [{{"body": "box.h5", "name": "a"}},
                                           {{"body": "box.h5", "name": "b", "transform": {{"translate": [0.1, 0, 0]}}}}],
                               "gravity": [0, 0, 0], "time": {{"dt": 0.005, "frames": 1, "steps_per_frame": 1}},
                               "contact": {{{}}}}})",
                           contact);
    };
    write("overlap.json", two(""));
    std::filesystem::remove(folder() / "run.h5");
    const Ran refused = simulate("overlap.json");
    EXPECT_EQ(refused.status, 1);
    EXPECT_THAT(refused.err, HasSubstr("overlaps bodies[0] (a) at the start"));
    EXPECT_FALSE(test::listing(folder()).contains("run.h5"));
    write("mended.json", two(R"("resolve_start": true)"));
    const Ran mended = simulate("mended.json");
    EXPECT_EQ(mended.status, 0) << mended.err;
    EXPECT_THAT(mended.err, HasSubstr(" (b): touched or overlapped something at the start and was moved by"));
}

TEST_F(ContactCommands, KeysThatHaveNoEffectAreTold) {
    write_drop("old.json",
               R"(, "contact": {"damping": 0.01, "contacts_per_node_pair": 2, "self_contact": false})");
    const Ran old = simulate("old.json");
    EXPECT_EQ(old.status, 0) << old.err;
    for (const char* key : {"contact.damping", "contact.contacts_per_node_pair", "contact.self_contact"})
        EXPECT_THAT(old.err, HasSubstr(std::string(key) + ": has no effect any more")) << key;
    write_drop("new.json", R"(, "contact": {"self_contact": true, "intersection_free": true})");
    EXPECT_THAT(simulate("new.json").err, testing::Not(HasSubstr("no effect")));
}

TEST_F(ContactCommands, ABodyThatTouchesTheFloorIsMovedByLittle) {
    write("touching.json", R"({"bodies": [{"body": "box.h5", "name": "box"}],
        "obstacles": [{"plane": {}}], "time": {"dt": 0.005, "frames": 4, "steps_per_frame": 2}})");
    const Ran touching = simulate("touching.json");
    EXPECT_EQ(touching.status, 0) << touching.err;
    EXPECT_THAT(
        touching.err,
        HasSubstr(" (box): touched or overlapped something at the start and was moved by (0, 0, 0.00"));
}

TEST_F(ContactCommands, DatasetsCountPosesThatIntersect) {
    const auto variety = result("dataset box.h5 -o apart.h5 --trajectories 2 --frames 4")["variety"];
    EXPECT_EQ(variety["frames_self_intersecting"], 0);
    EXPECT_EQ(variety["frames"], 8);
    EXPECT_EQ(variety["frames_troubled"], 0);
}

TEST_F(ContactCommands, BenchmarksRun) {
    write_drop("drop.json", "");
    const Ran contact = bench("contact drop.json -o contact.csv --pictures pictures");
    ASSERT_EQ(contact.status, 0) << contact.err;
    const std::string rows = bytes("contact.csv");
    EXPECT_EQ(std::ranges::count(rows, '\n'), 2 + 1);
    EXPECT_THAT(rows, HasSubstr("drop,0,1,108,16,16,0,0,"));
    EXPECT_EQ(test::listing(folder() / "pictures"), std::set<std::string>{"drop.png"});
    const Ran absent = bench("contact absent.json");
    EXPECT_EQ(absent.status, 1);
    EXPECT_EQ(absent.err, "nbdtree-bench: error: absent.json: no such file\n");
}

}  // namespace
}  // namespace nbd
