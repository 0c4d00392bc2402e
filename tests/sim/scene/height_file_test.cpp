// Heights from images and tables.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <png.h>

#include <cstdint>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "meshing/formats/read_heights.hpp"
#include "sim/scene/build_world.hpp"
#include "sim/scene/scene.hpp"
#include "tests/sim/scene/scene_text.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/file_damage.hpp"

namespace nbd {
namespace {

using test::complaint;
using test::error_of;
using test::with;

/// 4 x 3 pixels from the top row on, of which the last has the smallest y.
const std::vector<int> pixels8{0, 51, 102, 255, 10, 20, 30, 40, 1, 2, 3, 4};
const std::vector<int> pixels16{0, 13107, 26214, 65535, 300, 301, 302, 303, 65534, 2, 3, 256};

std::string bytes_of(const std::vector<int>& pixels, bool is_wide) {
    std::string bytes;
    for (const int pixel : pixels) {
        if (is_wide) bytes += static_cast<char>(pixel >> 8);
        bytes += static_cast<char>(pixel & 255);
    }
    return bytes;
}

class HeightFiles : public test::FileTest {
 protected:
    std::filesystem::path write(const std::string& name, const std::string& content) const {
        std::ofstream(folder / name, std::ios::binary) << content;
        return folder / name;
    }

    /// A PNG file of 4 x 3 pixels.
    std::filesystem::path write_png(const std::string& name, const std::vector<int>& pixels, int bits,
                                    int colours = PNG_COLOR_TYPE_GRAY,
                                    int interlace = PNG_INTERLACE_NONE) const {
        std::FILE* file = std::fopen((folder / name).c_str(), "wb");
        png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
        png_infop info = png_create_info_struct(png);
        png_init_io(png, file);
        png_set_IHDR(png, info, 4, 3, bits, colours, interlace, PNG_COMPRESSION_TYPE_DEFAULT,
                     PNG_FILTER_TYPE_DEFAULT);
        png_set_gAMA(png, info, 0.45455);  // told, but not applied
        std::string bytes = bytes_of(pixels, bits == 16);
        std::vector<png_bytep> rows;
        for (std::size_t y = 0; y < 3; ++y)
            rows.push_back(reinterpret_cast<png_bytep>(bytes.data()) + y * bytes.size() / 3);
        png_set_rows(png, info, rows.data());
        png_write_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
        png_destroy_write_struct(&png, &info);
        std::fclose(file);
        return folder / name;
    }

