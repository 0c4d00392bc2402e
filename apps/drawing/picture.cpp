#include "apps/drawing/picture.hpp"

#include <fmt/core.h>
#include <png.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "meshing/h5/atomic_file.hpp"

namespace nbd {
namespace {

/// Calls visit(x, y, weights) for every grid cell whose centre lies in the triangle. weights: barycentric. p:
/// corners, in cells.
template <class Visit>
void for_each_cell(const std::array<Eigen::Vector2f, 3>& p, int width, int height, const Visit& visit) {
    const Eigen::Vector2f ab = p[1] - p[0], ac = p[2] - p[0];
    const float area = ab.x() * ac.y() - ab.y() * ac.x();
    if (!(std::abs(area) > 1e-12f)) return;
    const auto bound = [](float v, int limit) {
        return static_cast<int>(std::clamp(v, 0.f, static_cast<float>(limit - 1)));
    };
    const auto [left, right] = std::minmax({p[0].x(), p[1].x(), p[2].x()});
    const auto [top, bottom] = std::minmax({p[0].y(), p[1].y(), p[2].y()});
    if (right < 0 || bottom < 0 || left > static_cast<float>(width) || top > static_cast<float>(height))
        return;
    for (int y = bound(top, height); y <= bound(bottom, height); ++y)
        for (int x = bound(left, width); x <= bound(right, width); ++x) {
            const Eigen::Vector2f d =
                Eigen::Vector2f(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f) - p[0];
            const float u = (d.x() * ac.y() - d.y() * ac.x()) / area,
                        v = (ab.x() * d.y() - ab.y() * d.x()) / area;
            if (u >= 0 && v >= 0 && u + v <= 1) visit(x, y, Eigen::Vector3f(1 - u - v, u, v));
        }
}

/// Shadow map of a light: the nearest depth in every cell of a square. Points behind it are in shadow.
class DepthMap {
 public:
    /// The light shines along `direction` (unit) on a ball.
    DepthMap(const Eigen::Vector3f& direction, const Eigen::Vector3f& centre, float radius)
        : forward_(direction),
          right_(direction.unitOrthogonal()),
          up_(right_.cross(direction)),
          centre_(centre),
          cells_per_metre_(static_cast<float>(cells) / (2 * radius)),
          depth_(cells * cells, std::numeric_limits<float>::infinity()) {}

    void add(const std::array<Eigen::Vector3f, 3>& triangle) {
        std::array<Eigen::Vector3f, 3> p;
        for (std::size_t c = 0; c < 3; ++c) p[c] = seen(triangle[c]);
        for_each_cell({Eigen::Vector2f(p[0].head<2>()), p[1].head<2>(), p[2].head<2>()}, cells, cells,
                      [&](int x, int y, const Eigen::Vector3f& w) {
                          float& nearest = at(x, y);
                          nearest = std::min(nearest, w[0] * p[0].z() + w[1] * p[1].z() + w[2] * p[2].z());
                      });
    }

    /// Share of the light that reaches a point, softened over a few cells.
    float light_at(const Eigen::Vector3f& p) const {
        const Eigen::Vector3f q = seen(p);
        const float bias = 2.5f / cells_per_metre_;
        int lit = 0, count = 0;
        for (int dy = -3; dy <= 3; ++dy)
            for (int dx = -3; dx <= 3; ++dx) {
                const int x = static_cast<int>(std::floor(q.x())) + dx,
                          y = static_cast<int>(std::floor(q.y())) + dy;
                ++count;
                lit += x < 0 || y < 0 || x >= cells || y >= cells || q.z() < depth_[y * cells + x] + bias;
            }
        return static_cast<float>(lit) / static_cast<float>(count);
    }

 private:
    static constexpr int cells = 1200;  // per side

    float& at(int x, int y) { return depth_[y * cells + x]; }
    /// A point as the light sees it: x, y in cells, depth in metres.
    Eigen::Vector3f seen(const Eigen::Vector3f& p) const {
        const Eigen::Vector3f d = p - centre_;
        constexpr float middle = cells / 2.f;
        return {middle + cells_per_metre_ * d.dot(right_), middle + cells_per_metre_ * d.dot(up_),
                d.dot(forward_)};
    }

