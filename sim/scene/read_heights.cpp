// Obstacles as heights over a grid.
#include "meshing/formats/read_heights.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "collision/base/file_name.hpp"
#include "sim/obstacles/made_mesh.hpp"
#include "sim/scene/read_parts.hpp"

namespace nbd {
namespace {

Eigen::MatrixXd read_height_rows(JsonObject& from) {
    const Eigen::MatrixXd flat = Eigen::MatrixXd::Zero(2, 2);
    const std::vector<std::vector<double>> rows = from.table("table");
    if (rows.empty()) return flat;
    const std::size_t columns = rows.front().size();
    if (rows.size() < 2 || columns < 2) {
        from.problem("table", fmt::format("has {} rows of {} heights, but must have at least 2 of 2",
                                          rows.size(), columns));
        return flat;
    }
    Eigen::MatrixXd heights(rows.size(), columns);
    for (std::size_t i = 0; i < rows.size(); ++i) {
        if (rows[i].size() != columns) {
            from.problem("table",
                         fmt::format("row {} has {} heights, but row 0 has {}", i, rows[i].size(), columns));
            return flat;
        }
        for (std::size_t j = 0; j < columns; ++j) heights(i, j) = rows[i][j];
    }
    return heights;
}

/// Lengths along x and y.
Eigen::Vector2d read_size(JsonObject& from) {
    const nlohmann::json& list = *from.raw("size", "array");
    Eigen::Vector2d size(1, 1);
    bool is_right = list.is_array() && list.size() == 2;
    for (int k = 0; is_right && k < 2; ++k) {
        is_right = list[k].is_number() && list[k].get<double>() >= least_constant &&
                   list[k].get<double>() <= max_constant;
        if (is_right) size[k] = list[k].get<double>();
    }
    if (!is_right) from.problem("size", "must be two positive lengths");
    return size;
}

/// The distances of neighbours in a grid of heights.
Eigen::Vector2d spacing_of(const SceneHeights& spec, const Eigen::MatrixXd& heights) {
    if (spec.spacing) return Eigen::Vector2d::Constant(*spec.spacing);
    return spec.size.cwiseQuotient(Eigen::Vector2d(heights.cols() - 1, heights.rows() - 1));
}

}  // namespace

TriMesh SceneHeights::mesh() const {
    try {
        Eigen::MatrixXd heights;
        if (is_grey_image(file))
            heights = lowest + (highest - lowest) * read_grey_image(file).array();
        else
            heights = read_number_table(file);
        return height_mesh(heights, spacing_of(*this, heights));
    } catch (const std::runtime_error& error) {
        throw std::invalid_argument(fmt::format("{}: {}", key, error.what()));
    }
}

void read_heights(JsonObject& from, const std::filesystem::path& base, SceneObstacle& obstacle) {
    SceneHeights heights{.key = "heights.file", .file = {}};
    if (from.need_one({"spacing", "size"}) == "size")
        heights.size = read_size(from);
    else
        heights.spacing = from.optional_number("spacing", positive_number);
    const std::string kind = from.need_one({"table", "file"});
    if (kind == "file") heights.file = read_path(from, "file", base);
    const bool is_image = is_grey_image(heights.file);
    if (!heights.file.empty() && !is_image && !has_extension(heights.file, ".csv"))
        from.problem("file", fmt::format("is \"{}\", but must end in .png, .pgm or .csv",
                                         heights.file.filename().string()));
    heights.lowest = from.number("lowest", heights.lowest, finite_number);
    const std::optional<double> highest = from.optional_number("highest", finite_number);
    if (is_image && from.need("highest")) heights.highest = highest.value_or(heights.lowest + 1);
    for (const char* key : {"lowest", "highest"})
        if (!is_image && kind != "" && from.has(key))
            from.problem(key, "is for images, whose black and white it tells; a table has heights in metres");
    if (is_image && highest && !(*highest > heights.lowest))
        from.problem("highest", "must be above \"lowest\"");
    if (kind == "file") {
        obstacle.heights = std::move(heights);
        return;
    }
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(2, 2);
    if (kind == "table") rows = read_height_rows(from);
    obstacle.made = height_mesh(rows, spacing_of(heights, rows));
}

}  // namespace nbd
