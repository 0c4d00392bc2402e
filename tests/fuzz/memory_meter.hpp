#pragma once

#include <cstddef>

namespace nbd::test {

/// Meters the memory that the process takes while the meter lives. Works under the address sanitizer alone;
/// elsewhere it always tells 0 bytes.
class MemoryMeter {
 public:
    MemoryMeter();
    /// The most bytes that were allocated at once since the meter began, beyond those that were allocated
    /// before. Blocks under 4 KiB are counted from time to time.
    std::size_t most() const;

 private:
    std::size_t before_;
};

}  // namespace nbd::test
