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

/// The corners of a cell as nodes of the content.
template <std::size_t count>
std::array<int, count> nodes_of(const VtkCells& cells, std::size_t c, std::int64_t first_node,
                                const FileCursor& in, const TetFileContent& content) {
    const std::int64_t nodes = std::ssize(content.nodes) - first_node;
    std::array<int, count> corners{};
    for (std::size_t k = 0; k < count; ++k) {
        const std::int64_t node = cells.corners[cells.offsets[c] + k];
        if (node < 0 || node >= nodes)
            in.fail(fmt::format("cell {} refers to point {}; allowed: 0 to {}", c, node, nodes - 1));
        corners[k] = static_cast<int>(first_node + node);
    }
    return corners;
}

}  // namespace

void add_cells(const VtkCells& cells, std::int64_t first_node, const FileCursor& in,
               TetFileContent& content) {
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
        content.tets.push_back(nodes_of<4>(cells, c, first_node, in, content));
    }
}

bool names_groups(std::string_view array) {
    constexpr std::string_view names[]{
        "GROUP",         "GROUPS",    "REGION",        "REGIONS",     "REGIONID",    "REGION_ID",
        "MATERIAL",      "MATERIALS", "MATERIALID",    "MATERIALIDS", "MATERIAL_ID", "MATERIAL_IDS",
        "GMSH:PHYSICAL", "MEDIT:REF", "CELLENTITYIDS", "PHYSICALIDS", "PHYSICAL"};
    return std::ranges::find(names, capitals(array)) != std::end(names);
}

void add_cell_groups(const VtkCells& cells, std::span<const std::int64_t> groups, std::int64_t first_node,
                     std::size_t first_tet, const FileCursor& in, TetFileContent& content) {
    constexpr std::int64_t vtk_triangle = 5;
    content.group_of_tet.resize(content.tets.size(), 0);
    for (std::size_t c = 0; c < groups.size(); ++c) {
        const std::int64_t type = cells.types[c];
        if (type != vtk_tetrahedron && type != vtk_triangle) continue;
        constexpr std::int64_t most = std::numeric_limits<int>::max();
        if (groups[c] < -most || groups[c] > most)
            in.fail(fmt::format("cell {} is of group {}; allowed: {} to {}", c, groups[c], -most, most));
        const int group = static_cast<int>(groups[c]);
        if (type == vtk_tetrahedron) {
            content.group_of_tet[first_tet++] = group;
            continue;
        }
        if (group == 0) continue;
        content.triangles.push_back(nodes_of<3>(cells, c, first_node, in, content));
        content.group_of_triangle.push_back(group);
    }
}

namespace {

class VtkReader {
 public:
    explicit VtkReader(FileCursor& in) : in_(in) {}

