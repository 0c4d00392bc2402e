#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <limits>
#include <string>
#include <utility>

#include "meshing/formats/tet_formats.hpp"
#include "meshing/formats/words.hpp"

namespace nbd {
namespace {

constexpr std::int64_t vtk_tetrahedron = 10;

/// Corner count of a point, line or surface cell type; 0 if any number is allowed.
std::int64_t corners_of(std::int64_t cell_type) {
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

bool is_volume(std::int64_t cell_type) {
    // Points, lines, polygons, and the quadratic edge, triangle and quad; all other types are volumes or
    // unusual.
    return !((cell_type >= 1 && cell_type <= 9) || (cell_type >= 21 && cell_type <= 23));
}

}  // namespace

void add_cells(const VtkCells& cells, std::int64_t first_node, const FileCursor& in,
               TetFileContent& content) {
    const std::int64_t nodes = std::ssize(content.nodes) - first_node;
    for (std::size_t c = 0; c < cells.types.size(); ++c) {
        const std::int64_t type = cells.types[c], corners = cells.offsets[c + 1] - cells.offsets[c];
        if (is_volume(type) && (type != vtk_tetrahedron || corners != 4))
            in.fail(fmt::format(
                "cell {} is a volume of type {} with {} corners; only 4-node tetrahedra are allowed", c, type,
                corners));
        if (const std::int64_t allowed = corners_of(type); allowed != 0 && corners != allowed)
            in.fail(fmt::format("cell {} of type {} has {} corners; allowed: {}", c, type, corners, allowed));
        if (type != vtk_tetrahedron) {
            ++content.other_cells;
            continue;
        }
        std::array<int, 4> tet{};
        for (std::size_t k = 0; k < 4; ++k) {
            const std::int64_t node = cells.corners[cells.offsets[c] + k];
            if (node < 0 || node >= nodes)
                in.fail(fmt::format("cell {} refers to point {}; allowed: 0 to {}", c, node, nodes - 1));
            tet[k] = first_node + node;
        }
        content.tets.push_back(tet);
    }
}

namespace {

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
            } else if (keyword == "FIELD") {
                skip_fields();
            } else {
                in_.fail(
                    "expected POINTS, CELLS and CELL_TYPES, once each and in this order, "
                    "or FIELD before them");
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

    /// Bytes of a number in a binary file; 0 for an unknown type.
    static std::size_t bytes_of(std::string_view type) {
        static constexpr std::pair<std::string_view, std::size_t> types[] = {
            {"char", 1},      {"unsigned_char", 1}, {"short", 2},        {"unsigned_short", 2},
            {"int", 4},       {"unsigned_int", 4},  {"long", 8},         {"unsigned_long", 8},
            {"float", 4},     {"double", 8},        {"vtktypeint64", 8}, {"vtktypeuint64", 8},
            {"vtkidtype", 4}, {"vtktypeint32", 4},  {"vtktypeuint32", 4}};
        for (const auto& [name, bytes] : types)
            if (name == type) return bytes;
        return 0;
    }

    /// Data of the whole file, such as its time, which may come before the points.
    void skip_fields() {
        in_.word();  // a name
        const std::size_t arrays = in_.count("arrays", 8);
        for (std::size_t array = 0; array < arrays; ++array) {
            if (in_.word() == "METADATA") {  // of the array before
                in_.line();
                while (!in_.line().empty()) {
                }
                in_.word();
            }
            const std::size_t components = in_.count("components", 1), rows = in_.count("rows", 1);
            const std::string type(in_.word());
            const std::size_t bytes = bytes_of(type);
            if (bytes == 0)
                in_.fail(
                    fmt::format("a field of type {} before the points; allowed: numbers", printable(type)));
            if (components > 0 && rows > std::numeric_limits<int>::max() / components)
                in_.fail(fmt::format("a field of {} times {} numbers", rows, components));
            const std::size_t numbers = rows * components;
            if (binary_) {
                in_.line();
                in_.skip(bytes * numbers);
            } else {
                for (std::size_t i = 0; i < numbers; ++i) in_.real64();
            }
        }
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
            cells_.offsets = read_array("OFFSETS", n);
            cells_.corners = read_array("CONNECTIVITY", size);
            if (cells_.offsets.empty() || cells_.offsets.front() != 0 ||
                cells_.offsets.back() != std::int64_t(size) || !std::ranges::is_sorted(cells_.offsets))
                in_.fail(fmt::format("OFFSETS must rise from 0 to {}", size));
            return;
        }
        if (binary_) in_.read_binary(std::endian::native == std::endian::little);
        cells_.offsets = {0};
        cells_.corners.reserve(size);
        for (std::size_t c = 0; c < n; ++c) {
            const std::size_t corners = in_.check_count(in_.int32(), "corners of a cell", 1);
            for (std::size_t k = 0; k < corners; ++k) cells_.corners.push_back(in_.int32());
            cells_.offsets.push_back(cells_.corners.size());
        }
        if (cells_.corners.size() + n != size)
            in_.fail(
                fmt::format("announces {} numbers, but the cells hold {}", size, cells_.corners.size() + n));
        in_.read_text();
    }

    void read_types() {
        const std::size_t n = in_.count("cell types", 1), cells = cells_.offsets.size() - 1;
        if (n != cells) in_.fail(fmt::format("{} cell types for {} cells", n, cells));
        begin_data();
        cells_.types.resize(n);
        for (std::int64_t& type : cells_.types) type = in_.int32();
        add_cells(cells_, 0, in_, content_);
    }

    FileCursor& in_;
    bool binary_ = false;
    TetFileContent content_;
    VtkCells cells_;
};

}  // namespace

TetFileContent read_vtk(FileCursor& in) { return VtkReader(in).read(); }

}  // namespace nbd