    Eigen::Vector3f forward_, right_, up_, centre_;
    float cells_per_metre_;
    std::vector<float> depth_;
};

constexpr int samples = 3;      // per pixel and axis
constexpr float crease = 0.7f;  // cosine of the angle between faces beyond which an edge is sharp

using Corners = std::array<Eigen::Vector3f, 3>;

Corners corners(const PictureSurface& surface, int f) {
    return {Eigen::Vector3f(surface.x.row(surface.F(f, 0))), surface.x.row(surface.F(f, 1)),
            surface.x.row(surface.F(f, 2))};
}

/// Normals at the corners of every face, averaged over the faces around the vertex, except those beyond a
/// sharp edge.
std::vector<Corners> corner_normals(const PictureSurface& surface) {
    const int faces = surface.F.rows();
    std::vector<Eigen::Vector3f> area(faces);
    std::vector<std::vector<int>> around(surface.x.rows());
    for (int f = 0; f < faces; ++f) {
        const Corners p = corners(surface, f);
        area[f] = (p[1] - p[0]).cross(p[2] - p[0]);
        for (int c = 0; c < 3; ++c) around[surface.F(f, c)].push_back(f);
    }
    std::vector<Corners> normals(faces);
    for (int f = 0; f < faces; ++f) {
        const Eigen::Vector3f& own = area[f];
        for (int c = 0; c < 3; ++c) {
            Eigen::Vector3f sum = Eigen::Vector3f::Zero();
            for (const int g : around[surface.F(f, c)]) {
                const Eigen::Vector3f& other = area[g];
                if (own.dot(other) >= crease * own.norm() * other.norm()) sum += other;
            }
            normals[f][c] = sum.stableNormalized();
        }
    }
    return normals;
}

class Drawing {
 public:
    Drawing(const std::vector<PictureSurface>& surfaces, const std::vector<PictureFloor>& floors,
            const Camera& camera, int width, int height)
        : floors_(floors),
          camera_(camera),
          right_(camera.forward.cross(camera.up).normalized()),
          up_(right_.cross(camera.forward)),
          to_light_((0.45f * right_ + 0.9f * camera.up.normalized() - 0.55f * camera.forward).normalized()),
          ball_(ball_around(surfaces)),
          shadow_(-to_light_, ball_.head<3>(), ball_[3]),
          width_(width * samples),
          height_(height * samples),
          cell_(camera.extent / static_cast<float>(height_)),
          samples_(static_cast<std::size_t>(width_) * height_) {
        for (const PictureSurface& surface : surfaces) add(surface);
    }

    Image picture() const {
        Image image{width_ / samples, height_ / samples, {}};
        image.rgb.reserve(std::size_t{3} * image.width * image.height);
        for (int y = 0; y < image.height; ++y)
            for (int x = 0; x < image.width; ++x) {
                Eigen::Vector3f sum = Eigen::Vector3f::Zero();
                for (int j = 0; j < samples; ++j)
                    for (int i = 0; i < samples; ++i) sum += colour(x * samples + i, y * samples + j);
                for (int c = 0; c < 3; ++c) {
                    const float mean = std::clamp(sum[c] / (samples * samples), 0.f, 1.f);
                    image.rgb.push_back(static_cast<std::uint8_t>(std::lround(255 * mean)));
                }
            }
        return image;
    }

 private:
    /// The surface point seen through a sample.
    struct Seen {
        float depth = std::numeric_limits<float>::infinity();
        Eigen::Vector3f normal, colour;
    };

    /// Ball around the surfaces: x, y, z, radius.
    static Eigen::Vector4f ball_around(const std::vector<PictureSurface>& surfaces) {
        Eigen::AlignedBox3f box;
        for (const PictureSurface& surface : surfaces)
            for (Eigen::Index i = 0; i < surface.x.rows(); ++i) box.extend(Eigen::Vector3f(surface.x.row(i)));
        if (box.isEmpty()) return {0, 0, 0, 1};
        const Eigen::Vector3f centre = box.center();
        return {centre.x(), centre.y(), centre.z(), std::max(1e-6f, 0.51f * box.diagonal().norm())};
    }

