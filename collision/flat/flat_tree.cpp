#include "collision/flat/flat_tree.hpp"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "collision/base/message.hpp"
#include "collision/base/notice.hpp"
#include "collision/base/temporary_files.hpp"
#include "collision/flat/flat_fields.hpp"

namespace nbd {
namespace {

/// Leaves out the arrays of bounds that are gone, with a notice. Returns whether there are any.
bool leave_out_gone_bounds(FlatFieldReader& file) {
    bool any = false;
    for (const GoneBounds& gone : gone_bounds)
        if (file.leave_out(message(gone.group, '/'))) {
            any = true;
            notice(message("a flat tree: ", left_out(gone)));
        }
    for (const char* bounds : {"learned_spheres", "learned_boxes"})
        file.leave_out(message("calibration/", bounds, '/'));
    return any;
}

[[noreturn]] void fail(const std::filesystem::path& path, const auto&... parts) {
    throw std::runtime_error(message(path.string(), ": ", parts...));
}

/// The bytes of a file; only the beginning of a foreign file, which may be large.
std::vector<std::byte> file_content(const std::filesystem::path& path) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(path, error);
    if (error == std::errc::no_such_file_or_directory || error == std::errc::not_a_directory)
        fail(path, "no such file");
    if (error) fail(path, "cannot be read: ", error.message());
    errno = 0;
    std::ifstream in(path, std::ios::binary);
    std::vector<std::byte> content;
    const auto read_to = [&](std::uintmax_t end) {
        const std::size_t begin = content.size();
        content.resize(end);
        in.read(reinterpret_cast<char*>(content.data() + begin), end - begin);
        if (!in) fail(path, "cannot be read: ", std::generic_category().message(errno));
    };
    read_to(std::min<std::uintmax_t>(size, sizeof(FlatHeader)));
    if (is_flat_file(content)) read_to(size);
    return content;
}

}  // namespace

CollisionTree read_flat_tree(std::span<const std::byte> file) {
    FlatFieldReader reader(file);
    CollisionTree tree;
    try {
        StoredModels models;
        tree_fields::tree(reader, tree, models);
        const bool lost_bounds = leave_out_gone_bounds(reader);
        reader.finish();
        if (models.are_networks_rounded)
            throw std::invalid_argument("NBD-Tree: has weights that are not rounded to bytes");
        make_models(tree, std::move(models));
        if (lost_bounds) require_other_bounds(tree);
    } catch (const std::invalid_argument& e) {
        throw std::runtime_error(e.what());
    }
    return tree;
}

std::vector<std::byte> write_flat_tree(const CollisionTree& tree) {
    check_collision_tree(tree);
    FlatFieldWriter writer;
    const StoredModels models = stored_models(tree);
    tree_fields::tree(writer, tree, models);
    return writer.finish();
}

CollisionTree load_flat_tree(const std::filesystem::path& path) {
    const std::vector<std::byte> content = file_content(path);
    try {
        return read_flat_tree(content);
    } catch (const std::runtime_error& e) {
        fail(path, e.what());
    }
}

void save_flat_tree(const std::filesystem::path& path, const CollisionTree& tree) {
    const std::vector<std::byte> bytes = write_flat_tree(tree);
    TemporaryFile file(path);
    file.write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    file.commit();
}

}  // namespace nbd
