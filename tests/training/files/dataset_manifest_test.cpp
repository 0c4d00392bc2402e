#include "training/files/dataset_manifest.hpp"

#include <gtest/gtest.h>

#include "tests/support/edit_file.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "training/files/recording_hash.hpp"
#include "training/files/split.hpp"

namespace nbd {
namespace {

using test::error_of;

Vertices frame_of(int id, int frame) {
    return Vertices::Constant(5, 3, static_cast<float>(100 * id + frame));
}

/// Writes trajectories first .. end - 1 with 6 + id frames each. Trajectory 3 fails late, trajectory 4 before
/// its first frame.
void write_recording(const std::filesystem::path& path, int first, int end, const std::string& key) {
    RecordingWriter file(path);
    file.label("dataset", key);
    for (int id = first; id < end; ++id) {
        const int frames = id == 4 ? 0 : 6 + id;
        const int handle = file.begin_trajectory({id, 7, std::string(64, 'b'), "{}", "", 0}, 5);
        for (int frame = 0; frame < frames; ++frame) file.add_frame(handle, frame, frame_of(id, frame));
        file.end_trajectory(handle, id == 3 || id == 4 ? "it burst" : "",
                            {.contacts = std::vector<std::int32_t>(frames, id),
                             .troubled = std::vector<std::int32_t>(frames, id % 2),
                             .self_intersections = {}});
    }
    file.finish();
}

class DatasetView : public test::FileTest {
 protected:
    void SetUp() override {
        write_recording(folder / "a.h5", 0, 3, "key");
        write_recording(folder / "b.h5", 3, 6, "key");
        write_dataset_view(folder / "data.h5", manifest());
    }