    static void expect_shares(const std::filesystem::path& file, const std::vector<int>& pixels,
                              int largest) {
        const Eigen::MatrixXd shares = read_grey_image(file);
        ASSERT_EQ(shares.rows(), 3) << file;
        ASSERT_EQ(shares.cols(), 4) << file;
        for (int y = 0; y < 3; ++y)
            for (int x = 0; x < 4; ++x)
                EXPECT_EQ(shares(2 - y, x), static_cast<double>(pixels[4 * y + x]) / largest)
                    << file << y << x;
    }
};

TEST_F(HeightFiles, OfImagesAreTheStoredNumbers) {
    expect_shares(write_png("8.png", pixels8, 8), pixels8, 255);
    expect_shares(write_png("16.png", pixels16, 16), pixels16, 65535);
    expect_shares(write_png("laced.PNG", pixels16, 16, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_ADAM7), pixels16,
                  65535);
    expect_shares(write("8.pgm", "P5\n# a comment\n4 3\n255\n" + bytes_of(pixels8, false)), pixels8, 255);
    expect_shares(write("16.pgm", "P5 4 3 65535\n" + bytes_of(pixels16, true)), pixels16, 65535);
    expect_shares(write("text.pgm", fmt::format("P2\n4 3\n# wide\n65535\n{}\n", fmt::join(pixels16, " "))),
                  pixels16, 65535);
    expect_shares(write("less.pgm", fmt::format("P2 4 3 510 {}", fmt::join(pixels8, "\n"))), pixels8, 510);
}

TEST_F(HeightFiles, OfAnImageAreHeightsBetweenBlackAndWhite) {
    write_png("hills.png", pixels16, 16);
    for (const auto& [place, step] :
         {std::pair(std::string(R"("size": [6, 1])"), Eigen::Vector2d(2, 0.5)),
          std::pair(std::string(R"("spacing": 0.25)"), Eigen::Vector2d(0.25, 0.25))}) {
        const SceneSpec spec =
            parse_scene(with("", R"("obstacles": [{"heights": {)" + place +
                                     R"(, "file": "hills.png", "lowest": -1, "highest": 3}}])"),
                        folder);
        ASSERT_TRUE(spec.obstacles[0].heights);
        const Obstacle obstacle = make_obstacle(spec.obstacles[0]);
        const TriMesh& mesh = std::get<std::shared_ptr<const StaticSurface>>(obstacle.shape)->mesh();
        ASSERT_EQ(mesh.X.rows(), 12);
        ASSERT_EQ(mesh.F.rows(), 12);
        for (int y = 0; y < 3; ++y)
            for (int x = 0; x < 4; ++x) {
                const double z = -1 + 4 * (pixels16[4 * (2 - y) + x] / 65535.0);
                EXPECT_LT((mesh.X.row(4 * y + x) - Eigen::RowVector3d(x * step.x(), y * step.y(), z)).norm(),
                          1e-14);
            }
    }
}

TEST_F(HeightFiles, OfATableAreThoseOfTheSameRowsInTheScene) {
    const std::string rows = "[[0, 1, 0.5], [-2, 2e-1, 3]]";
    const auto mesh_of = [&](const std::string& heights) {
        const SceneSpec spec =
            parse_scene(with("", R"("obstacles": [{"heights": {)" + heights + "}}]"), folder);
        const Obstacle obstacle = make_obstacle(spec.obstacles[0]);
        return std::get<std::shared_ptr<const StaticSurface>>(obstacle.shape)->mesh();
    };
    for (const char* separator : {", ", ";", "\t", "  "})
        for (const std::string place : {R"("spacing": 0.5)", R"("size": [4, 1])"}) {
            write(
                "hills.csv",
                fmt::format("# metres; x, y\n0{0}1{0}0.5\n\n-2{0}2e-1{0}+3  # the last row\r\n", separator));
            const TriMesh of_file = mesh_of(place + R"(, "file": "hills.csv")"),
                          of_scene = mesh_of(place + R"(, "table": )" + rows);
            EXPECT_EQ(of_file.X, of_scene.X);
            EXPECT_EQ(of_file.F, of_scene.F);
        }
    EXPECT_EQ(mesh_of(R"("size": [4, 1], "table": )" + rows).X.row(5), Eigen::RowVector3d(4, 1, 3));
}

TEST_F(HeightFiles, ThatCannotBeReadAreRefusedInOneLine) {
    const auto refusal = [&](const std::filesystem::path& file) {
        const std::string line = error_of<std::runtime_error>(
            [&] { is_grey_image(file) ? read_grey_image(file) : read_number_table(file); });
        EXPECT_EQ(line.find('\n'), std::string::npos) << line;
        EXPECT_EQ(line.find(file.string()), 0u) << line;
        return line.substr(file.string().size());
    };
    EXPECT_EQ(refusal(folder / "none.png"), ": no such file");
    EXPECT_EQ(refusal(write("text.png", "hello, this is no image")),
              ": is no PNG image that can be read: Not a PNG file");
    const std::vector<int> rgb(36, 9);
    EXPECT_EQ(refusal(write_png("colours.png", rgb, 8, PNG_COLOR_TYPE_RGB)),
              ": is an image with colours or transparency of 8 bits; allowed: grey of 8 or 16 bits, without "
              "transparency");
    EXPECT_EQ(refusal(write_png("four.png", {1, 2, 3, 4, 5, 6}, 4))
                  .find(": is an image in grey of 4 bits; allowed:"),
              0u);
    const std::string whole = test::read_bytes(write_png("whole.png", pixels16, 16));
    for (std::size_t size = 0; size < whole.size(); ++size) {
        const std::string line = refusal(write("cut.png", whole.substr(0, size)));
        EXPECT_EQ(line.find(": is no PNG image that can be read: "), 0u) << size;
    }
    EXPECT_EQ(refusal(write("a.pgm", "P6 4 3 255 ")), ": is no PGM image: it does not begin with P2 or P5");
    EXPECT_EQ(refusal(write("b.pgm", "P5 1 3 255 abc")),
              ": is an image of 1 x 3 pixels; allowed: 2 to 2048 a side");
    EXPECT_EQ(refusal(write("c.pgm", "P5 2 2 65536 ")),
              ": has 65536 as its largest number; allowed: 1 to 65535");
    EXPECT_EQ(refusal(write("d.pgm", "P5 2 2 255 abc")),
              ": is cut off: it has 3 bytes of pixels; allowed: 4");
    EXPECT_EQ(refusal(write("e.pgm", "P2 2 2 7 0 1 2 8")), ", line 1: a pixel is 8; allowed: 0 to 7");
    EXPECT_EQ(refusal(write("f.pgm", "P2 2 2 7 0 1 2")), ", line 1: the file ends early");
    EXPECT_EQ(refusal(write("g.pgm", "P5 2048 2049 255 ")),
              ": is an image of 2048 x 2049 pixels; allowed: 2 to 2048 a side");
    EXPECT_EQ(refusal(write("a.csv", "1, 2\n3, x\n")), ", line 2: \"x\" is no finite number");
    EXPECT_EQ(refusal(write("b.csv", "1, 2\n3\n")), ", line 2: has 1 numbers, but the row before has 2");
    EXPECT_EQ(refusal(write("c.csv", "1 2\n")), ": has 1 rows of 2 numbers; allowed: at least 2 of 2");
    EXPECT_EQ(refusal(write("d.csv", "1 inf\n2 3")), ", line 1: \"inf\" is no finite number");
    EXPECT_EQ(refusal(write("f.csv", "0,5;1\n2;3")), ", line 1: \"0,5\" is no finite number");
    EXPECT_EQ(refusal(write("g.csv", "1,,2\n3,4,5")), ", line 1: \"\" is no finite number");
    EXPECT_EQ(refusal(write("e.csv", "")), ": has 0 rows of 0 numbers; allowed: at least 2 of 2");
}

TEST_F(HeightFiles, AreRefusedInScenesWhereKeysAreWrong) {
    const auto wrong = [](const std::string& heights) {
        return complaint(with("", R"("obstacles": [{"heights": {)" + heights + "}}]"));
    };
    const std::string at = "obstacles[0].heights";
    EXPECT_EQ(wrong(R"("file": "a.png", "highest": 1)"),
              at + R"(: needs exactly one of "spacing" and "size"; the nearest key there is "file")");
    EXPECT_EQ(wrong(R"("spacing": 1, "size": [1, 1], "file": "a.png", "highest": 1)"),
              at + R"(: needs exactly one of "spacing" and "size")");
    EXPECT_EQ(wrong(R"("spacing": 1)"), at + R"(: needs exactly one of "table" and "file")");
    EXPECT_EQ(wrong(R"("size": [1], "file": "a.png", "highest": 1)"),
              at + ".size: must be two positive lengths");
    EXPECT_EQ(wrong(R"("size": [1, 0], "file": "a.png", "highest": 1)"),
              at + ".size: must be two positive lengths");
    EXPECT_EQ(wrong(R"("spacing": 1, "file": "a.jpg")"),
              at + R"(.file: is "a.jpg", but must end in .png, .pgm or .csv)");
    EXPECT_EQ(wrong(R"("spacing": 1, "file": "a.png")"), at + ".highest: is missing");
    EXPECT_EQ(wrong(R"("spacing": 1, "file": "a.png", "lowest": 2, "highest": 2)"),
              at + R"(.highest: must be above "lowest")");
    EXPECT_EQ(wrong(R"("spacing": 1, "file": "a.csv", "highest": 2)"),
              at + ".highest: is for images, whose black and white it tells; a table has heights in metres");
    write("bad.csv", "1\n");
    const SceneSpec spec =
        parse_scene(with("", R"("obstacles": [{"heights": {"spacing": 1, "file": "bad.csv"}}])"), folder);
    EXPECT_EQ(error_of<std::invalid_argument>([&] { make_obstacle(spec.obstacles[0]); }),
              "heights.file: " + (folder / "bad.csv").string() +
                  ": has 1 rows of 1 numbers; allowed: at least 2 of 2");
}

}  // namespace
}  // namespace nbd
