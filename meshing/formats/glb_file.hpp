#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace nbd {

/// The JSON text and the binary data of a .glb file (glTF 2.0).
class GlbFile {
 public:
    /// Throws std::runtime_error if the file is cut off or no .glb of version 2, its values are nested more
    /// than 64 deep, or it requires an extension that changes where its surfaces are and is not known here.
    explicit GlbFile(const std::filesystem::path& path);

    const nlohmann::json& root() const noexcept { return json_; }

    /// An element of an array of the file, such as root()["nodes"][number]. Throws std::runtime_error if
    /// there is none.
    const nlohmann::json& item(const char* array, std::int64_t number) const;

    /// Positions of an accessor: floats, or integers as KHR_mesh_quantization allows; sparse ones too.
    /// Throws std::runtime_error for other numbers and for those that do not lie in their data.
    std::vector<std::array<double, 3>> positions(std::int64_t accessor) const;
    /// Likewise the unsigned integers of an accessor.
    std::vector<std::int64_t> indices(std::int64_t accessor) const;

 private:
    struct Numbers;
    std::vector<double> numbers(std::int64_t accessor, std::size_t components) const;
    Numbers find(const nlohmann::json& from, std::size_t count, std::size_t components,
                 std::size_t number_bytes, bool has_stride) const;

    nlohmann::json json_;
    std::vector<std::string> buffers_;
};

/// A number of a JSON object; `fallback` if it has none. Throws std::runtime_error for another value.
std::int64_t json_number(const nlohmann::json& object, const char* key, std::int64_t fallback);

}  // namespace nbd
