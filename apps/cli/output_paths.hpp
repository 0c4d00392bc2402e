#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace nbd {

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

}  // namespace nbd
