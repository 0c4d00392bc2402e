#pragma once

#include <filesystem>
#include <string>

namespace nbd::h5 {

/// What a file of ours holds, for people: format, versions, hash, every group with its attributes, every
/// dataset with shape and type. Reads all of it, so that every checksum is verified, and computes the body's
/// SHA-256 anew where the file says over which datasets it goes, and does the same with the files that
/// virtual datasets refer to: a text that is returned is that of a whole file. Throws std::runtime_error with
/// path and item where something is damaged or the file is not ours.
std::string inspect(const std::filesystem::path& path);

}  // namespace nbd::h5
