#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>

namespace nbd::test {

/// One kind of file that nbdtree reads.
struct Reader {
    std::string_view name;       // also the folder of its inputs in corpus/
    std::string_view extension;  // of its files
    /// Reads a whole file and looks at what it holds. Throws std::exception if the file is refused.
    void (*read)(const std::filesystem::path& file);
    /// How many bytes of memory it may take for each byte of a file, beyond `free_memory`.
    int memory_per_byte;
};

/// Memory that a reader may take for any file: buffers and caches of libraries.
inline constexpr std::size_t free_memory = std::size_t{24} << 20;

/// All kinds.
std::span<const Reader> readers();

/// The reader of this name; null if there is none.
const Reader* find_reader(std::string_view name);

/// Reads a file. Returns whether it was accepted. Ends the process with a message if the file is refused with
/// anything but one short line that people can read, or if the reader takes more memory than it may (checked
/// under the address sanitizer).
bool read_or_refuse(const Reader& reader, const std::filesystem::path& file);

}  // namespace nbd::test
