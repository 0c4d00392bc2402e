#include "apps/simulate/film.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace nbd {
namespace {

const Eigen::Vector3f obstacle_colour{0.72f, 0.72f, 0.74f};

PictureSurface as_surface(const TriMesh& mesh, const Placing& placing, const Eigen::Vector3f& colour) {
    Nodes x(mesh.X.rows(), 3);
    for (Eigen::Index i = 0; i < x.rows(); ++i) x.row(i) = placing(mesh.X.row(i).transpose()).transpose();
    return {x.cast<float>(), mesh.F, colour};
}

/// Sphere of rows of quads, split into triangles.
TriMesh ball_mesh(const BallShape& ball) {
    constexpr int rows = 32, columns = 2 * rows;
    TriMesh mesh{Nodes((rows + 1) * columns, 3), Faces(2 * rows * columns, 3)};
    for (int i = 0; i <= rows; ++i)
        for (int j = 0; j < columns; ++j) {
            const double u = std::numbers::pi * i / rows, v = 2 * std::numbers::pi * j / columns;
            const Eigen::Vector3d direction(std::sin(u) * std::cos(v), std::sin(u) * std::sin(v),
                                            std::cos(u));
            mesh.X.row(i * columns + j) = ball.centre + ball.radius * direction;
            if (i == rows) continue;
            const int a = i * columns + j, b = a + columns, next = (j + 1) % columns - j;
            mesh.F.row(2 * a) << a, b, b + next;
            mesh.F.row(2 * a + 1) << a, b + next, a + next;
        }
    return mesh;
}

/// Rounds a length to 1, 2 or 5 times a power of ten.
float round_length(double length) {
    const double power = std::pow(10, std::floor(std::log10(length)));
    const double factor = length / power;
    return power * (factor < 1.5 ? 1 : factor < 3.5 ? 2 : factor < 7.5 ? 5 : 10);
}

/// Camera that looks from the side and slightly above; up is opposite to gravity.
Camera camera_for(const Eigen::Vector3d& gravity) {
    Camera camera;
    if (gravity.norm() > 0) camera.up = -gravity.normalized().cast<float>();
    const Eigen::Vector3f side =
        std::abs(camera.up.z()) > 0.5f ? Eigen::Vector3f(0.5f, 0.87f, 0) : Eigen::Vector3f(0.5f, 0, -0.87f);
    camera.forward = (side - side.dot(camera.up) * camera.up).normalized() - 0.42f * camera.up;
    camera.forward.normalize();
    return camera;
}

}  // namespace

Film::Film(const SceneSpec& spec, std::span<const Obstacle> obstacles, int stills)
    : frames_(spec.time.frames + 1),
      stills_(std::min(frames_, stills)),
      gravity_(spec.gravity),
      obstacles_(obstacles.begin(), obstacles.end()) {}

bool Film::wants(int frame) const {
    // The first still at or after the frame; stills are (frames - 1) / (stills - 1) frames apart.
    const long still = (static_cast<long>(frame) * (stills_ - 1) + frames_ - 2) / (frames_ - 1);
    return frame == still * (frames_ - 1) / (stills_ - 1);
}

void Film::add_frame(double time, std::vector<TriMesh> surfaces) {
    kept_.push_back({time, std::move(surfaces)});
}

/// Extends the box of what the camera sees by an obstacle that moves, wherever it is in any still. Leaves it
/// out where the bodies would get less than a quarter of the picture.
void Film::extend(Eigen::AlignedBox3f& seen, const Obstacle& obstacle, const Camera& camera) const {
    if (obstacle.stands()) return;
    Nodes X;
    if (const auto* ball = std::get_if<BallShape>(&obstacle.shape)) X = ball_mesh(*ball).X;
    const bool is_mesh = std::holds_alternative<std::shared_ptr<const StaticSurface>>(obstacle.shape);
    Eigen::AlignedBox3f all = seen;
    for (const Still& still : kept_) {
        if (is_mesh) X = mesh_positions(obstacle, still.time);
        const Placing placing = obstacle.motion.at(still.time);
        for (Eigen::Index i = 0; i < X.rows(); ++i)
            all.extend(camera.seen(placing(X.row(i).transpose()).cast<float>()));
    }
    if (all.diagonal().norm() <= 4 * seen.diagonal().norm()) seen = all;
}

void Film::write(const std::filesystem::path& path) const {
    if (kept_.empty()) return;
    Camera camera = camera_for(gravity_);
    Eigen::AlignedBox3f seen;
    for (const Still& still : kept_)
        for (const TriMesh& mesh : still.surfaces)
            for (Eigen::Index i = 0; i < mesh.X.rows(); ++i)
                seen.extend(camera.seen(mesh.X.row(i).transpose().cast<float>()));
    for (const Obstacle& obstacle : obstacles_) extend(seen, obstacle, camera);
    const Eigen::Vector3f right = camera.forward.cross(camera.up).normalized();
    camera.target = seen.center().x() * right + seen.center().y() * right.cross(camera.forward) +
                    seen.center().z() * camera.forward;
    const Eigen::Vector3f size = 1.25f * seen.sizes();
    constexpr int height = 400;
    const float aspect = std::clamp(size.x() / size.y(), 0.6f, 1.5f);
    camera.extent = std::max(size.y(), size.x() / aspect);

    std::vector<Image> images;
    for (const Still& still : kept_) {
        std::vector<PictureSurface> surfaces;
        std::vector<PictureFloor> floors;
        for (std::size_t b = 0; b < still.surfaces.size(); ++b)
            surfaces.push_back(as_surface(still.surfaces[b], {}, body_colours[b % body_colours.size()]));
        for (const Obstacle& obstacle : obstacles_) {
            const Placing placing = obstacle.motion.at(still.time);
            if (const auto* plane = std::get_if<PlaneShape>(&obstacle.shape))
                floors.push_back({placing(plane->point).cast<float>(),
                                  (placing.turn * plane->normal).cast<float>(),
                                  round_length(camera.extent / 8)});
            else if (const auto* ball = std::get_if<BallShape>(&obstacle.shape))
                surfaces.push_back(as_surface(ball_mesh(*ball), placing, obstacle_colour));
            else
                surfaces.push_back(
                    as_surface({mesh_positions(obstacle, still.time),
                                std::get<std::shared_ptr<const StaticSurface>>(obstacle.shape)->mesh().F},
                               placing, obstacle_colour));
        }
        images.push_back(draw(surfaces, floors, camera, static_cast<int>(aspect * height), height));
    }
    write_png(path, contact_sheet(images, 3));
}

}  // namespace nbd
