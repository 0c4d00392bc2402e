#pragma once

#include <functional>

// `pread` of a test program that links this fails when it is told to.
namespace nbd::test {

/// Calls `read` again and again, each time with a later `pread` that fails, until none is left to fail.
/// `read` must end with an h5::ReadError wherever one did, else a check of GoogleTest fails. Returns how many
/// failed.
int with_each_read_failing(const std::function<void()>& read);

}  // namespace nbd::test
