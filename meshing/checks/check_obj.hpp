#pragma once

#include <filesystem>

namespace nbd {

/// Checks the vertices and the faces of an OBJ file: each vertex has 3, 4 or 6 numbers, as it is, with a
/// weight or with a colour; each corner of a face names a vertex of the file, from 1 on, or from -1 back from
/// the last one before the face. Skips lines that go on behind a backslash, and all other statements. Throws
/// std::runtime_error with the line's number, what it holds and what was allowed.
void check_obj(const std::filesystem::path& path);

}  // namespace nbd
