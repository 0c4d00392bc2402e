#pragma once

#include <filesystem>
#include <functional>

// `pread` of a test program that links this fails when it is told to.
namespace nbd::test {

/// Calls `read` again and again, each time with a later `pread` that fails, until none is left to fail. Where
/// one did, `read` must end with the h5::ReadError of this file, else a check of GoogleTest fails. Returns
/// how many failed.
int with_each_read_failing(const std::filesystem::path& path, const std::function<void()>& read);

}  // namespace nbd::test
