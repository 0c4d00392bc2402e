#pragma once

#include <memory>
#include <span>

#include "apps/view/make_view.hpp"
#include "sim/scene/scene.hpp"
#include "training/files/recording.hpp"

namespace nbd {

/// The bodies and obstacles of a scene as a page shows them, without readers, starts and contact forces.
/// spec: with the bounds that are to be drawn and audited. bodies: as loaded from its files. world: built of
/// them; the sources refer to it.
ViewSources sources_of_scene(const SceneSpec& spec, std::span<const LoadedBody> bodies,
                             std::shared_ptr<const World> world);

/// A recording of a scene, with `frames` of its frames at most, evenly spread. The sources read from the
/// recording. Throws std::runtime_error, one line with the path, if the recording is of other bodies; and
/// what build_world() and reading throw.
ShownRecording shown_scene(std::shared_ptr<const RecordingReader> recording, SceneSpec spec,
                           std::span<const LoadedBody> bodies, int frames);

/// For titles: ", from (x, y, z) m", or nothing for zero.
std::string from_origin(const Eigen::Vector3d& origin);

/// Which way is up in a scene: against gravity, if there is any.
Eigen::Vector3d up_of(const SceneSpec& spec);

}  // namespace nbd
