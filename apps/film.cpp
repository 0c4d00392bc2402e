#include "apps/film.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

namespace nbd {
namespace {

const std::array<Eigen::Vector3f, 4> colours{
    Eigen::Vector3f{0.45f, 0.72f, 0.45f}, Eigen::Vector3f{0.45f, 0.6f, 0.85f},
    Eigen::Vector3f{0.88f, 0.72f, 0.4f}, Eigen::Vector3f{0.7f, 0.55f, 0.8f}};

}  // namespace

Film::Film(int frames, int stills) : frames_(frames), stills_(std::min(frames, stills)) {}

bool Film::wants(int frame) const {
    if (stills_ <= 1) return frame == frames_ - 1;
    const auto still = static_cast<int>(kept_.size());
    return still < stills_ && frame == still * (frames_ - 1) / (stills_ - 1);
}

void Film::add_frame(int frame, const World& world) {
    if (!wants(frame)) return;
    std::vector<Vertices> still;
    faces_.clear();
    for (int b = 0; b < world.body_count(); ++b) {
        still.push_back(world.surface(b).x_float());
        faces_.push_back(world.surface(b).F());
    }
    kept_.push_back(std::move(still));
}

void Film::write(const std::filesystem::path& path, int columns) const {
    if (kept_.empty()) return;
    Eigen::AlignedBox3f box;
    for (const std::vector<Vertices>& still : kept_)
        for (const Vertices& x : still) {
            box.extend(Eigen::Vector3f(x.colwise().minCoeff()));
            box.extend(Eigen::Vector3f(x.colwise().maxCoeff()));
        }
    Camera camera;
    camera.target = box.center();
    camera.eye = camera.target + Eigen::Vector3f(1, -1.6f, 0.7f);
    camera.extent = 0.9f * box.diagonal().norm();
    std::vector<Image> images;
    for (const std::vector<Vertices>& still : kept_) {
        std::vector<PictureSurface> surfaces;
        for (std::size_t b = 0; b < still.size(); ++b)
            surfaces.push_back({still[b], faces_[b], colours[b % colours.size()]});
        images.push_back(draw(surfaces, camera, 400, 400));
    }
    write_png(path, contact_sheet(images, columns));
}

}  // namespace nbd
