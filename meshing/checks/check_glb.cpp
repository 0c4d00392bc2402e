#include "meshing/checks/check_glb.hpp"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace nbd {
namespace {

using nlohmann::json;

constexpr int most_values = 64, most_nodes = 1000;

static_assert(std::endian::native == std::endian::little, "the numbers of a .glb file are little-endian");

/// The JSON text of a file; empty where it is none.
std::string json_text(const std::filesystem::path& path) {
    struct Start {
        char magic[4];
        std::uint32_t version, bytes, json_bytes;
        char kind[4];
    } start{};
    std::ifstream file(path, std::ios::binary);
    if (!file.read(reinterpret_cast<char*>(&start), sizeof start) || std::memcmp(start.magic, "glTF", 4) != 0)
        return {};
    if (const std::uintmax_t bytes = std::filesystem::file_size(path); start.json_bytes > bytes)
        throw std::runtime_error(
            fmt::format("glTF: its JSON text has {} bytes, but the file has {}", start.json_bytes, bytes));
    std::string text(start.json_bytes, '\0');
    return file.read(text.data(), static_cast<std::streamsize>(text.size())) ? text : std::string();
}

/// Counts how deeply the brackets outside of strings are nested.
void check_values(const std::string& text) {
    int depth = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (in_string && c == '\\') ++i;
        if (c == '"') in_string = !in_string;
        if (in_string) continue;
        depth += (c == '{' || c == '[') - (c == '}' || c == ']');
        if (depth > most_values)
            throw std::runtime_error(fmt::format("glTF: values are nested more than {} deep", most_values));
    }
}

/// The children of a node that are nodes.
std::vector<std::size_t> children_of(const json& nodes, std::size_t node) {
    std::vector<std::size_t> children;
    if (!nodes[node].is_object() || !nodes[node].contains("children")) return children;
    for (const json& child : nodes[node]["children"])
        if (child.is_number_unsigned() && child.get<std::size_t>() < nodes.size()) children.push_back(child);
    return children;
}

/// Follows the children of all nodes that have no parent.
void check_nodes(const json& nodes) {
    std::vector<bool> has_parent(nodes.size());
    for (std::size_t node = 0; node < nodes.size(); ++node)
        for (const std::size_t child : children_of(nodes, node)) has_parent[child] = true;
    std::vector<int> depths(nodes.size(), 0);
    std::vector<std::size_t> open;
    for (std::size_t node = 0; node < nodes.size(); ++node)
        if (!has_parent[node]) open.push_back(node);
    if (open.empty() && !nodes.empty())
        throw std::runtime_error("glTF: its nodes are children of each other");
    while (!open.empty()) {
        const std::size_t node = open.back();
        open.pop_back();
        for (const std::size_t child : children_of(nodes, node)) {
            if (depths[node] + 1 <= depths[child]) continue;
            depths[child] = depths[node] + 1;
            if (depths[child] > most_nodes)
                throw std::runtime_error(fmt::format("glTF: nodes are nested more than {} deep", most_nodes));
            open.push_back(child);
        }
    }
}

}  // namespace

void check_glb(const std::filesystem::path& path) {
    const std::string text = json_text(path);
    check_values(text);
    const json file = json::parse(text, nullptr, false);
    if (file.is_object() && file.contains("nodes") && file["nodes"].is_array()) check_nodes(file["nodes"]);
}

}  // namespace nbd
