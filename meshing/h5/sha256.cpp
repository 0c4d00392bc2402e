#include "meshing/h5/sha256.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "collision/base/file_text.hpp"
#include "meshing/h5/reader.hpp"

namespace nbd::h5 {

struct Sha256::Impl {
    EVP_MD_CTX* context = EVP_MD_CTX_new();
    ~Impl() { EVP_MD_CTX_free(context); }
};

Sha256::Sha256() : impl_(std::make_unique<Impl>()) {
    if (!impl_->context || EVP_DigestInit_ex(impl_->context, EVP_sha256(), nullptr) != 1)
        throw std::runtime_error("SHA-256 is not available in this build of OpenSSL");
}

Sha256::~Sha256() = default;

void Sha256::add(std::span<const std::byte> bytes) {
    EVP_DigestUpdate(impl_->context, bytes.data(), bytes.size());
}

std::string Sha256::hex() {
    std::array<unsigned char, 32> digest{};
    EVP_DigestFinal_ex(impl_->context, digest.data(), nullptr);
    static constexpr char digits[] = "0123456789abcdef";
    std::string text;
    for (const unsigned char byte : digest) {
        text += digits[byte >> 4];
        text += digits[byte & 15];
    }
    return text;
}

std::string text_sha256(std::string_view text) {
    Sha256 hash;
    hash.add(std::as_bytes(std::span(text)));
    return hash.hex();
}

std::string file_sha256(const std::filesystem::path& path) {
    require_regular_file(path);
    const auto fail = [&] {
        throw std::runtime_error(fmt::format("{}: cannot be read: {}", path.string(), std::strerror(errno)));
    };
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) fail();
    const std::unique_ptr<const int, void (*)(const int*)> closed(&descriptor,
                                                                  [](const int* d) { ::close(*d); });
    Sha256 hash;
    std::vector<std::byte> bytes(std::size_t{1} << 20);
    for (;;) {
        const ssize_t n = ::read(descriptor, bytes.data(), bytes.size());
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) fail();
        if (n == 0) return hash.hex();
        hash.add(std::span(bytes).first(n));
    }
}

// Hashes memory directly: the bytes in memory must equal the bytes in the file.
static_assert(std::endian::native == std::endian::little);

namespace {

void add_line(Sha256& hash, const std::string& name, Type type, const Shape& shape) {
    const std::string line = fmt::format("{} {} {}\n", name, h5::name(type), text(shape));
    hash.add(std::as_bytes(std::span(line)));
}

void add_stored(Sha256& hash, const Reader& file, const std::string& dataset, Type type, const Shape& shape) {
    constexpr std::size_t piece_bytes = 1 << 22;
    const std::size_t rows = shape[0],
                      row_bytes = size_of(type) * element_count(shape) / std::max<std::size_t>(rows, 1),
                      step = std::max<std::size_t>(1, piece_bytes / std::max<std::size_t>(1, row_bytes));
    std::vector<std::byte> values;
    for (std::size_t begin = 0; begin < rows; begin += step) {
        const std::size_t count = std::min(step, rows - begin);
        values.resize(count * row_bytes);
        file.read_rows(dataset, type, begin, count, values.data());
        hash.add(values);
    }
}

}  // namespace

void add_dataset(Sha256& hash, const std::string& name, Type type, const Shape& shape, const void* values) {
    add_line(hash, name, type, shape);
    hash.add({static_cast<const std::byte*>(values), element_count(shape) * size_of(type)});
}

std::string content_hash(const Reader& file, std::span<const std::string> datasets) {
    Sha256 hash;
    for (const std::string& name : datasets) {
        const Type type = file.type(name);
        const Shape shape = file.check(name, type, Shape(file.shape(name).size(), any));
        if (shape.empty()) file.refuse(fmt::format("dataset '{}' is a scalar", name), "an array");
        add_line(hash, name, type, shape);
        add_stored(hash, file, name, type, shape);
    }
    return hash.hex();
}

}  // namespace nbd::h5
