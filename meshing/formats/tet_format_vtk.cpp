#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <string>
#include <utility>

#include "meshing/formats/tet_formats.hpp"

namespace nbd {
namespace {

constexpr int vtk_tetrahedron = 10;

/// Corner count of a point, line or surface cell type; 0 if any number is allowed.
int corners_of(int cell_type) {
    switch (cell_type) {
        case 1:
            return 1;
        case 3:
            return 2;
        case 5:
        case 21:
            return 3;
        case 8:
        case 9:
            return 4;
        case 22:
            return 6;
        case 23:
            return 8;
        default:
            return 0;
    }
}

bool is_volume(int cell_type) {
    // Points, lines, polygons, and the quadratic edge, triangle and quad; all other types are volumes or
    // unusual.
    return !((cell_type >= 1 && cell_type <= 9) || (cell_type >= 21 && cell_type <= 23));
}

std::string upper(std::string_view word) {
    std::string text(word);
    std::ranges::transform(text, text.begin(),
                           [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    return text;
}

class VtkReader {
 public:
    explicit VtkReader(FileCursor& in) : in_(in) {}

    TetFileContent read() {
        if (!in_.line().starts_with("# vtk DataFile Version")) in_.fail("not a legacy VTK file");
        in_.line();  // title
        const std::string encoding = upper(in_.word());
        if (encoding != "ASCII" && encoding != "BINARY") in_.fail("expected ASCII or BINARY");
        binary_ = encoding == "BINARY";
        in_.expect("DATASET");
        in_.expect("UNSTRUCTURED_GRID");
        bool points = false, cells = false;
        for (;;) {
            const std::string keyword = upper(in_.word());
            if (keyword == "POINTS" && !points) {
                read_points();
                points = true;
            } else if (keyword == "CELLS" && points && !cells) {
                read_cells();
                cells = true;
            } else if (keyword == "CELL_TYPES" && cells) {
                read_types();
                return std::move(content_);
            } else if (keyword == "METADATA") {
                in_.line();
                while (!in_.line().empty()) {
                }
            } else {
                in_.fail("expected POINTS, CELLS and CELL_TYPES, once each and in this order");
            }
        }
    }

 private:
    void begin_data() {
        in_.line();
        if (binary_) in_.read_binary(std::endian::native == std::endian::little);  // files are big-endian
    }

    void read_points() {
        const std::size_t n = in_.count("points", binary_ ? 12 : 6);
        const std::string type(in_.word());
        if (type != "float" && type != "double") in_.fail("points must be float or double");
        begin_data();
        content_.nodes.resize(n);
        for (auto& node : content_.nodes)
            for (double& coordinate : node)
                coordinate = type == "float" && binary_ ? double{in_.real32()} : in_.real64();
        in_.read_text();
    }

    std::int64_t integer(bool wide) { return wide ? in_.int64() : in_.int32(); }

    /// Reads one of the two arrays of version 5.1: name, type, values.
    std::vector<std::int64_t> read_array(std::string_view name, std::size_t n) {
        in_.expect(name);
        const std::string type(in_.word());
        if (type != "vtktypeint64" && type != "vtktypeint32")
            in_.fail(std::string(name) + " must be vtktypeint64 or vtktypeint32");
        begin_data();
        std::vector<std::int64_t> values(n);
        for (std::int64_t& value : values) value = integer(type == "vtktypeint64");
        in_.read_text();
        return values;
    }

    void read_cells() {
        const std::size_t n = in_.count("cells", 2), size = in_.count("numbers", 2);
        in_.line();
        if (in_.is_next("OFFSETS")) {
            offsets_ = read_array("OFFSETS", n);
            corners_ = read_array("CONNECTIVITY", size);
            if (offsets_.empty() || offsets_.front() != 0 || offsets_.back() != std::int64_t(size) ||
                !std::ranges::is_sorted(offsets_))
                in_.fail(fmt::format("OFFSETS must rise from 0 to {}", size));
            return;
        }
        if (binary_) in_.read_binary(std::endian::native == std::endian::little);
        offsets_ = {0};
        corners_.reserve(size);
        for (std::size_t c = 0; c < n; ++c) {
            const std::size_t corners = in_.check_count(in_.int32(), "corners of a cell", 1);
            for (std::size_t k = 0; k < corners; ++k) corners_.push_back(in_.int32());
            offsets_.push_back(static_cast<std::int64_t>(corners_.size()));
        }
        if (corners_.size() + n != size)
            in_.fail(fmt::format("announces {} numbers, but the cells hold {}", size, corners_.size() + n));
        in_.read_text();
    }

    void read_types() {
        const std::size_t n = in_.count("cell types", 1), cells = offsets_.size() - 1;
        if (n != cells) in_.fail(fmt::format("{} cell types for {} cells", n, cells));
        begin_data();
        for (std::size_t c = 0; c < n; ++c) {
            const int type = in_.int32();
            const auto corners = offsets_[c + 1] - offsets_[c];
            if (is_volume(type) && (type != vtk_tetrahedron || corners != 4))
                in_.fail(fmt::format(
                    "cell {} is a volume of type {} with {} corners; only 4-node tetrahedra are allowed", c,
                    type, corners));
            if (const int allowed = corners_of(type); allowed != 0 && corners != allowed)
                in_.fail(
                    fmt::format("cell {} of type {} has {} corners; allowed: {}", c, type, corners, allowed));
            if (type != vtk_tetrahedron) {
                ++content_.other_cells;
                continue;
            }
            std::array<int, 4> tet{};
            for (std::size_t k = 0; k < 4; ++k) {
                const std::int64_t node = corners_[static_cast<std::size_t>(offsets_[c]) + k];
                if (node < 0 || node >= std::int64_t(content_.nodes.size()))
                    in_.fail(fmt::format("cell {} refers to point {}; allowed: 0 to {}", c, node,
                                         std::int64_t(content_.nodes.size()) - 1));
                tet[k] = static_cast<int>(node);
            }
            content_.tets.push_back(tet);
        }
    }

    FileCursor& in_;
    bool binary_ = false;
    TetFileContent content_;
    std::vector<std::int64_t> offsets_, corners_;  // cell c has corners offsets_[c] .. offsets_[c + 1] - 1
};

}  // namespace

TetFileContent read_vtk(FileCursor& in) { return VtkReader(in).read(); }

}  // namespace nbd
