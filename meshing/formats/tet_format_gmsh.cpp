#include <fmt/format.h>

#include <string>
#include <unordered_map>

#include "meshing/formats/tet_formats.hpp"

namespace nbd {
namespace {

/// Node count and dimension of gmsh's element types, by type number; zero for unsupported numbers.
struct ElementType {
    int nodes = 0, dimension = 0;
};
constexpr ElementType element_types[] = {
    {},      {2, 1},  {3, 2},  {4, 2},  {4, 3}, {8, 3}, {6, 3},  {5, 3},  {3, 1},  {6, 2}, {9, 2},
    {10, 3}, {27, 3}, {18, 3}, {14, 3}, {1, 0}, {8, 2}, {20, 3}, {15, 3}, {13, 3}, {9, 2}, {10, 2},
    {12, 2}, {15, 2}, {15, 2}, {21, 2}, {4, 1}, {5, 1}, {6, 1},  {20, 3}, {35, 3}, {56, 3}};
constexpr int gmsh_triangle = 2, gmsh_tetrahedron = 4;

class GmshReader {
 public:
    explicit GmshReader(FileCursor& in) : in_(in) {}

    TetFileContent read() {
        in_.expect("$MeshFormat");
        read_format();
        bool nodes = false, elements = false;
        while (!in_.at_end()) {
            const std::string section(in_.word());
            if (section == "$PhysicalNames") {
                read_names();
            } else if (section == "$Entities" && version_ >= 4) {
                begin_data(true);
                read_entities();
            } else if (section == "$Nodes" && !nodes) {
                begin_data(version_ >= 4);
                version_ < 4 ? read_nodes_2() : read_nodes_4();
                nodes = true;
            } else if (section == "$Elements" && nodes && !elements) {
                begin_data(version_ >= 4);
                version_ < 4 ? read_elements_2() : read_elements_4();
                elements = true;
            } else if (section.size() > 1 && section[0] == '$' && section != "$Nodes" &&
                       section != "$Elements") {
                in_.skip_past("$End" + section.substr(1));
                continue;
            } else {
                in_.fail("expected a section; $Nodes and $Elements must appear once each, in this order");
            }
            in_.read_text();
            in_.expect("$End" + section.substr(1));
        }
        if (!elements) in_.fail("the file ends early, without $Elements");
        return std::move(content_);
    }

 private:
    void read_format() {
        version_ = in_.real64();
        const int binary = in_.int32(), width = in_.int32();
        if (!(version_ >= 2 && version_ < 3) && version_ != 4.1)
            in_.fail(fmt::format("version {} is not supported; allowed: 2.x and 4.1", version_));
        if ((binary != 0 && binary != 1) || width != 8)
            in_.fail(fmt::format("format {} with {} bytes per number; allowed: format 0 or 1, 8 bytes",
                                 binary, width));
        binary_ = binary == 1;
        if (binary_) {
            in_.line();
            in_.read_binary(false);
            const std::uint32_t one = in_.int32();
            swapped_ = one == 0x01000000u;
            if (one != 1 && !swapped_) in_.fail("the byte order mark is not 1 in either byte order");
            in_.read_text();
        }
        in_.expect("$EndMeshFormat");
    }

    /// Lines such as: 3 7 "core". They are text in binary files too.
    void read_names() {
        const std::size_t n = in_.count("names", 5);
        for (std::size_t i = 0; i < n; ++i) {
            const int dimension = in_.int32(), number = in_.int32();
            const std::string_view text = in_.line();
            const std::size_t open = text.find('"'), close = text.rfind('"');
            if (open == text.npos || close == open) in_.fail("expected a name in quotes");
            const std::string name(text.substr(open + 1, close - open - 1));
            if (dimension == 3) content_.group_names[number] = name;
            if (dimension == 2) content_.triangle_group_names[number] = name;
        }
    }

    std::size_t count_4(std::string_view things) { return in_.count(things, 1); }

    /// Keeps the first physical group of each volume and surface.
    void read_entities() {
        const std::size_t counts[] = {count_4("points"), count_4("curves"), count_4("surfaces"),
                                      count_4("volumes")};
        for (int dimension = 0; dimension < 4; ++dimension)
            for (std::size_t i = 0; i < counts[dimension]; ++i) {
                const int tag = in_.int32();
                for (int k = 0; k < (dimension == 0 ? 3 : 6); ++k) in_.real64();  // position, or box
                const std::size_t groups = count_4("groups");
                for (std::size_t g = 0; g < groups; ++g) {
                    const int number = in_.int32();
                    if (dimension >= 2 && g == 0) group_of_entity_[dimension - 2][tag] = number;
                }
                if (dimension == 0) continue;
                const std::size_t bounding = count_4("bounding entities");
                for (std::size_t k = 0; k < bounding; ++k) in_.int32();
            }
    }

    /// Binary data start on the line after the section name, or after the count if the count is text (2.x).
    void begin_data(bool at_once) {
        if (binary_ && at_once) {
            in_.line();
            in_.read_binary(swapped_);
        }
    }

    std::size_t read_count_2(std::string_view things) {
        const std::size_t n = in_.count(things, 8);
        if (binary_) {
            in_.line();
            in_.read_binary(swapped_);
        }
        return n;
    }

    void add_node(std::int64_t tag, const std::array<double, 3>& x) {
        if (!row_of_tag_.emplace(tag, content_.nodes.size()).second)
            in_.fail(fmt::format("node {} occurs twice", tag));
        content_.nodes.push_back(x);
    }

