#include "meshing/formats/write_surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <iterator>
#include <stdexcept>
#include <string>

#include "collision/base/file_name.hpp"
#include "collision/geometry/far_origin.hpp"
#include "meshing/h5/atomic_file.hpp"

namespace nbd {
namespace {

/// At least ten digits, one more than float32 needs, without exponent: some readers, such as assimp's, read
/// whole part, decimals and exponent separately and round in between.
std::string float_decimal(double value) {
    const float x = value;
    if (x == 0) return "0";
    const int decimals = std::clamp(9 - static_cast<int>(std::floor(std::log10(std::abs(x)))), 9, 15);
    return fmt::format("{:.{}f}", x, decimals);
}

std::string obj_text(NodesRef X, FacesRef F, bool is_far) {
    std::string text;
    const auto decimal = [&](double x) { return is_far ? fmt::format("{:.12f}", x) : float_decimal(x); };
    const auto out = std::back_inserter(text);
    for (int v = 0; v < X.rows(); ++v)
        fmt::format_to(out, "v {} {} {}\n", decimal(X(v, 0)), decimal(X(v, 1)), decimal(X(v, 2)));
    for (int f = 0; f < F.rows(); ++f)
        fmt::format_to(out, "f {} {} {}\n", F(f, 0) + 1, F(f, 1) + 1, F(f, 2) + 1);
    return text;
}

template <class T>
void append_little_endian(std::string& bytes, T value) {
    auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
    if (std::endian::native == std::endian::big) std::ranges::reverse(raw);
    bytes.append(raw.data(), raw.size());
}

std::string ply_bytes(NodesRef X, FacesRef F, bool is_far) {
    std::string bytes = fmt::format(
        "ply\nformat binary_little_endian 1.0\nelement vertex {0}\nproperty {2} x\nproperty {2} y\n"
        "property {2} z\nelement face {1}\nproperty list uchar int vertex_indices\nend_header\n",
        X.rows(), F.rows(), is_far ? "double" : "float");
    for (int v = 0; v < X.rows(); ++v)
        for (int k = 0; k < 3; ++k)
            if (is_far)
                append_little_endian(bytes, X(v, k));
            else
                append_little_endian(bytes, static_cast<float>(X(v, k)));
    for (int f = 0; f < F.rows(); ++f) {
        bytes.push_back(3);
        for (int c = 0; c < 3; ++c) append_little_endian(bytes, F(f, c));
    }
    return bytes;
}

}  // namespace

void write_surface(const std::filesystem::path& path, NodesRef X, FacesRef F) {
    const bool is_obj = has_extension(path, ".obj");
    if (!is_obj && !has_extension(path, ".ply"))
        throw std::runtime_error(
            fmt::format("{}: unknown kind of surface file; allowed: .obj .ply", path.string()));
    const bool is_far = !far_origin(X, F).isZero(0);
    h5::AtomicFile file(path);
    file.out() << (is_obj ? obj_text(X, F, is_far) : ply_bytes(X, F, is_far));
    file.commit();
}

}  // namespace nbd
