#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

namespace nbd::h5 {

/// SHA-256 of a stream of bytes, fed piece by piece.
class Sha256 {
 public:
    Sha256();
    ~Sha256();
    void add(std::span<const std::byte> bytes);
    /// 64 lower-case hex digits. Call once.
    std::string hex();

 private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace nbd::h5
