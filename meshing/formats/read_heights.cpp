#include "meshing/formats/read_heights.hpp"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <csetjmp>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "collision/base/file_name.hpp"
#include "meshing/formats/file_cursor.hpp"
#include "meshing/formats/words.hpp"

namespace nbd {
namespace {

[[noreturn]] void refuse_image(const std::filesystem::path& path, const std::string& what) {
    throw std::runtime_error(fmt::format("{}: {}", path.string(), what));
}

void check_image_size(const std::filesystem::path& path, std::uint64_t width, std::uint64_t height) {
    constexpr std::uint64_t most = most_heights;
    if (width < 2 || height < 2 || width > most || height > most)
        refuse_image(path, fmt::format("is an image of {} x {} pixels; allowed: 2 to {} a side", width,
                                       height, most_heights));
}

/// The pixels of a PNG file in memory. libpng jumps out of a function where something is wrong, so nothing
/// that has to be destroyed is made between.
class PngFile {
 public:
    explicit PngFile(std::string_view bytes) : left_(bytes) {
        png_ =
            png_create_read_struct(PNG_LIBPNG_VER_STRING, this, &fail, [](png_structp, png_const_charp) {});
        if (png_) info_ = png_create_info_struct(png_);
        if (!info_) std::snprintf(error_, sizeof error_, "no memory");
    }
    ~PngFile() { png_destroy_read_struct(&png_, &info_, nullptr); }
    PngFile(const PngFile&) = delete;
    PngFile& operator=(const PngFile&) = delete;

    /// Returns false where something is wrong, see error().
    bool read_head() {
        if (!info_ || setjmp(jump_) != 0) return false;
        png_set_read_fn(png_, this, &take);
        png_set_user_limits(png_, 1 << 20, 1 << 20);
        png_read_info(png_, info_);
        return true;
    }
    /// rows: as many bytes as the image has. Two of a number with 16 bits, the higher one first.
    bool read_rows(std::vector<png_bytep>& rows) {
        if (setjmp(jump_) != 0) return false;
        png_read_image(png_, rows.data());
        png_read_end(png_, nullptr);
        return true;
    }
    png_uint_32 width() const { return png_get_image_width(png_, info_); }
    png_uint_32 height() const { return png_get_image_height(png_, info_); }
    int bits() const { return png_get_bit_depth(png_, info_); }
    bool is_grey() const { return png_get_color_type(png_, info_) == PNG_COLOR_TYPE_GRAY; }
    void interlace() { png_set_interlace_handling(png_); }
    const char* error() const { return error_; }

 private:
    [[noreturn]] static void fail(png_structp png, png_const_charp what) {
        auto* self = static_cast<PngFile*>(png_get_error_ptr(png));
        std::snprintf(self->error_, sizeof self->error_, "%s", what);
        std::longjmp(self->jump_, 1);
    }
    static void take(png_structp png, png_bytep to, std::size_t size) {
        auto* self = static_cast<PngFile*>(png_get_io_ptr(png));
        if (size > self->left_.size()) png_error(png, "the file is cut off");
        std::memcpy(to, self->left_.data(), size);
        self->left_.remove_prefix(size);
    }

