#include "training/files/recording.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "meshing/h5/reader.hpp"
#include "tests/support/edit_file.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"
#include "tests/training/files/example_recording.hpp"
#include "training/files/recording_format.hpp"
#include "training/files/recording_hash.hpp"

namespace nbd {
namespace {

using test::EditFile;
using test::error_of;
using test::frame_of;
using test::info_of;
using test::write_recording;
using RecordingFile = test::FileTest;

TEST_F(RecordingFile, CountsPositionsFromItsOrigin) {
    const Eigen::Vector3d origin(500'000, -5'400'000.5, 300);
    const auto write_from = [&](const std::filesystem::path& path, const Eigen::Vector3d& from) {
        RecordingWriter file(path, from);
        file.add_frame(file.begin_trajectory(info_of(0), 7), 0, frame_of(0, 0, 7));
        file.finish();
    };
    const std::filesystem::path path = folder / "far.h5", near = folder / "near.h5";
    write_from(path, origin);
    const RecordingReader recording(path);
    EXPECT_EQ(recording.origin(), origin);
    Vertices x;
    recording.read(0, 0, 1, x);
    EXPECT_EQ(x, frame_of(0, 0, 7));
    EXPECT_TRUE(h5::Reader(path, recording_format).has(origin_name));
    write_from(near, Eigen::Vector3d::Zero());
    EXPECT_EQ(RecordingReader(near).origin(), Eigen::Vector3d::Zero());
    EXPECT_FALSE(h5::Reader(near, recording_format).has(origin_name)) << "as files have none from before";
    EXPECT_NE(
        error_of([&] { write_from(near, Eigen::Vector3d(0, NAN, 0)); }).find("its origin is not finite"),
        std::string::npos);
}

FrameExtras extras_of(int frame) {
    FrameExtras extras;
    extras.fields[FrameField::contact_forces] = frame_of(9, frame, 7);
    extras.fields[FrameField::first_piola_stress] = frame_of(8, frame, 3 * 5);
    for (int i = 0; i < frame; ++i) extras.contact_edges.push_back({i, 0, i + frame});
    if (frame > 2) extras.contact_edges.push_back({11, obstacle_partner(1), -1});
    return extras;
}

FrameContents contents_of_extras() {
    FrameContents contents{.tets = 5, .contact_edges = ContactDistances{0.5, 0.25}};
    contents.fields[FrameField::contact_forces] = true;
    contents.fields[FrameField::first_piola_stress] = true;
    return contents;
}

TEST_F(RecordingFile, RoundTripsExtrasOfTrajectoriesThatHaveThem) {
    const auto path = folder / "extras.h5";
    {
        RecordingWriter file(path);
        const int with = file.begin_trajectory(info_of(0), 7, contents_of_extras()),
                  without = file.begin_trajectory(info_of(1), 7);
        for (int frame = 0; frame < 5; ++frame) {
            file.add_frame(with, frame, frame_of(0, frame, 7), extras_of(frame));
            file.add_frame(without, frame, frame_of(1, frame, 7));
        }
        file.finish();
    }
    const RecordingReader file(path);
    EXPECT_EQ(file.contents(0).tets, 5);
    EXPECT_EQ(file.contents(0).contact_edges, (ContactDistances{0.5, 0.25}));
    EXPECT_FALSE(file.has(0, FrameField::deformation_gradients));
    for (const FrameFieldName& field : frame_fields) EXPECT_FALSE(file.has(1, field.field)) << field.name;
    EXPECT_FALSE(file.contents(1).contact_edges);
    Vertices x;
    file.read_field(0, FrameField::contact_forces, 3, 2, x);
    EXPECT_EQ(x.topRows(7), frame_of(9, 3, 7));
    EXPECT_EQ(x.bottomRows(7), frame_of(9, 4, 7));
    file.read_field(0, FrameField::first_piola_stress, 1, 1, x);
    EXPECT_EQ(x, frame_of(8, 1, 15));
    file.read(0, 3, 1, x);
    EXPECT_EQ(x, frame_of(0, 3, 7));
    const auto all = file.read_extras(0, 0, 5);
    ASSERT_EQ(all.size(), 5u);
    EXPECT_EQ(all[4].contact_edges.size(), 5u);
    for (int frame = 0; frame < 5; ++frame)
        EXPECT_EQ(all[frame].contact_edges, extras_of(frame).contact_edges);
    EXPECT_EQ(file.read_contact_edges(0, 2, 1).front(), extras_of(2).contact_edges);
    EXPECT_EQ(error_of([&] { file.read_field(1, FrameField::contact_forces, 0, 1, x); }),
              path.string() + ": trajectory 1 has no contact_forces");
    EXPECT_EQ(error_of([&] { file.read_contact_edges(1, 0, 1); }),
              path.string() + ": trajectory 1 has no contact edges");
}

TEST_F(RecordingFile, StoresTheRecipeOfTheBodiesOfASceneOnce) {
    const auto path = folder / "scene.h5";
    const std::vector<std::string> recipes{"the scene", "the scene", "another", "another", "the scene", ""};
    {
        RecordingWriter file(path);
        for (int id = 0; const std::string& recipe : recipes) {
            TrajectoryInfo info = info_of(id++);
            info.recipe = recipe;
            file.begin_trajectory(info, 7);
        }
        file.finish();
    }
    const h5::Reader stored(path, recording_format);
    const auto link = [&](int id) { return stored.link_target(trajectory_group(id) + "/recipe"); };
    EXPECT_EQ(link(0), "");
    EXPECT_EQ(link(1), "/" + trajectory_group(0) + "/recipe");
    EXPECT_EQ(link(3), "/" + trajectory_group(2) + "/recipe");
    const RecordingReader file(path);
    const auto recipe = [&](int id) -> const std::string& { return file.trajectories()[id].recipe; };
    for (int id = 0; const std::string& expected : recipes) EXPECT_EQ(recipe(id++), expected);
    EXPECT_EQ(&recipe(0), &recipe(1)) << "equal recipes share their memory";
}

TEST_F(RecordingFile, RefusesExtrasThatAreNotAsAnnounced) {
    const auto path = folder / "extras.h5";
    RecordingWriter file(path);
    const int with = file.begin_trajectory(info_of(0), 7, contents_of_extras()),
              without = file.begin_trajectory(info_of(1), 7);
    const auto error = [&](int handle, auto change) {
        FrameExtras extras;
        if (handle == with) extras = extras_of(3);
        change(extras);
        return error_of([&] { file.add_frame(handle, 1, frame_of(0, 1, 7), extras); });
    };
    const std::string start = path.string() + ": a frame of trajectory 0 has ";
    EXPECT_EQ(error(with, [](auto& e) { e.fields[FrameField::contact_forces] = Vertices(); }),
              start + "0 rows of contact_forces; allowed: 7");
    EXPECT_EQ(error(with, [](auto& e) { e.fields[FrameField::deformation_gradients] = Vertices(15, 3); }),
              start + "15 rows of deformation_gradients; allowed: 0");
    EXPECT_EQ(error(with, [](auto& e) { e.fields[FrameField::first_piola_stress](3, 1) = NAN; }),
              path.string() +
                  ": a number of first_piola_stress at 1 s of trajectory 0 is not finite; allowed: finite "
                  "numbers");
    EXPECT_EQ(error(with, [](auto& e) { std::swap(e.contact_edges[0], e.contact_edges[1]); }),
              start + "the contact edge (0, 0, 3); allowed: ascending edges, each once");
    EXPECT_EQ(error(with, [](auto& e) { e.contact_edges[0].face = -1; }),
              start + "the contact edge (-1, 0, 3); allowed: faces from 0 on");
    EXPECT_EQ(error(with, [](auto& e) { e.contact_edges[0].other = 0; }),
              start + "the contact edge (0, 0, 0); allowed: the lower face of the body itself first");
    EXPECT_EQ(error(with, [](auto& e) { e.contact_edges.back().other = 2; }),
              start + "the contact edge (11, -3, 2); allowed: face -1 of an obstacle");
    EXPECT_EQ(error(without,
                    [](auto& e) {
                        e.contact_edges.push_back({0, 1, 2});
                    }),
              path.string() + ": a frame of trajectory 1 has contact edges; allowed: none");
    FrameContents none;
    none.fields[FrameField::first_piola_stress] = true;
    EXPECT_EQ(error_of([&] { file.begin_trajectory(info_of(2), 7, none); }),
              path.string() + ": trajectory 2 has first_piola_stress of 0 tetrahedra; allowed: at least 1");
}

TEST_F(RecordingFile, RoundTripsEveryFrameBitForBit) {
    const auto path = folder / "data.h5";
    write_recording(path, 3);
    const RecordingReader file(path);
    ASSERT_EQ(file.trajectories().size(), 3u);
    for (int id = 0; id < 3; ++id) {
        const TrajectoryInfo& info = file.trajectories()[id];
        EXPECT_EQ(info.id, id);
        EXPECT_EQ(info.seed, info_of(id).seed);
        EXPECT_EQ(info.body_hash, info_of(id).body_hash);
        EXPECT_EQ(info.recipe, info_of(id).recipe);
        EXPECT_EQ(info.failure, id == 1 ? "tetrahedron 3 inverted" : "");
        ASSERT_EQ(info.frames, 10 + id);
        EXPECT_EQ(file.nodes(id), 7);
        EXPECT_EQ(file.times(id)[3], 3 * 0.1);
        Vertices x;
        for (int frame = 0; frame < info.frames; ++frame) {
            file.read(id, frame, 1, x);
            EXPECT_EQ(x, frame_of(id, frame, 7));
        }
        file.read(id, 4, 5, x);
        ASSERT_EQ(x.rows(), 35);
        EXPECT_EQ(x.bottomRows(7), frame_of(id, 8, 7));
        file.read(id, 0, 0, x);
        EXPECT_EQ(x.rows(), 0);
    }
    EXPECT_EQ(files_in_folder(), 1u);
}

TEST_F(RecordingFile, InterleavesTrajectoriesAndSortsThemById) {
    const auto path = folder / "scene.h5";
    {
        RecordingWriter file(path);
        const int big = file.begin_trajectory(info_of(12), 40000),
                  small = file.begin_trajectory(info_of(3), 5);
        for (int frame = 0; frame < 7; ++frame) {
            file.add_frame(big, frame, frame_of(12, frame, 40000));
            if (frame % 2) file.add_frame(small, frame, frame_of(3, frame, 5));
        }
        file.finish();
    }
    const RecordingReader file(path);
    ASSERT_EQ(file.trajectories().size(), 2u);
    EXPECT_EQ(file.trajectories()[0].id, 3);
    EXPECT_EQ(file.times(0), (std::vector<double>{1, 3, 5}));
    Vertices x, y;
    file.read(0, 2, 1, x);
    EXPECT_EQ(x, frame_of(3, 5, 5));
    file.read(1, 3, 4, x);
    file.read(0, 0, 1, y);
    EXPECT_EQ(x.topRows(40000), frame_of(12, 3, 40000));
    EXPECT_EQ(y, frame_of(3, 1, 5));
}

TEST_F(RecordingFile, WritesFromAViewIntoALargerMatrix) {
    Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> wide(4, 6);
    for (int i = 0; i < wide.size(); ++i) wide.data()[i] = static_cast<float>(i);
    RecordingWriter writer(folder / "data.h5");
    const int handle = writer.begin_trajectory(info_of(0), 4);
    writer.add_frame(handle, 0, wide.middleCols<3>(2));
    writer.finish();
    Vertices x;
    RecordingReader(folder / "data.h5").read(0, 0, 1, x);
    EXPECT_EQ(x, wide.middleCols<3>(2));
}

TEST_F(RecordingFile, AppearsUnderItsNameOnlyWhenFinished) {
    {
        RecordingWriter file(folder / "data.h5");
        const int handle = file.begin_trajectory(info_of(0), 4);
        file.add_frame(handle, 0, frame_of(0, 0, 4));
        EXPECT_FALSE(std::filesystem::exists(folder / "data.h5"));
    }
    EXPECT_EQ(files_in_folder(), 0u);
}

TEST_F(RecordingFile, MayBeEmpty) {
    RecordingWriter(folder / "data.h5").finish();
    EXPECT_TRUE(RecordingReader(folder / "data.h5").trajectories().empty());
}

TEST_F(RecordingFile, RejectsFramesThatItCannotStore) {
    const auto path = folder / "data.h5";
    RecordingWriter file(path);
    const std::string where = path.string() + ": ";
    const int handle = file.begin_trajectory(info_of(2), 4);
    file.add_frame(handle, 1, frame_of(2, 0, 4));
    EXPECT_EQ(error_of([&] { file.add_frame(handle, 2, frame_of(2, 0, 5)); }),
              where + "a frame of trajectory 2 has 5 nodes; allowed: 4");
    EXPECT_EQ(error_of([&] { file.add_frame(handle, 1, frame_of(2, 0, 4)); }),
              where + "a frame of trajectory 2 has time 1 s; allowed: finite, later than 1 s");
    Vertices x = frame_of(2, 0, 4);
    x(2, 1) = std::numeric_limits<float>::infinity();
    EXPECT_EQ(error_of([&] { file.add_frame(handle, 2, x); }),
              where + "a position at 2 s of trajectory 2 is not finite; allowed: finite numbers");
    EXPECT_EQ(error_of([&] { file.begin_trajectory(info_of(2), 4); }),
              where + "trajectory id 2; allowed: at least 0, each once");
    EXPECT_EQ(error_of([&] { file.begin_trajectory(info_of(3), 0); }),
              where + "trajectory 3 has 0 nodes; allowed: at least 1");
    EXPECT_EQ(error_of([&] { file.end_trajectory(99); }), where + "no open trajectory has handle 99");
    file.finish();
    EXPECT_EQ(RecordingReader(path).trajectories()[0].frames, 1);
}

TEST_F(RecordingFile, RejectsARangeOutsideTheTrajectory) {
    const auto path = folder / "data.h5";
    write_recording(path, 2);
    const RecordingReader file(path);
    Vertices x;
    EXPECT_THROW(file.read(0, 0, 11, x), std::out_of_range);
    EXPECT_THROW(file.read(0, -1, 1, x), std::out_of_range);
    EXPECT_EQ(error_of([&] { file.read(1, 5, 7, x); }),
              path.string() + ": 7 frames from 5 of trajectory 1; allowed: within its 11 frames");
    EXPECT_EQ(error_of([&] { file.nodes(2); }), path.string() + ": trajectory index 2; allowed: 0 to 1");
}

TEST_F(RecordingFile, HashesItsPositionsOnly) {
    write_recording(folder / "a.h5", 2);
    write_recording(folder / "b.h5", 2);
    write_recording(folder / "c.h5", 3);
    const std::string hash = hash_recording(RecordingReader(folder / "a.h5")).hex;
    EXPECT_EQ(hash.size(), 64u);
    EXPECT_EQ(hash_recording(RecordingReader(folder / "b.h5")).hex, hash);
    EXPECT_NE(hash_recording(RecordingReader(folder / "c.h5")).hex, hash);
    EditFile(folder / "b.h5").set("trajectories/000001/positions", 5, 0.25f);
    EXPECT_NE(hash_recording(RecordingReader(folder / "b.h5")).hex, hash);
}

}  // namespace
}  // namespace nbd
