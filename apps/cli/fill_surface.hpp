#pragma once

#include <filesystem>
#include <string>

#include "apps/cli/mesh_file.hpp"

namespace nbd {

/// Tells how much memory a step takes where it is much, and throws std::runtime_error before it is taken if
/// there is not as much. help: appended to the message.
void check_memory(const std::string& what, double bytes, const char* help, const Output& out);

/// Tells where positions of a body far from zero are counted from.
void tell_origin(const Eigen::Vector3d& origin, const Output& out);

/// Fills a closed surface with tetrahedra, or what MeshFileConfig::edge makes of it. path: for the name and
/// messages. Throws std::invalid_argument as the steps do.
MeshedFile body_within(const std::filesystem::path& path, const TriMesh& surface,
                       const MeshFileConfig& config, const Output& out);

/// Embeds any surface in a cage of MeshFileConfig::cage corners. Throws as make_cage_body().
MeshedFile in_cage(const std::filesystem::path& path, TriMesh surface, const MeshFileConfig& config,
                   Elements elements, const Output& out);

/// Quadratic tetrahedra that bend with at most this error, in a cage with more and more nodes. why: there is
/// one, for a line. Throws std::invalid_argument if no tetrahedra of the largest number do.
MeshedFile searched_cage(const std::filesystem::path& path, const TriMesh& surface, MeshFileConfig config,
                         double error, const std::string& why, const Output& out);

/// The same within a closed surface, by shorter and shorter edges, or else in a cage.
MeshedFile searched(const std::filesystem::path& path, const TriMesh& surface, const MeshFileConfig& config,
                    double error, const Output& out);

}  // namespace nbd