    std::string_view left_;
    png_structp png_ = nullptr;
    png_infop info_ = nullptr;
    std::jmp_buf jump_;
    char error_[200] = "";
};

/// bytes: of the rows from the top, one or two a pixel, the higher one first.
Eigen::MatrixXd shares_of(const std::uint8_t* bytes, int width, int height, bool is_wide, int largest) {
    Eigen::MatrixXd shares(height, width);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const std::size_t at = static_cast<std::size_t>(y) * width + x;
            const int value = is_wide ? 256 * bytes[2 * at] + bytes[2 * at + 1] : bytes[at];
            shares(height - 1 - y, x) = static_cast<double>(value) / largest;
        }
    return shares;
}

Eigen::MatrixXd read_png(const std::filesystem::path& path, std::string_view bytes) {
    PngFile png(bytes);
    const auto refuse = [&] {
        refuse_image(path, fmt::format("is no PNG image that can be read: {}", printable(png.error())));
    };
    if (!png.read_head()) refuse();
    check_image_size(path, png.width(), png.height());
    const int bits = png.bits(), width = static_cast<int>(png.width()),
              height = static_cast<int>(png.height());
    if (!png.is_grey() || (bits != 8 && bits != 16))
        refuse_image(path, fmt::format("is an image {} of {} bits; allowed: grey of 8 or 16 bits, without "
                                       "transparency",
                                       png.is_grey() ? "in grey" : "with colours or transparency", bits));
    png.interlace();
    const std::size_t row = static_cast<std::size_t>(width) * (bits / 8);
    std::vector<std::uint8_t> pixels(row * height);
    std::vector<png_bytep> rows;
    for (int y = 0; y < height; ++y) rows.push_back(&pixels[row * y]);
    if (!png.read_rows(rows)) refuse();
    return shares_of(pixels.data(), width, height, bits == 16, (1 << bits) - 1);
}

Eigen::MatrixXd read_pgm(const std::filesystem::path& path) {
    FileCursor in(path);
    const bool is_text = in.is_next("P2");
    if (!is_text && !in.is_next("P5")) refuse_image(path, "is no PGM image: it does not begin with P2 or P5");
    in.skip(2);
    // Comments stand in the head alone; the pixels of P5 may hold any byte.
    const auto head = [&] {
        while (!in.at_end() && in.is_next("#")) in.line();
        return in.number<std::uint32_t>();
    };
    in.read_text();
    const std::uint32_t width = head(), height = head(), largest = head();
    check_image_size(path, width, height);
    if (largest < 1 || largest > 65535)
        refuse_image(path, fmt::format("has {} as its largest number; allowed: 1 to 65535", largest));
    const bool is_wide = largest > 255;
    const std::size_t count = std::size_t{width} * height, size = count * (is_wide ? 2 : 1);
    std::vector<std::uint8_t> pixels;
    if (is_text) {
        in.check_count(static_cast<std::int64_t>(count), "pixels", 1);
        for (std::size_t i = 0; i < count; ++i) {
            const auto value = in.number<std::uint32_t>();
            if (value > largest) in.fail(fmt::format("a pixel is {}; allowed: 0 to {}", value, largest));
            if (is_wide) pixels.push_back(static_cast<std::uint8_t>(value >> 8));
            pixels.push_back(static_cast<std::uint8_t>(value & 255));
        }
    } else {
        if (in.bytes_left() < size + 1)
            refuse_image(path, fmt::format("is cut off: it has {} bytes of pixels; allowed: {}",
                                           in.bytes_left() > 0 ? in.bytes_left() - 1 : 0, size));
        in.skip(1);
        const std::string_view rest = in.bytes().substr(in.bytes().size() - in.bytes_left(), size);
        pixels.assign(rest.begin(), rest.end());
        if (is_wide)
            for (std::size_t i = 0; i < count; ++i)
                if (const std::uint32_t value = 256u * pixels[2 * i] + pixels[2 * i + 1]; value > largest)
                    refuse_image(path, fmt::format("a pixel is {}; allowed: 0 to {}", value, largest));
        for (std::size_t i = 0; !is_wide && i < count; ++i)
            if (pixels[i] > largest)
                refuse_image(path, fmt::format("a pixel is {}; allowed: 0 to {}", pixels[i], largest));
    }
    return shares_of(pixels.data(), static_cast<int>(width), static_cast<int>(height), is_wide,
                     static_cast<int>(largest));
}

/// What parts the numbers of a table: a semicolon or a comma where it has one, else a space for any white
/// space. Of both the semicolon: commas are decimal ones then. Comments begin with #.
char separator_of(std::string_view table) {
    char separator = ' ';
    bool is_comment = false;
    for (const char c : table) {
        if (c == '\n') is_comment = false;
        if (c == '#') is_comment = true;
        if (is_comment) continue;
        if (c == ';') return c;
        if (c == ',') separator = c;
    }
    return separator;
}

}  // namespace

bool is_grey_image(const std::filesystem::path& path) {
    return has_extension(path, ".png") || has_extension(path, ".pgm");
}

Eigen::MatrixXd read_grey_image(const std::filesystem::path& path) {
    if (has_extension(path, ".pgm")) return read_pgm(path);
    const FileCursor file(path);
    return read_png(path, file.bytes());
}

Eigen::MatrixXd read_number_table(const std::filesystem::path& path) {
    const FileCursor file(path);
    std::vector<double> numbers;
    std::size_t columns = 0, line_number = 0;
    const auto refuse = [&](const std::string& what) {
        throw std::runtime_error(fmt::format("{}, line {}: {}", path.string(), line_number, what));
    };
    const char separator = separator_of(file.bytes());
    constexpr std::string_view white = " \t\r";
    const auto next_word = [&](std::string_view& line) {
        const std::size_t end = separator == ' ' ? line.find_first_of(white) : line.find_first_of(separator);
        std::string_view word = line.substr(0, end);
        line.remove_prefix(std::min(line.size(), word.size() + (separator == ' ' ? 0 : 1)));
        word.remove_prefix(std::min(word.size(), word.find_first_not_of(white)));
        return word.substr(0, word.find_last_not_of(white) + 1);
    };
    int rows = 0;
    for (std::string_view left = file.bytes(); !left.empty();) {
        ++line_number;
        std::string_view line = left.substr(0, left.find('\n'));
        left.remove_prefix(std::min(left.size(), line.size() + 1));
        line = line.substr(0, line.find('#'));
        line = line.substr(0, line.find_last_not_of(white) + 1);
        std::size_t here = 0;
        for (;;) {
            line.remove_prefix(std::min(line.size(), line.find_first_not_of(white)));
            if (line.empty()) break;
            const std::string_view word = next_word(line);
            const std::optional<double> number = number_in<double>(word);
            if (!number || !std::isfinite(*number))
                refuse(fmt::format("\"{}\" is no finite number", printable(word)));
            if (++here > most_heights) refuse(fmt::format("has more than {} numbers", most_heights));
            numbers.push_back(*number);
        }
        if (here == 0) continue;
        if (++rows > most_heights) refuse(fmt::format("is row {}; allowed: {} at most", rows, most_heights));
        if (columns == 0) columns = here;
        if (here != columns) refuse(fmt::format("has {} numbers, but the row before has {}", here, columns));
    }
    if (rows < 2 || columns < 2)
        throw std::runtime_error(fmt::format("{}: has {} rows of {} numbers; allowed: at least 2 of 2",
                                             path.string(), rows, columns));
    return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
        numbers.data(), rows, static_cast<Eigen::Index>(columns));
}

}  // namespace nbd
