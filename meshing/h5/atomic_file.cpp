#include "meshing/h5/atomic_file.hpp"

#include <fmt/format.h>
#include <stdlib.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <limits>
#include <locale>
#include <stdexcept>
#include <streambuf>
#include <string>

#include "collision/base/temporary_files.hpp"

namespace nbd::h5 {

namespace {

/// Stream buffer over a temporary file, which keeps the error of the first failed write.
class FileBuffer : public std::streambuf {
 public:
    explicit FileBuffer(TemporaryFile& file) : file_(file) {
        setp(bytes_.data(), bytes_.data() + bytes_.size());
    }

 protected:
    int_type overflow(int_type c) override {
        if (sync() != 0) return traits_type::eof();
        if (!traits_type::eq_int_type(c, traits_type::eof())) sputc(traits_type::to_char_type(c));
        return traits_type::not_eof(c);
    }

    int sync() override {
        const bool written = file_.write({pbase(), pptr()});
        setp(bytes_.data(), bytes_.data() + bytes_.size());
        return written ? 0 : -1;
    }

 private:
    TemporaryFile& file_;
    std::array<char, 1 << 16> bytes_;
};

}  // namespace

struct AtomicFile::Impl {
    TemporaryFile file;
    FileBuffer buffer;
    std::ostream out;
    explicit Impl(const std::filesystem::path& path) : file(path), buffer(file), out(&buffer) {
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
    impl_->file.commit();
}

ScratchFolder::ScratchFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "nbdtree_XXXXXX").string();
    if (!mkdtemp(name.data()))
        throw std::runtime_error(
            fmt::format("{}: cannot create this folder: {}", name, std::strerror(errno)));
    path_ = name;
}

ScratchFolder::~ScratchFolder() {
    std::error_code remains;
    std::filesystem::remove_all(path_, remains);
}

}  // namespace nbd::h5