    static DatasetManifest manifest() {
        return {.key = "key",
                .plan = "{\"seed\": 7}",
                .shards = {{"a.h5", std::string(64, '1')}, {"b.h5", std::string(64, '2')}},
                .train_trajectories = {0, 5},
                .held_out_trajectories = {1, 2},
                .variety = "{}"};
    }
};

TEST_F(DatasetView, ReadsLikeASingleRecording) {
    write_recording(folder / "one.h5", 0, 6, "key");
    const RecordingReader view(folder / "data.h5"), one(folder / "one.h5");
    EXPECT_EQ(hash_recording(view).hex, hash_recording(one).hex);
    ASSERT_EQ(view.trajectories().size(), 6u);
    Vertices x;
    for (const int id : {5, 0, 3, 5}) {  // switches between the files
        view.read(id, 2, 3, x);
        EXPECT_EQ(x.topRows(5), frame_of(id, 2));
        EXPECT_EQ(x.bottomRows(5), frame_of(id, 4));
        EXPECT_EQ(view.facts(id), one.facts(id));
        EXPECT_EQ(view.times(id), one.times(id));
    }
    EXPECT_EQ(view.trajectories()[3].failure, "it burst");
    EXPECT_EQ(view.trajectories()[4].frames, 0);
}

TEST_F(DatasetView, RoundTripsItsManifest) {
    EXPECT_TRUE(is_dataset_view(folder / "data.h5"));
    EXPECT_FALSE(is_dataset_view(folder / "a.h5"));
    EXPECT_FALSE(is_dataset_view(folder / "none.h5"));
    EXPECT_TRUE(RecordingReader(folder / "data.h5").is_dataset());
    EXPECT_FALSE(RecordingReader(folder / "a.h5").is_dataset());
    const DatasetManifest read = read_dataset_manifest(folder / "data.h5"), written = manifest();
    EXPECT_EQ(read.key, written.key);
    EXPECT_EQ(read.plan, written.plan);
    EXPECT_EQ(read.variety, written.variety);
    EXPECT_EQ(read.train_trajectories, written.train_trajectories);
    EXPECT_EQ(read.held_out_trajectories, written.held_out_trajectories);
    ASSERT_EQ(read.shards.size(), 2u);
    EXPECT_EQ(read.shards[1].file, "b.h5");
    EXPECT_EQ(read.shards[1].sha256, written.shards[1].sha256);
}

TEST_F(DatasetView, IsNotTakenForAnotherFileWhereItIsDamaged) {
    test::write_bytes(folder / "text.h5", "a text");
    EXPECT_FALSE(is_dataset_view(folder / "text.h5"));
    EXPECT_FALSE(is_dataset_view(folder));
    const std::string whole = test::read_bytes(folder / "data.h5");
    for (const std::size_t kept : {whole.size() / 2, whole.size() - 1}) {
        test::write_bytes(folder / "cut.h5", whole.substr(0, kept));
        const std::string error = test::error_of([&] { (void)is_dataset_view(folder / "cut.h5"); });
        EXPECT_TRUE(error.starts_with((folder / "cut.h5").string() + ": is truncated or damaged")) << error;
    }
}

TEST_F(DatasetView, SplitsLikeTrainingUnlessAnotherShareIsGiven) {
    const RecordingReader view(folder / "data.h5");
    const TrainingSplit stored = make_split(view, std::nullopt, 0, 1);
    EXPECT_EQ(stored.train_trajectories, (std::vector<int>{0, 5}));
    EXPECT_EQ(stored.held_out_trajectories, (std::vector<int>{1, 2}));
    EXPECT_EQ(make_split(view, 0.25, 0, 1).held_out_trajectories.size(), 1u);
    const RecordingReader plain(folder / "a.h5");
    EXPECT_EQ(make_split(plain, std::nullopt, 0, 1).held_out_trajectories.size(), 1u);
}

TEST_F(DatasetView, KeepsFurtherSplitsByTheirNames) {
    DatasetManifest more = manifest();
    more.splits.push_back({.name = "parameter", .train = {0, 1}, .held_out = {2, 5}, .rule = "{\"a\": 1}"});
    write_dataset_view(folder / "more.h5", more);
    const DatasetSplit split = read_dataset_manifest(folder / "more.h5").split("parameter");
    EXPECT_EQ(split.train, (std::vector<int>{0, 1}));
    EXPECT_EQ(split.held_out, (std::vector<int>{2, 5}));
    EXPECT_EQ(split.rule, "{\"a\": 1}");
    const RecordingReader view(folder / "more.h5");
    const TrainingSplit taken = make_split(view, std::nullopt, 0, 1, 0.5, "parameter");
    EXPECT_EQ(taken.held_out_trajectories, (std::vector<int>{2, 5}));
    EXPECT_EQ(taken.train_trajectories.size() + taken.calibration_trajectories.size(), 2u);
    EXPECT_EQ(make_split(view, std::nullopt, 0, 1, 0, "trajectories").held_out_trajectories,
              (std::vector<int>{1, 2}));
    EXPECT_EQ(error_of([&] { make_split(view, std::nullopt, 0, 1, 0, "kinds"); }),
              (folder / "more.h5").string() +
                  ": the dataset has no split \"kinds\"; allowed: trajectories, parameter");
    EXPECT_EQ(
        error_of([&] { make_split(RecordingReader(folder / "a.h5"), std::nullopt, 0, 1, 0, "parameter"); }),
        (folder / "a.h5").string() + ": is not a dataset, so it has no split \"parameter\"");
}

TEST_F(DatasetView, RefersToTheExtrasOfItsShards) {
    FrameContents contents{.tets = 4, .contact_edges = ContactDistances{2, 1}};
    for (const FrameFieldName& field : frame_fields) contents.fields[field.field] = true;
    const auto extras_of = [](int id, int frame) {
        FrameExtras extras;
        for (const FrameFieldName& field : frame_fields)
            extras.fields[field.field] =
                Vertices::Constant(field.of_tets ? 12 : 5, 3, static_cast<float>(10 * id + frame));
        if (id > 0) extras.contact_edges = {{frame, id, frame + 1}};
        return extras;
    };
    for (const int id : {0, 1}) {  // trajectory 0 touches nothing
        RecordingWriter file(folder / (id == 0 ? "a.h5" : "b.h5"));
        file.label("dataset", "key");
        const int handle = file.begin_trajectory({id, 7, std::string(64, 'b'), "{}", "", 0}, 5, contents);
        for (int frame = 0; frame < 3; ++frame)
            file.add_frame(handle, frame, frame_of(id, frame), extras_of(id, frame));
        file.finish();
    }
    write_dataset_view(folder / "data.h5", manifest());
    const RecordingReader view(folder / "data.h5");
    for (const int id : {0, 1}) {
        EXPECT_EQ(view.contents(id).tets, 4);
        EXPECT_EQ(view.contents(id).contact_edges, contents.contact_edges);
        const auto extras = view.read_extras(id, 0, 3);
        for (int frame = 0; frame < 3; ++frame) {
            const FrameExtras expected = extras_of(id, frame);
            const FrameExtras& found = extras[frame];
            for (const FrameFieldName& field : frame_fields)
                EXPECT_EQ(found.fields[field.field], expected.fields[field.field]) << field.name;
            EXPECT_EQ(found.contact_edges, expected.contact_edges);
        }
    }
    std::filesystem::remove(folder / "b.h5");
    EXPECT_NE(error_of([&] { RecordingReader(folder / "data.h5"); }), "");
}

TEST_F(DatasetView, NamesTheShardThatIsMissingDamagedOrForeign) {
    const std::string view = (folder / "data.h5").string(), part = (folder / "b.h5").string();
    const std::string whole = test::read_bytes(part);
    const auto error = [&] { return error_of([&] { hash_recording(RecordingReader(folder / "data.h5")); }); };
    EXPECT_EQ(error(), "");
    std::filesystem::remove(part);
    EXPECT_EQ(error(), view + ": cannot read a shard: " + part + ": no such file");
    test::write_bytes(part, whole.substr(0, whole.size() / 2));
    EXPECT_EQ(error().rfind(view + ": cannot read a shard: " + part + ": is truncated or damaged", 0), 0u);
    write_recording(part, 3, 6, "another key");
    EXPECT_EQ(error(), part + ": belongs to another dataset; allowed: the dataset of " + view);
    write_recording(part, 3, 5, "key");
    EXPECT_EQ(error(), part + ": has no '/trajectories/000005/positions'; allowed: a file with this item");
    EXPECT_NE(error_of([&] {
                  DatasetManifest other = manifest();
                  other.key = "another key";
                  write_dataset_view(folder / "other.h5", other);
              }).find("belongs to another dataset"),
              std::string::npos);
    EXPECT_FALSE(std::filesystem::exists(folder / "other.h5"));
}

TEST_F(DatasetView, DetectsRandomDamageOfTheView) {
    const auto read = [](const std::filesystem::path& path) {
        const DatasetManifest m = read_dataset_manifest(path);
        return m.key + m.plan + m.variety + hash_recording(RecordingReader(path)).hex;
    };
    test::expect_damage_is_found(folder / "data.h5", read, 30, 120);
}

}  // namespace
}  // namespace nbd
