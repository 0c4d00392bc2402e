#include "apps/picture.hpp"

#include <fmt/core.h>
#include <png.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "meshing/h5/atomic_file.hpp"

namespace nbd {
namespace {

constexpr int samples = 2;  // per pixel and axis

/// Colour and depth at sample resolution.
struct Canvas {
    int width, height;
    std::vector<Eigen::Vector3f> colour;
    std::vector<float> depth;
    Canvas(int w, int h)
        : width(w * samples),
          height(h * samples),
          colour(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), Eigen::Vector3f::Ones()),
          depth(colour.size(), std::numeric_limits<float>::infinity()) {}
};

/// p: corners in sample coordinates, z = depth.
void fill(Canvas& canvas, const std::array<Eigen::Vector3f, 3>& p, const Eigen::Vector3f& colour) {
    const Eigen::Vector2f ab = (p[1] - p[0]).head<2>(), ac = (p[2] - p[0]).head<2>();
    const float area = ab.x() * ac.y() - ab.y() * ac.x();
    if (std::abs(area) < 1e-12f) return;
    const auto bound = [](float v, int limit) { return std::clamp(static_cast<int>(v), 0, limit); };
    const int x0 = bound(std::floor(std::min({p[0].x(), p[1].x(), p[2].x()})), canvas.width - 1);
    const int x1 = bound(std::ceil(std::max({p[0].x(), p[1].x(), p[2].x()})), canvas.width - 1);
    const int y0 = bound(std::floor(std::min({p[0].y(), p[1].y(), p[2].y()})), canvas.height - 1);
    const int y1 = bound(std::ceil(std::max({p[0].y(), p[1].y(), p[2].y()})), canvas.height - 1);
    for (int y = y0; y <= y1; ++y)
        for (int x = x0; x <= x1; ++x) {
            const Eigen::Vector2f d =
                Eigen::Vector2f(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f) - p[0].head<2>();
            const float u = (d.x() * ac.y() - d.y() * ac.x()) / area,
                        v = (ab.x() * d.y() - ab.y() * d.x()) / area;
            if (u < 0 || v < 0 || u + v > 1) continue;
            const float z = p[0].z() + u * (p[1].z() - p[0].z()) + v * (p[2].z() - p[0].z());
            const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(canvas.width) +
                                  static_cast<std::size_t>(x);
            if (z >= canvas.depth[i]) continue;
            canvas.depth[i] = z;
            canvas.colour[i] = colour;
        }
}

Image average_samples(const Canvas& canvas) {
    Image image{canvas.width / samples, canvas.height / samples, {}};
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            Eigen::Vector3f sum = Eigen::Vector3f::Zero();
            for (int j = 0; j < samples; ++j)
                for (int i = 0; i < samples; ++i)
                    sum += canvas.colour[static_cast<std::size_t>(y * samples + j) *
                                             static_cast<std::size_t>(canvas.width) +
                                         static_cast<std::size_t>(x * samples + i)];
            for (int c = 0; c < 3; ++c)
                image.rgb.push_back(static_cast<std::uint8_t>(
                    std::lround(255 * std::clamp(sum[c] / (samples * samples), 0.f, 1.f))));
        }
    return image;
}

}  // namespace

Image draw(const std::vector<PictureSurface>& surfaces, const Camera& camera, int width, int height) {
    const Eigen::Vector3f forward = (camera.target - camera.eye).normalized();
    const Eigen::Vector3f right = forward.cross(Eigen::Vector3f::UnitZ()).normalized(),
                          up = right.cross(forward);
    const Eigen::Vector3f light = (0.4f * right + 0.8f * up - forward).normalized();
    Canvas canvas(width, height);
    const float scale = static_cast<float>(canvas.height) / camera.extent;
    for (const PictureSurface& surface : surfaces) {
        for (int f = 0; f < surface.F.rows(); ++f) {
            std::array<Eigen::Vector3f, 3> world, screen;
            for (std::size_t c = 0; c < 3; ++c) {
                world[c] = surface.x.row(surface.F(f, static_cast<int>(c)));
                const Eigen::Vector3f d = world[c] - camera.target;
                screen[c] = {static_cast<float>(canvas.width) / 2 + scale * d.dot(right),
                             static_cast<float>(canvas.height) / 2 - scale * d.dot(up), d.dot(forward)};
            }
            const Eigen::Vector3f n = (world[1] - world[0]).cross(world[2] - world[0]).normalized();
            if (n.dot(forward) > 0) continue;  // faces away
            const float shade = 0.35f + 0.65f * std::max(0.f, n.dot(light));
            fill(canvas, screen, shade * surface.colour);
        }
    }
    return average_samples(canvas);
}

Image contact_sheet(const std::vector<Image>& images, int columns) {
    const int rows = (static_cast<int>(images.size()) + columns - 1) / columns;
    Image sheet{images.front().width * columns, images.front().height * rows, {}};
    sheet.rgb.assign(static_cast<std::size_t>(sheet.width) * static_cast<std::size_t>(sheet.height) * 3, 255);
    for (std::size_t i = 0; i < images.size(); ++i) {
        const Image& image = images[i];
        const int left = static_cast<int>(i) % columns * image.width,
                  top = static_cast<int>(i) / columns * image.height;
        for (int y = 0; y < image.height; ++y)
            std::copy_n(image.rgb.begin() + static_cast<std::ptrdiff_t>(y) * image.width * 3, image.width * 3,
                        sheet.rgb.begin() + (static_cast<std::ptrdiff_t>(top + y) * sheet.width + left) * 3);
    }
    return sheet;
}

void write_png(const std::filesystem::path& path, const Image& image) {
    png_image header{};
    header.version = PNG_IMAGE_VERSION;
    header.width = static_cast<png_uint_32>(image.width);
    header.height = static_cast<png_uint_32>(image.height);
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
