#include "meshing/h5/atomic_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <limits>
#include <locale>
#include <stdexcept>
#include <streambuf>

#include "meshing/h5/temporary_files.hpp"

namespace nbd::h5 {

namespace {

/// Stream buffer over a file descriptor. Keeps the errno of the first failed write.
class DescriptorBuffer : public std::streambuf {
 public:
    explicit DescriptorBuffer(int descriptor) : descriptor_(descriptor) {
        setp(bytes_.data(), bytes_.data() + bytes_.size());
    }
    int error() const noexcept { return error_; }

 protected:
    int_type overflow(int_type c) override {
        if (sync() != 0) return traits_type::eof();
        if (!traits_type::eq_int_type(c, traits_type::eof())) sputc(traits_type::to_char_type(c));
        return traits_type::not_eof(c);
    }

    int sync() override {
        for (const char* p = pbase(); p < pptr() && error_ == 0;) {
            const ssize_t n = ::write(descriptor_, p, static_cast<std::size_t>(pptr() - p));
            if (n >= 0)
                p += n;
            else if (errno != EINTR)
                error_ = errno;
        }
        setp(bytes_.data(), bytes_.data() + bytes_.size());
        return error_ == 0 ? 0 : -1;
    }

 private:
    int descriptor_, error_ = 0;
    std::array<char, 1 << 16> bytes_;
};

}  // namespace

struct AtomicFile::Impl {
    TemporaryFile file;
    DescriptorBuffer buffer;
    std::ostream out;
    explicit Impl(const std::filesystem::path& path) : file(path), buffer(file.descriptor()), out(&buffer) {
        out.imbue(std::locale::classic());
        out.precision(std::numeric_limits<double>::max_digits10);
    }
};

AtomicFile::AtomicFile(const std::filesystem::path& path) : impl_(std::make_unique<Impl>(path)) {}
AtomicFile::~AtomicFile() = default;
AtomicFile::AtomicFile(AtomicFile&&) noexcept = default;

std::ostream& AtomicFile::out() noexcept { return impl_->out; }

void AtomicFile::commit() {
    impl_->out.flush();
    if (const int error = impl_->buffer.error())
        throw std::runtime_error(
            fmt::format("{}: cannot write: {}", impl_->file.path().string(), std::strerror(error)));
    impl_->file.commit();
}

}  // namespace nbd::h5
