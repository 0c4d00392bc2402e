#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "meshing/body/body.hpp"
#include "training/files/surface_body.hpp"

namespace nbd {

/// The body as training needs it, in float32, with modes if the body has them.
SurfaceBody surface_body(const Body& body);

/// Throws std::runtime_error unless a file can be written at `path`: its folder must exist and be writable;
/// an existing file must be an ordinary one and none of the command's inputs. Lets a long command fail before
/// its work. inputs: missing files and empty paths are ignored.
void check_output(const std::filesystem::path& path, const std::vector<std::filesystem::path>& inputs);

/// As check_output(), for a folder that is created if it is missing.
void check_output_folder(const std::filesystem::path& path);

/// Throws std::runtime_error if two outputs are the same file. outputs: name and path of each; empty paths
/// are ignored.
void check_distinct(const std::vector<std::pair<std::string, std::filesystem::path>>& outputs);

/// Creates a folder and its parents as needed. Throws std::runtime_error with path and reason.
void make_folder(const std::filesystem::path& path);

/// Hex SHA-256 of a file's bytes. Throws std::runtime_error with path and reason if it cannot be read.
std::string file_hash(const std::filesystem::path& path);
/// Hex SHA-256 of a text.
std::string text_hash(std::string_view text);

}  // namespace nbd
