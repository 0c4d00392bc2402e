#pragma once

#include <functional>
#include <span>

#include "apps/view/view_scene.hpp"
#include "sim/scene/scene.hpp"
#include "training/files/recording.hpp"

namespace nbd {

/// Shows a recording of a scene. spec: the scene, with the bounds that are to be drawn and audited. bodies:
/// as loaded from its files. frames: at most so many, evenly spread. progress: hears how many frames are
/// done; may be empty. Throws std::runtime_error, one line with the path, if the recording is of other
/// bodies; and what build_world() and reading throw.
ViewScene view_of_scene(const RecordingReader& recording, SceneSpec spec, std::span<const LoadedBody> bodies,
                        int frames, const std::function<void(int done, int total)>& progress);

}  // namespace nbd
