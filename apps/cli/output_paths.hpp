#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace nbd {

/// Throws std::runtime_error unless a file can be written at `path`: its folder must exist and be writable;
/// an existing file must be an ordinary one and none of the command's inputs; its name must end in
/// `extension`, unless that is empty. Lets a long command fail before its work. Removes what killed runs left
/// under temporary names for this output. inputs: missing files and empty paths are ignored.
void check_output(const std::filesystem::path& path, const std::vector<std::filesystem::path>& inputs,
                  std::string_view extension = {});

/// A file that a command may write.
struct OutputFile {
    std::string what;            // for messages
    std::filesystem::path path;  // empty: not asked for
    std::string_view extension;
};

/// As check_output(), of those that are asked for. Also throws std::runtime_error if two are the same file.
void check_outputs(const std::vector<OutputFile>& outputs, const std::vector<std::filesystem::path>& inputs);

/// As check_output(), for a folder that is created if it is missing.
void check_output_folder(const std::filesystem::path& path);

/// Throws std::runtime_error unless `path`, with all links followed, is within `folder`. what: says whose
/// path it is and what to do.
void check_within(const std::filesystem::path& folder, const std::filesystem::path& path,
                  const std::string& what);

/// Throws std::runtime_error if two outputs are the same file. outputs: name and path of each; empty paths
/// are ignored.
void check_distinct(const std::vector<std::pair<std::string, std::filesystem::path>>& outputs);

/// Writes a text to a file, which appears whole or not at all; does nothing for an empty path. Throws
/// std::runtime_error with path and reason.
void write_text(const std::filesystem::path& path, std::string_view text);

/// Creates a folder and its parents as needed. Throws std::runtime_error with path and reason.
void make_folder(const std::filesystem::path& path);

}  // namespace nbd