    void add(const PictureSurface& surface) {
        const std::vector<Corners> normals = corner_normals(surface);
        for (int f = 0; f < surface.F.rows(); ++f) {
            const Corners p = corners(surface, f);
            shadow_.add(p);
            if ((p[1] - p[0]).cross(p[2] - p[0]).dot(camera_.forward) >= 0) continue;  // faces away
            Corners q;
            std::array<Eigen::Vector2f, 3> cells;
            for (std::size_t c = 0; c < 3; ++c) {
                q[c] = camera_.seen(p[c]);
                cells[c] = {static_cast<float>(width_) / 2 + q[c].x() / cell_,
                            static_cast<float>(height_) / 2 - q[c].y() / cell_};
            }
            const Corners& n = normals[f];
            for_each_cell(cells, width_, height_, [&](int x, int y, const Eigen::Vector3f& w) {
                Seen& seen = samples_[index(x, y)];
                const float depth = w[0] * q[0].z() + w[1] * q[1].z() + w[2] * q[2].z();
                if (depth >= seen.depth) return;
                seen = {depth, (w[0] * n[0] + w[1] * n[1] + w[2] * n[2]).normalized(), surface.colour};
            });
        }
    }

    std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * width_ + x; }

    Eigen::Vector3f colour(int x, int y) const {
        const Eigen::Vector3f start =
            camera_.target +
            cell_ * ((static_cast<float>(x) + 0.5f - static_cast<float>(width_) / 2) * right_ -
                     (static_cast<float>(y) + 0.5f - static_cast<float>(height_) / 2) * up_);
        const Seen& seen = samples_[index(x, y)];
        const PictureFloor* floor = nullptr;
        float depth = seen.depth;
        for (const PictureFloor& candidate : floors_) {
            const float slope = candidate.normal.dot(camera_.forward);
            if (slope > -1e-3f) continue;
            const float there = candidate.normal.dot(candidate.point - start) / slope;
            if (there >= depth) continue;
            depth = there;
            floor = &candidate;
        }
        const Eigen::Vector3f p = start + depth * camera_.forward;
        if (floor) return floor_colour(*floor, p);
        return std::isfinite(depth) ? surface_colour(seen, p) : Eigen::Vector3f::Ones();
    }

    Eigen::Vector3f surface_colour(const Seen& seen, const Eigen::Vector3f& p) const {
        const float facing = seen.normal.dot(to_light_);
        const float light = facing > 0 ? facing * shadow_.light_at(p + 3 * cell_ * seen.normal) : 0;
        const float sky = 0.5f + 0.5f * seen.normal.dot(camera_.up);
        const Eigen::Vector3f half = (to_light_ - camera_.forward).normalized();
        const float shine = light > 0 ? 0.12f * std::pow(std::max(0.f, seen.normal.dot(half)), 40.f) : 0;
        return (0.36f + 0.22f * sky + 0.54f * light) * seen.colour + shine * Eigen::Vector3f::Ones();
    }

    /// Light grey with faint grid lines and shadows, fading to white away from the target.
    Eigen::Vector3f floor_colour(const PictureFloor& floor, const Eigen::Vector3f& p) const {
        const Eigen::Vector3f u = floor.normal.unitOrthogonal(), v = floor.normal.cross(u),
                              d = p - floor.point;
        const auto to_line = [&](const Eigen::Vector3f& axis) {
            const float t = d.dot(axis) / floor.grid;
            return std::abs(t - std::round(t)) * floor.grid;
        };
        const float line = std::min(to_line(u), to_line(v)) < 0.012f * floor.grid ? 0.93f : 1.f;
        const float shade = line * (0.68f + 0.27f * shadow_.light_at(p + 3 * cell_ * floor.normal));
        const Eigen::Vector3f away = p - camera_.target;
        const float distance = (away - away.dot(floor.normal) * floor.normal).norm() / camera_.extent;
        const float t = std::clamp((distance - 0.5f) / 0.6f, 0.f, 1.f);
        const float fade = t * t * (3 - 2 * t);
        return (1 - fade) * shade * Eigen::Vector3f(0.97f, 0.98f, 1) + fade * Eigen::Vector3f::Ones();
    }

    const std::vector<PictureFloor>& floors_;
    const Camera& camera_;
    Eigen::Vector3f right_, up_, to_light_;
    Eigen::Vector4f ball_;
    DepthMap shadow_;
    int width_, height_;
    float cell_;  // metres per sample
    std::vector<Seen> samples_;
};

}  // namespace

Eigen::Vector3f Camera::seen(const Eigen::Vector3f& p) const {
    const Eigen::Vector3f right = forward.cross(up).normalized(), d = p - target;
    return {d.dot(right), d.dot(right.cross(forward)), d.dot(forward)};
}

Image draw(const std::vector<PictureSurface>& surfaces, const std::vector<PictureFloor>& floors,
           const Camera& camera, int width, int height) {
    return Drawing(surfaces, floors, camera, width, height).picture();
}

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
