#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "meshing/body/body.hpp"
#include "training/files/surface_body.hpp"

namespace nbd {

/// What training needs of a body, in float32. Modes are carried along if the body has them.
SurfaceBody surface_body(const Body& body);

/// Throws std::runtime_error unless a file can stand under `path`: its folder is there and may be written,
/// and what is there already is an ordinary file and none of the command's inputs. So a long command fails
/// before its work and not after it. inputs: that do not exist, or are empty, are ignored.
void check_output(const std::filesystem::path& path, const std::vector<std::filesystem::path>& inputs);

/// Likewise for a folder that will be made where it is missing.
void check_output_folder(const std::filesystem::path& path);

/// Throws std::runtime_error where two of the outputs are one file. outputs: what they are, and where; empty
/// paths are ignored.
void check_distinct(const std::vector<std::pair<std::string, std::filesystem::path>>& outputs);

/// Makes a folder and those that it lies in, where needed. Throws std::runtime_error with path and reason.
void make_folder(const std::filesystem::path& path);

/// Hex SHA-256 of a file's bytes. Throws std::runtime_error with path and reason where it cannot be read.
std::string file_hash(const std::filesystem::path& path);
/// The same of a text.
std::string text_hash(std::string_view text);

}  // namespace nbd
