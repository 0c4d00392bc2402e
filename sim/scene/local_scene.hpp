#pragma once

#include <optional>
#include <span>

#include "sim/scene/scene.hpp"

namespace nbd {

/// The scene with all its positions counted from an origin: zero, unless its bodies lie so far away that
/// float32 would be too coarse for them, see far_origin(). SceneSpec::origin tells it; a scene that has one
/// is returned as it is. bodies: one per spec.bodies. wanted: the origin, where it is known.
SceneSpec local_scene(SceneSpec spec, std::span<const LoadedBody> bodies,
                      std::optional<Eigen::Vector3d> wanted = std::nullopt);

}  // namespace nbd
