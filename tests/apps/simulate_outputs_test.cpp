#include <gtest/gtest.h>
#include <png.h>

#include <cmath>
#include <cstdlib>
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
                const unsigned char* p = &rgb[3 * (std::size_t(y) * width + x)];
                count += is(p[0], p[1], p[2]);
            }
        return double(count) / (w * h);
    }
};

using SimulateOutputs = SmallFiles;

TEST_F(SimulateOutputs, PicturesShowBodiesInDifferentColoursWithFloorAndShadows) {
    write("scene.json", R"({
        "bodies": [{"body": "box.h5", "transform": {"translate": [0, 0, 0.1]}},
                   {"body": "box.h5", "transform": {"translate": [0, 0, 0.4]}}],
        "obstacles": [{"plane": {}}],
        "time": {"dt": 0.002, "frames": 11, "steps_per_frame": 1}})");
    make("simulate scene.json -o run.h5 --picture run.png -q");
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

TEST_F(SimulateOutputs, PicturesKeepAnObstacleInViewThatMovesAway) {
    write("away.json", R"({
        "bodies": [{"body": "box.h5"}], "gravity": [0, 0, 0],
        "obstacles": [{"sphere": {"centre": [0.5, 0, 0], "radius": 0.08}, "velocity": [20, 0, 0]}],
        "time": {"dt": 0.002, "frames": 11, "steps_per_frame": 1}})");
    make("simulate away.json -o away.h5 --picture away.png -q");
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

/// VTK's readers, which ParaView uses, open the frames and find the data of the recording.
TEST_F(SimulateOutputs, FramesAndSurfacesForVtkAgreeWithTheRecording) {
    if (std::system("/usr/bin/python3 -c 'import h5py, vtkmodules.vtkIOXML' 2>/dev/null") != 0)
        GTEST_SKIP() << "/usr/bin/python3 has no vtkmodules (Debian: python3-vtk9) or no h5py";
    write("scene.json", R"({
        "bodies": [{"body": "box.h5", "name": "lower", "transform": {"translate": [0, 0, 0.06]}},
                   {"body": "box.h5", "name": "upper", "transform": {"translate": [0, 0.02, 0.18]},
                    "velocity": [0, 0, -2]}],
        "obstacles": [{"plane": {}}],
        "time": {"dt": 0.002, "frames": 20, "steps_per_frame": 1}})");
    make("simulate scene.json -o run.h5 --vtu frames --obj surfaces -q");
    EXPECT_EQ(listing(folder() / "frames").size(), 22u);
    EXPECT_EQ(listing(folder() / "surfaces").size(), 42u);
    const std::string read = "cd '" + folder().string() +
                             "' && /usr/bin/python3 " NBD_READ_WITH_VTK
                             " run.h5 box.h5 frames surfaces 21 0.002";
    EXPECT_EQ(std::system(read.c_str()), 0);
}

}  // namespace
}  // namespace nbd::test
