#pragma once

#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "meshing/surface/mesh.hpp"

namespace nbd {

/// Concatenates plain values in this program's memory layout.
class ByteWriter {
 public:
    template <class T>
    requires std::is_trivially_copyable_v<T>
    void put(const T& value) { bytes_.append(reinterpret_cast<const char*>(&value), sizeof(T)); }

    template <class T>
    void put_all(const std::vector<T>& values) {
        put(values.size());
        for (const T& value : values) put(value);
    }

    void put_nodes(const Nodes& rows) {
        put(rows.rows());
        bytes_.append(reinterpret_cast<const char*>(rows.data()),
                      static_cast<std::size_t>(rows.size()) * sizeof(double));
    }

    const std::string& bytes() const noexcept { return bytes_; }

 private:
    std::string bytes_;
};

/// Reads values that a ByteWriter of the same program wrote, in the same order. Throws std::runtime_error if
/// the bytes end too soon.
class ByteReader {
 public:
    explicit ByteReader(std::string_view bytes) : left_(bytes) {}

    template <class T>
    requires std::is_trivially_copyable_v<T> T get() {
        T value;
        take(&value, sizeof(T));
        return value;
    }

    template <class T>
    std::vector<T> get_all() {
        std::vector<T> values;
        for (auto count = get<std::size_t>(); count > 0; --count) values.push_back(get<T>());
        return values;
    }

    Nodes get_nodes() {
        const auto count = get<Eigen::Index>();
        if (count < 0 || static_cast<std::size_t>(count) > left_.size() / (3 * sizeof(double))) refuse();
        Nodes rows(count, 3);
        take(rows.data(), static_cast<std::size_t>(rows.size()) * sizeof(double));
        return rows;
    }

 private:
    [[noreturn]] static void refuse() { throw std::runtime_error("a record of the journal is too short"); }
    void take(void* to, std::size_t size) {
        if (size > left_.size()) refuse();
        if (size > 0) std::memcpy(to, left_.data(), size);
        left_.remove_prefix(size);
    }

    std::string_view left_;
};

}  // namespace nbd
