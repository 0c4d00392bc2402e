#include "apps/drawing/image.hpp"

#include <fmt/core.h>
#include <png.h>

#include <algorithm>
#include <stdexcept>
#include <string>

#include "meshing/h5/atomic_file.hpp"

namespace nbd {

Image contact_sheet(const std::vector<Image>& images, int columns) {
    const int rows = (images.size() + columns - 1) / columns;
    Image sheet{images.front().width * columns, images.front().height * rows, {}};
    sheet.rgb.assign(std::size_t{3} * sheet.width * sheet.height, 255);
    for (std::size_t i = 0; i < images.size(); ++i) {
        const Image& image = images[i];
        const int left = i % columns * image.width, top = i / columns * image.height;
        for (int y = 0; y < image.height; ++y)
            std::copy_n(image.rgb.begin() + std::ptrdiff_t{3} * y * image.width, image.width * 3,
                        sheet.rgb.begin() + std::ptrdiff_t{3} * (top + y) * sheet.width + 3 * left);
    }
    return sheet;
}

void write_png(const std::filesystem::path& path, const Image& image) {
    png_image header{};
    header.version = PNG_IMAGE_VERSION;
    header.width = image.width;
    header.height = image.height;
    header.format = PNG_FORMAT_RGB;
    std::string bytes(PNG_IMAGE_PNG_SIZE_MAX(header), '\0');
    png_alloc_size_t size = bytes.size();
    if (!png_image_write_to_memory(&header, bytes.data(), &size, 0, image.rgb.data(), 0, nullptr))
        throw std::runtime_error(
            fmt::format("{}: cannot encode the picture: {}", path.string(), header.message));
    bytes.resize(size);
    h5::AtomicFile file(path);
    file.out() << bytes;
    file.commit();
}

}  // namespace nbd
