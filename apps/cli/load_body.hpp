#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "apps/cli/output.hpp"
#include "meshing/body/body.hpp"
#include "sim/scene/scene.hpp"
#include "training/files/surface_body.hpp"
#include "training/files/tree_file.hpp"

namespace nbd {

/// The body as training needs it, in float32, with modes if the body has them.
SurfaceBody surface_body(const Body& body);

/// Loads the tree in file `tree`, which must belong to the body in file `body`. hash: body_hash() of that
/// body. Throws std::runtime_error as load_tree() does, and with both paths if the tree belongs to another
/// body.
TreeFile load_tree_of(const std::filesystem::path& body, const std::string& hash,
                      const std::filesystem::path& tree);

/// Throws std::runtime_error with both paths unless the bodies have identical tetrahedra, so that a recording
/// of one moves the other as well.
void check_same_tets(const std::filesystem::path& path, const TetMesh& tets,
                     const std::filesystem::path& other_path, const TetMesh& other);

/// All files that a scene names, in order.
std::vector<std::filesystem::path> scene_inputs(const SceneSpec& spec);

/// Loads the files of a scene. One that several bodies name is read, and meshed if it is a surface, only
/// once; these bodies share its data.
class SceneFiles {
 public:
    /// Throws what reading, checking and filling throw, one line with the path; std::runtime_error if the
    /// tree belongs to another body.
    LoadedBody load(const SceneBody& spec, const Output& out);

    /// Loads the recordings that obstacles deform by. Throws what reading throws, and std::invalid_argument,
    /// with the obstacle's JSON path, for a recording without such a trajectory or one of another body.
    void load_recordings(SceneSpec& spec);

 private:
    struct Recorded {
        Faces F;
        std::shared_ptr<const SurfaceFrames> frames;  // with the recording's times
    };
    const Recorded& recorded(const SurfaceRecording& from);

    std::shared_ptr<const Body> body(const SceneBody& spec, const Output& out);

    std::map<std::string, std::shared_ptr<const Body>> bodies_;
    std::map<std::pair<const Body*, std::filesystem::path>, std::shared_ptr<const CollisionTree>> trees_;
    std::map<std::string, Recorded> recorded_;
};

/// Loads all bodies of a scene and the recordings of its obstacles, as SceneFiles does.
std::vector<LoadedBody> load_bodies(SceneSpec& spec, const Output& out);

}  // namespace nbd
