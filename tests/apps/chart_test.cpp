#include "apps/drawing/chart.hpp"

#include <gtest/gtest.h>
#include <png.h>

#include <stdexcept>

#include "apps/figures/verdict.hpp"

namespace nbd {
namespace {

struct Pixels {
    int width = 0, height = 0;
    std::vector<unsigned char> rgb;

    explicit Pixels(const std::string& bytes) {
        png_image image{};
        image.version = PNG_IMAGE_VERSION;
        if (!png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()))
            throw std::runtime_error(image.message);
        image.format = PNG_FORMAT_RGB;
        width = static_cast<int>(image.width);
        height = static_cast<int>(image.height);
        rgb.resize(PNG_IMAGE_SIZE(image));
        png_image_finish_read(&image, nullptr, rgb.data(), 0, nullptr);
    }

    /// Rows, counted from the top, where column x has a pixel of about this colour.
    std::vector<int> rows_of(int x, Colour colour) const {
        std::vector<int> rows;
        for (int y = 0; y < height; ++y) {
            const unsigned char* p = rgb.data() + 3 * (y * width + x);
            if (std::abs(p[0] - 255 * colour.r) + std::abs(p[1] - 255 * colour.g) +
                    std::abs(p[2] - 255 * colour.b) <
                30)
                rows.push_back(y);
        }
        return rows;
    }
};

constexpr Colour red{1, 0, 0};

TEST(Chart, SpacesPowersOfTenEqually) {
    std::vector<double> heights;
    for (const double y : {0.1, 1.0, 10.0}) {
        // The end points fix the axis to 0.1 .. 10; the test measures the middle.
        const Chart chart{.title = "t",
                          .x_label = "x",
                          .y_label = "y",
                          .x_ticks = {0, 2},
                          .panels = {{"p",
                                      {{"a", {0, 0, 1}, Dash::solid, {{0, 0.1}, {0, 10}}},
                                       {"b", red, Dash::solid, {{0.9, y}, {1.1, y}}}}}}};
        const Page page = to_page(chart);
        const Pixels pixels(to_png(page, 2));
        EXPECT_EQ(pixels.width, static_cast<int>(std::ceil(2 * page.width)));
        const auto rows = pixels.rows_of(2 * (62 + 150), red);
        ASSERT_FALSE(rows.empty());
        heights.push_back(rows.front() + (rows.back() - rows.front()) / 2.0);
    }
    EXPECT_GT(heights[0], heights[1] + 50);
    EXPECT_NEAR(heights[0] - heights[1], heights[1] - heights[2], 2);
}

TEST(Chart, DrawsZeroBelowTheLowestPowerOfTen) {
    const Chart chart{.title = "t",
                      .x_label = "x",
                      .y_label = "y",
                      .x_ticks = {0, 2},
                      .panels = {{"p",
                                  {{"a", {0, 0, 1}, Dash::solid, {{0.9, 0.01}, {1.1, 0.01}}},
                                   {"b", red, Dash::solid, {{0.9, 0}, {1.1, 0}}}}}}};
    const Pixels pixels(to_png(to_page(chart), 2));
    const auto zero = pixels.rows_of(2 * (62 + 150), red), least = pixels.rows_of(2 * (62 + 150), {0, 0, 1});
    ASSERT_FALSE(zero.empty());
    ASSERT_FALSE(least.empty());
    EXPECT_GT(zero.front(), least.back() + 20);
}

TEST(Chart, HasRoomForItsTitleAndLegend) {
    const auto with_labels = [](const std::string& label, int count) {
        Panel panel{"p", {}};
        for (int i = 0; i < count; ++i)
            panel.series.push_back({label + std::to_string(i), red, Dash::solid, {{0, 1}, {1, 2}}});
        return Chart{.title = "t", .x_label = "x", .y_label = "y", .x_ticks = {0, 1}, .panels = {panel}};
    };
    const Page narrow = to_page(with_labels("a", 1)), page = to_page(with_labels(std::string(60, 'm'), 40));
    EXPECT_GT(page.width - narrow.width, 300);
    EXPECT_GT(page.height, narrow.height + 300);
    const Pixels pixels(to_png(page, 1));
    const auto white = [&](int x, int y) { return pixels.rgb[3 * (y * pixels.width + x)] == 255; };
    for (int y = 0; y < pixels.height; ++y) ASSERT_TRUE(white(pixels.width - 3, y)) << "row " << y;
    for (int x = 0; x < pixels.width; ++x) ASSERT_TRUE(white(x, pixels.height - 3)) << "column " << x;
    Chart titled = with_labels("a", 1);
    titled.title = std::string(120, 'm');
    EXPECT_GT(to_page(titled).width, narrow.width + 300);
}

TEST(Chart, MakesRoomForLongTickLabels) {
    const auto page = [](double least) {
        return to_page({.title = "t",
                        .x_label = "x",
                        .y_label = "y",
                        .x_ticks = {0, 1},
                        .panels = {{"p", {{"a", red, Dash::solid, {{0, least}, {1, 1}}}}}}});
    };
    EXPECT_EQ(page(0.1).width, page(0.01).width);
    EXPECT_GT(page(1e-8).width, page(0.01).width + 20);
}

TEST(Chart, WritesSvg) {
    const Chart chart{.title = "t",
                      .x_label = "x",
                      .y_label = "y",
                      .x_ticks = {0, 1},
                      .panels = {{"p", {{"a", red, Dash::dashed, {{0, 1}, {1, 2}}}}}}};
    const std::string svg = to_svg(to_page(chart));
    EXPECT_NE(svg.find("<svg"), std::string::npos);
    EXPECT_NE(svg.find("stroke-dasharray"), std::string::npos);
    EXPECT_NE(svg.find("</svg>"), std::string::npos);
}

std::vector<EvaluationRow> rows(const std::vector<std::pair<double, double>>& missing_by_margin) {
    std::vector<EvaluationRow> result;
    for (const auto& [margin, missing] : missing_by_margin)
        for (int depth = 0; depth < 2; ++depth)
            result.push_back({.frames = "held-out trajectories",
                              .bound = BoundKind::nbd,
                              .depth = depth,
                              .margin = margin,
                              .radius_error = 0.01 + margin,
                              .nodes_missing = depth == 1 ? missing : missing / 2,
                              .nodes = 1000});
    return result;
}

TEST(Verdict, NamesTheMarginThatMissesAtMostOneNodeInAThousand) {
    const auto said = verdicts(rows({{0, 0.5}, {0.05, 0.002}, {0.1, 0.001}, {0.2, 0}}));
    ASSERT_EQ(said.size(), 1u);
    EXPECT_EQ(
        said[0],
        "On these poses (held-out trajectories) nbd bounds without a margin leave a part of 50 % of the "
        "nodes outside at the worst depth (1); with 10 % added to every radius they miss at most one node "
        "in a thousand on poses like these, with a mean radius error of 11.0 %.");
}

TEST(Verdict, ReportsThatNoMarginSuffices) {
    const auto said = verdicts(rows({{0, 0.5}, {0.25, 0.012}}));
    EXPECT_NE(said[0].find("and of one node in 83 even with 25 % added to every radius. Use exact bounds"),
              std::string::npos)
        << said[0];
}

TEST(Verdict, ReportsThatNothingWasMissed) {
    EXPECT_NE(verdicts(rows({{0, 0}, {0.25, 0}}))[0].find("contained every vertex in all 2000 spheres"),
              std::string::npos);
    EXPECT_NE(verdicts(rows({{0, 0.0004}}))[0].find(
                  "one node in 2500 outside at the worst depth (1): they miss at most"),
              std::string::npos);
}

TEST(Verdict, OfCalibratedBoundsNamesTheWorstDepth) {
    const std::vector<CoverageRow> coverage{{.bound = BoundKind::learned_spheres,
                                             .depth = 0,
                                             .trajectories = 20,
                                             .miss_rate = 1e-3,
                                             .confidence = 0.9,
                                             .keeping = 20,
                                             .nodes_missing = 0,
                                             .inflation = 0.03,
                                             .out_of_range = 0.01},
                                            {.bound = BoundKind::learned_spheres,
                                             .depth = 1,
                                             .trajectories = 20,
                                             .miss_rate = 1e-3,
                                             .confidence = 0.9,
                                             .keeping = 17,
                                             .nodes_missing = 0.0012,
                                             .inflation = 0.01,
                                             .out_of_range = 0.03}};
    const auto said = verdicts(coverage);
    ASSERT_EQ(said.size(), 1u);
    EXPECT_EQ(
        said[0],
        "With calibrated margins, learned_spheres bounds missed 0.12 % of the nodes at the worst depth (1). "
        "The stated miss rate of 0.1 % is to hold in 90 % of the trajectories and held in 17 of 20. Radii "
        "are 2.0 % larger than the exact ones on average, and 2.0 % of the nodes were out of range and "
        "bounded exactly.");
    EXPECT_TRUE(verdicts(std::vector<CoverageRow>{}).empty());
}

}  // namespace
}  // namespace nbd
