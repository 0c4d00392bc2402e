#include <gtest/gtest.h>
#include <png.h>

#include <array>
#include <cmath>
#include <stdexcept>

#include "tests/apps/small_files.hpp"

namespace nbd::test {
namespace {

struct Pixels {
    int width = 0, height = 0;
    std::vector<unsigned char> rgb;

    explicit Pixels(const std::filesystem::path& path) {
        png_image image{};
        image.version = PNG_IMAGE_VERSION;
        if (!png_image_begin_read_from_file(&image, path.c_str())) throw std::runtime_error(image.message);
        image.format = PNG_FORMAT_RGB;
        width = image.width;
        height = image.height;
        rgb.resize(PNG_IMAGE_SIZE(image));
        png_image_finish_read(&image, nullptr, rgb.data(), 0, nullptr);
    }

    /// Share of the pixels accepted by `is` in one tile of the 3 x 2 tiles.
    template <class Is>
    double share(int tile, const Is& is) const {
        const int w = width / 3, h = height / 2;
        int count = 0;
        for (int y = tile / 3 * h; y < (tile / 3 + 1) * h; ++y)
            for (int x = tile % 3 * w; x < (tile % 3 + 1) * w; ++x) {
                const unsigned char* p =
                    &rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                              static_cast<std::size_t>(x))];
                count += is(p[0], p[1], p[2]);
            }
        return static_cast<double>(count) / (w * h);
    }
};

using PictureTest = SmallFiles;

TEST_F(PictureTest, ShowsBodiesInDifferentColoursWithFloorAndShadows) {
    write("scene.json", R"({
        "bodies": [{"body": "box.h5", "transform": {"translate": [0, 0, 0.1]}},
                   {"body": "box.h5", "transform": {"translate": [0, 0, 0.4]}}],
        "obstacles": [{"plane": {}}],
        "time": {"dt": 0.002, "frames": 11, "steps_per_frame": 1}})");
    make({"simulate", "scene.json", "-o", "run.h5", "--picture", "run.png", "-q"});
    const Pixels picture(folder() / "run.png");
    EXPECT_EQ(picture.height, 800);
    for (int tile = 0; tile < 6; ++tile) {
        SCOPED_TRACE(tile);
        const auto share = [&](auto is) { return picture.share(tile, is); };
        EXPECT_GT(share([](int r, int g, int b) { return g > r + 20 && g > b + 20; }), 0.03);  // first body
        EXPECT_GT(share([](int r, int g, int b) { return b > r + 20 && b > g + 20; }), 0.03);  // second body
        const auto grey = [](int r, int g, int b, int low, int high) {
            return std::abs(r - g) < 12 && std::abs(g - b) < 12 && g >= low && g <= high;
        };
        EXPECT_GT(share([&](int r, int g, int b) { return grey(r, g, b, 150, 190); }), 0.01);  // shadow
        EXPECT_GT(share([&](int r, int g, int b) { return grey(r, g, b, 225, 250); }), 0.05);  // floor
        EXPECT_GT(share([&](int r, int g, int b) { return grey(r, g, b, 255, 255); }), 0.10);  // background
    }
}

TEST_F(PictureTest, KeepsAnObstacleInViewThatMovesAway) {
    write("away.json", R"({
        "bodies": [{"body": "box.h5"}], "gravity": [0, 0, 0],
        "obstacles": [{"sphere": {"centre": [0.4, 0, 0], "radius": 0.08}, "velocity": [20, 0, 0]}],
        "time": {"dt": 0.002, "frames": 11, "steps_per_frame": 1}})");
    make({"simulate", "away.json", "-o", "away.h5", "--picture", "away.png", "-q"});
    const Pixels picture(folder() / "away.png");
    for (int tile = 0; tile < 6; ++tile)
        EXPECT_GT(picture.share(tile,
                                [](int r, int g, int b) {
                                    return std::abs(r - g) < 12 && std::abs(g - b) < 12 && g >= 60 &&
                                           g <= 230;
                                }),
                  0.002)
            << tile;
}

}  // namespace
}  // namespace nbd::test