    std::array<double, 3> point() {
        const double x = in_.real64(), y = in_.real64(), z = in_.real64();
        return {x, y, z};
    }

    void read_nodes_2() {
        const std::size_t n = read_count_2("nodes");
        content_.nodes.reserve(n);
        for (std::size_t i = 0; i < n; ++i) {
            const int tag = in_.int32();
            add_node(tag, point());
        }
    }

    void read_nodes_4() {
        const std::size_t blocks = in_.count("blocks of nodes", 8), total = in_.count("nodes", 6);
        in_.int64();  // smallest tag
        in_.int64();  // largest tag
        content_.nodes.reserve(total);
        std::vector<std::int64_t> tags;
        for (std::size_t b = 0; b < blocks; ++b) {
            const int dimension = in_.int32();
            in_.int32();  // entity
            const int parametric = in_.int32();
            tags.resize(in_.count("nodes", 8));
            for (std::int64_t& tag : tags) tag = in_.int64();
            for (const std::int64_t tag : tags) {
                add_node(tag, point());
                for (int p = 0; parametric != 0 && p < dimension; ++p) in_.real64();
            }
        }
        if (content_.nodes.size() != total)
            in_.fail(fmt::format("announces {} nodes, but holds {}", total, content_.nodes.size()));
    }

    ElementType type_of(int number) {
        const bool known = number > 0 && number < std::ssize(element_types);
        if (!known) in_.fail(fmt::format("element type {} is not known", number));
        const ElementType type = element_types[number];
        if (type.dimension == 3 && number != gmsh_tetrahedron)
            in_.fail(
                fmt::format("a volume element of type {} with {} nodes; only 4-node tetrahedra are allowed",
                            number, type.nodes));
        return type;
    }

    template <std::size_t count, class Get>
    std::array<int, count> corners_of(const char* what, std::size_t index, Get get) {
        std::array<int, count> corners{};
        for (int& corner : corners) {
            const std::int64_t tag = get();
            const auto found = row_of_tag_.find(tag);
            if (found == row_of_tag_.end())
                in_.fail(fmt::format("{} {} refers to node {}, which is not in the file", what, index, tag));
            corner = found->second;
        }
        return corners;
    }

    /// Reads the nodes of one element. group: its physical group, 0 if none. get: reads the next tag.
    template <class Get>
    void read_corners(int number, const ElementType& type, int group, Get get) {
        if (number != gmsh_tetrahedron) {
            ++content_.other_cells;
            if (number == gmsh_triangle && group != 0) {
                content_.triangles.push_back(corners_of<3>("triangle", content_.triangles.size(), get));
                content_.group_of_triangle.push_back(group);
                return;
            }
            for (int c = 0; c < type.nodes; ++c) get();
            return;
        }
        const std::array<int, 4> tet = corners_of<4>("tetrahedron", content_.tets.size(), get);
        content_.tets.push_back(tet);
        content_.group_of_tet.push_back(group);
    }

    void read_elements_2() {
        const std::size_t n = read_count_2("elements");
        const auto next = [&] { return in_.int32(); };
        for (std::size_t done = 0; done < n;) {
            std::size_t follow = 1;
            int number = 0, tags = 0;
            if (binary_) {
                number = in_.int32();
                follow = in_.check_count(in_.int32(), "elements", 8);
                tags = in_.int32();
                if (follow == 0 || follow > n - done) in_.fail("more elements than the section announces");
            } else {
                next();  // element tag
                number = in_.int32();
                tags = in_.int32();
            }
            const ElementType type = type_of(number);
            const std::size_t tag_count = in_.check_count(tags, "tags", 1);
            for (std::size_t e = 0; e < follow; ++e) {
                if (binary_) next();
                int group = 0;  // the first of the tags
                for (std::size_t t = 0; t < tag_count; ++t) {
                    const int tag = next();
                    if (t == 0) group = tag;
                }
                read_corners(number, type, group, next);
            }
            done += follow;
        }
    }

    void read_elements_4() {
        const std::size_t blocks = in_.count("blocks of elements", 8), total = in_.count("elements", 4);
        in_.int64();  // smallest tag
        in_.int64();  // largest tag
        const auto next = [&] { return in_.int64(); };
        std::size_t done = 0;
        for (std::size_t b = 0; b < blocks; ++b) {
            const int dimension = in_.int32(), entity = in_.int32(), number = in_.int32();
            int group = 0;
            if (dimension == 2 || dimension == 3)
                if (const auto& groups = group_of_entity_[dimension - 2]; groups.contains(entity))
                    group = groups.at(entity);
            const std::size_t n = in_.count("elements", 4);
            const ElementType type = type_of(number);
            for (std::size_t e = 0; e < n; ++e) {
                next();  // element tag
                read_corners(number, type, group, next);
            }
            done += n;
        }
        if (done != total) in_.fail(fmt::format("announces {} elements, but holds {}", total, done));
    }

    FileCursor& in_;
    double version_ = 0;
    bool binary_ = false, swapped_ = false;
    TetFileContent content_;
    std::unordered_map<std::int64_t, int> row_of_tag_;
    std::array<std::unordered_map<int, int>, 2> group_of_entity_;  // of surfaces and volumes
};

}  // namespace

TetFileContent read_gmsh(FileCursor& in) { return GmshReader(in).read(); }

}  // namespace nbd