    TetFileContent read() {
        if (!in_.line().starts_with("# vtk DataFile Version")) in_.fail("not a legacy VTK file");
        in_.line();  // title
        const std::string encoding = capitals(in_.word());
        if (encoding != "ASCII" && encoding != "BINARY") in_.fail("expected ASCII or BINARY");
        binary_ = encoding == "BINARY";
        in_.expect("DATASET");
        in_.expect("UNSTRUCTURED_GRID");
        bool points = false, cells = false;
        for (;;) {
            const std::string keyword = capitals(in_.word());
            if (keyword == "POINTS" && !points) {
                read_points();
                points = true;
            } else if (keyword == "CELLS" && points && !cells) {
                read_cells();
                cells = true;
            } else if (keyword == "CELL_TYPES" && cells) {
                read_types();
                read_attributes();
                return std::move(content_);
            } else if (keyword == "METADATA") {
                skip_metadata();
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
        begin_numbers();
    }
    void begin_numbers() {
        if (binary_) in_.read_binary(std::endian::native == std::endian::little);  // files are big-endian
    }

    /// Moves past metadata, which end with an empty line.
    void skip_metadata() {
        in_.line();
        while (in_.bytes_left() > 0 && !in_.line().empty()) {
        }
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
                skip_metadata();
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
        begin_numbers();
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

    /// Reads `numbers` numbers as whole ones, if they are those of the groups; else moves past them.
    void read_numbers(std::string_view name, std::string_view type, std::size_t numbers, std::size_t each) {
        const std::size_t bytes = bytes_of(type);
        const bool is_whole = type != "float" && type != "double";
        const bool is_group = is_of_cells_ && is_whole && each == 1 && !has_groups_ &&
                              numbers == cells_.types.size() && names_groups(name);
        if (!binary_) {
            std::vector<std::int64_t> groups;
            for (std::size_t i = 0; i < numbers; ++i)
                if (is_group)
                    groups.push_back(in_.int64());
                else
                    in_.word();
            if (is_group) take_groups(groups);
            return;
        }
        if (!is_group) return in_.skip(std::uint64_t{bytes} * numbers);
        begin_numbers();
        std::vector<std::int64_t> groups(
            in_.check_count(static_cast<std::int64_t>(numbers), "numbers", bytes));
        const bool is_signed = !type.starts_with("unsigned") && !type.starts_with("vtktypeuint");
        for (std::int64_t& group : groups)
            group = bytes == 1
                        ? is_signed ? std::int64_t{in_.number<std::int8_t>()} : in_.number<std::uint8_t>()
                    : bytes == 2
                        ? is_signed ? std::int64_t{in_.number<std::int16_t>()} : in_.number<std::uint16_t>()
                    : bytes == 4
                        ? is_signed ? std::int64_t{in_.int32()} : std::int64_t{in_.number<std::uint32_t>()}
                        : in_.int64();
        in_.read_text();
        take_groups(groups);
    }
    void take_groups(const std::vector<std::int64_t>& groups) {
        has_groups_ = true;
        add_cell_groups(cells_, groups, 0, 0, in_, content_);
    }

    std::size_t size(const char* things) {
        const std::int64_t n = in_.int64();
        if (n < 0 || n > std::numeric_limits<int>::max())
            in_.fail(
                fmt::format("claims {} {}; allowed: 0 to {}", n, things, std::numeric_limits<int>::max()));
        return n;
    }

    /// Data of cells and points, of which groups of cells are read. Ends at what it does not know.
    void read_attributes() {
        in_.read_text();
        std::size_t rows = 0;
        while (!in_.at_end()) {
            const std::string keyword = capitals(in_.word());
            if (keyword == "CELL_DATA" || keyword == "POINT_DATA") {
                rows = size("rows");
                is_of_cells_ = keyword == "CELL_DATA";
            } else if (keyword == "METADATA") {
                skip_metadata();
            } else if (keyword == "SCALARS") {
                const std::string name(in_.word()), type(in_.word());
                if (bytes_of(type) == 0) return;
                std::size_t each = 1;
                if (!in_.at_line_end()) each = size("components");
                in_.line();
                if (in_.is_next("LOOKUP_TABLE")) in_.line();
                read_numbers(name, type, rows * each, each);
            } else if (keyword == "VECTORS" || keyword == "NORMALS" || keyword == "TENSORS" ||
                       keyword == "GLOBAL_IDS" || keyword == "PEDIGREE_IDS") {
                const std::string name(in_.word()), type(in_.word());
                if (bytes_of(type) == 0) return;
                in_.line();
                const std::size_t each = keyword == "TENSORS" ? 9 : keyword.ends_with("_IDS") ? 1 : 3;
                read_numbers("", type, rows * each, each);
            } else if (keyword == "FIELD") {
                in_.word();  // a name
                const std::size_t arrays = size("arrays");
                for (std::size_t array = 0; array < arrays; ++array) {
                    std::string name(in_.word());
                    if (name == "METADATA") {  // of the array before
                        skip_metadata();
                        name = in_.word();
                    }
                    const std::size_t each = size("components"), tuples = size("rows");
                    const std::string type(in_.word());
                    if (bytes_of(type) == 0) return;
                    if (each > 0 && tuples > std::numeric_limits<int>::max() / each)
                        in_.fail(fmt::format("a field of {} times {} numbers", tuples, each));
                    if (binary_) in_.line();
                    read_numbers(name, type, tuples * each, each);
                }
            } else {
                return;
            }
        }
    }

    FileCursor& in_;
    bool binary_ = false, is_of_cells_ = false, has_groups_ = false;
    TetFileContent content_;
    VtkCells cells_;
};

}  // namespace

TetFileContent read_vtk(FileCursor& in) { return VtkReader(in).read(); }

}  // namespace nbd
