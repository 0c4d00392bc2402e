#include "apps/clip/clip.hpp"

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <gtest/gtest.h>

#include <assimp/Importer.hpp>
#include <sstream>

#include "tests/support/error_of.hpp"

namespace nbd {
namespace {

using test::error_of;

/// Two tetrahedra, the second with one more face, that move along a parabola.
Clip clip_of(int frames) {
    Clip clip;
    clip.title = "parabola";
    for (int frame = 0; frame < frames; ++frame) clip.times.push_back(2.5 + 0.25 * frame);
    Faces F(4, 3);
    F << 0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3;
    clip.bodies = {{"left", F, 4}, {"right", F.topRows(3), 5}};
    clip.read = [](int body, int frame, Vertices& x) {
        x = Vertices::Zero(4 + body, 3);
        for (int v = 0; v < 3; ++v) x(v + 1, v) = 1;
        const float t = static_cast<float>(frame);
        x.rowwise() += Eigen::RowVector3f(3.f * static_cast<float>(body), t, 0.1f * t * t);
        x(1, 0) += t;
    };
    return clip;
}

std::string glb_of(const Clip& clip) {
    std::ostringstream out;
    write_glb(out, clip);
    return std::move(out).str();
}

TEST(Glb, AssimpFindsTheVerticesOfAllFrames) {
    const Clip clip = clip_of(5);
    const std::string glb = glb_of(clip);
    Assimp::Importer importer;
    const aiScene* scene =
        importer.ReadFileFromMemory(glb.data(), glb.size(), aiProcess_ValidateDataStructure, "glb");
    ASSERT_NE(scene, nullptr) << importer.GetErrorString();
    ASSERT_EQ(scene->mNumMeshes, 2u);
    for (unsigned b = 0; b < 2; ++b) {
        const aiMesh& mesh = *scene->mMeshes[b];
        const ClipBody& body = clip.bodies[b];
        ASSERT_EQ(mesh.mNumFaces, static_cast<unsigned>(body.F.rows()));
        ASSERT_EQ(mesh.mNumAnimMeshes, 4u);
        for (int frame = 0; frame < 5; ++frame) {
            Vertices x, n;
            clip.read(b, frame, x);
            smooth_normals(x, body.F, n);
            const aiVector3D* positions =
                frame == 0 ? mesh.mVertices : mesh.mAnimMeshes[frame - 1]->mVertices;
            const aiVector3D* normals = frame == 0 ? mesh.mNormals : mesh.mAnimMeshes[frame - 1]->mNormals;
            // Assimp numbers vertices by their first faces since 5.4.
            for (unsigned f = 0; f < mesh.mNumFaces; ++f)
                for (unsigned k = 0; k < 3; ++k) {
                    const unsigned found = mesh.mFaces[f].mIndices[k];
                    const int v = body.F(f, k);
                    ASSERT_LT(found, mesh.mNumVertices);
                    for (int c = 0; c < 3; ++c) {
                        EXPECT_NEAR(positions[found][c], x(v, c), 1e-6) << frame;
                        EXPECT_NEAR(normals[found][c], n(v, c), 1e-6) << frame;
                    }
                }
        }
    }
    ASSERT_EQ(scene->mNumAnimations, 1u);
    EXPECT_EQ(scene->mAnimations[0]->mNumMorphMeshChannels, 2u);
    // z is up in the clip, y in glTF.
    const aiVector3D up = scene->mRootNode->mTransformation * aiVector3D(0, 0, 1);
    EXPECT_NEAR(up.y, 1, 1e-6);
}

TEST(Glb, TheSameClipGivesTheSameBytes) { EXPECT_EQ(glb_of(clip_of(3)), glb_of(clip_of(3))); }

TEST(Glb, ASingleFrameDoesNotMove) {
    const std::string glb = glb_of(clip_of(1));
    EXPECT_EQ(glb.find("\"animations\""), std::string::npos);
    EXPECT_EQ(glb.find("\"targets\""), std::string::npos);
    EXPECT_NE(glb_of(clip_of(2)).find("\"targets\""), std::string::npos);
}

TEST(Glb, TakesAsManyFramesAsItSaysAndNoMore) {
    EXPECT_FALSE(glb_of(clip_of(most_glb_frames)).empty());
    EXPECT_EQ(
        error_of([] { glb_of(clip_of(most_glb_frames + 1)); }),
        "parabola: 241 frames are too many for glTF, where each is a morph target; allowed: at most 240; "
        "--frames picks some, a point cache (--mdd, --pc2) holds all");
}

TEST(Glb, RefusesWhatAFileCannotHold) {
    Clip clip = clip_of(200);
    clip.bodies = {{"huge", Faces::Zero(1, 3), 1'000'000}};
    clip.read = [x = Vertices(Vertices::Zero(1'000'000, 3))](int, int, Vertices& out) { out = x; };
    EXPECT_EQ(error_of([&] { glb_of(clip); }),
              "parabola: would take 4.8 GB as glTF, which holds 4.3 at most; --frames picks fewer of the 200 "
              "frames");
}

TEST(SmoothNormals, AreUnitAndPointOutAndVerticesWithoutFacesHaveOne) {
    const Clip clip = clip_of(1);
    Vertices x, n;
    clip.read(1, 0, x);
    smooth_normals(x, clip.bodies[0].F, n);
    for (int v = 0; v < 5; ++v) EXPECT_NEAR(n.row(v).norm(), 1, 1e-6);
    EXPECT_GT(n.row(1).dot(x.row(1) - x.row(0)), 0);
    EXPECT_EQ(n.row(4), Eigen::RowVector3f(0, 0, 1));
}

}  // namespace
}  // namespace nbd
