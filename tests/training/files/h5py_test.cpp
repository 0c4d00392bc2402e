// Checks the README's claims about our files in Python: plain h5py opens them and finds the same numbers.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "meshing/body/body.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/training/example_tree.hpp"
#include "training/files/dataset_manifest.hpp"
#include "training/files/recording.hpp"

namespace nbd {
namespace {

class H5pyTest : public test::FileTest {};

Body one_tet() {
    Body body;
    body.name = "tet";
    body.tets.X.resize(4, 3);
    body.tets.X << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1;
    body.tets.T.resize(1, 4);
    body.tets.T << 0, 1, 2, 3;
    body.surface = {body.tets.X, boundary_faces(body.tets)};
    body.W.resize(4, 4);
    body.W.setIdentity();
    return body;
}

TEST_F(H5pyTest, ReadsBodyRecordingAndTree) {
    if (std::system("/usr/bin/python3 -c 'import h5py' 2>/dev/null") != 0)
        GTEST_SKIP() << "/usr/bin/python3 has no h5py";
    const Body body = one_tet();
    save_body(folder / "body.h5", body);

    RecordingWriter recording(folder / "shard.h5");
    recording.label("dataset", "the key");
    const int handle = recording.begin_trajectory({4, 9, body_hash(body), "{\"drop\": 1}", "", 0}, 4);
    for (int frame = 0; frame < 70; ++frame)
        recording.add_frame(handle, 0.5 * frame, body.tets.X.cast<float>() * static_cast<float>(frame));
    recording.end_trajectory(handle, "exploded", {.contacts = std::vector<std::int32_t>(70, 5)});
    recording.finish();
    write_dataset_view(folder / "data.h5", {.key = "the key",
                                            .plan = "{\"frames\": 70}",
                                            .shards = {{"shard.h5", std::string(64, 'e')}},
                                            .train_trajectories = {4},
                                            .held_out_trajectories = {},
                                            .variety = "{}"});

    const TreeFile tree = test::example_tree({});
    save_tree(folder / "tree.h5", tree);

    const std::string command =
        fmt::format("cd / && /usr/bin/python3 '{}' '{}' '{}' '{}' '{}' {} {:.9g} {:.9g}", NBD_READ_WITH_H5PY,
                    (folder / "body.h5").string(), (folder / "shard.h5").string(),
                    (folder / "data.h5").string(), (folder / "tree.h5").string(), body_hash(body),
                    tree.tree.nbd->modes.U.numbers()(7, 2), tree.tree.bd->Ubar(1, 3));
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
}

}  // namespace
}  // namespace nbd
