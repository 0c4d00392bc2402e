#include <fmt/core.h>

#include <memory>

#include "apps/cli/output_paths.hpp"
#include "apps/commands/commands.hpp"
#include "collision/flat/flat_tree.hpp"
#include "meshing/h5/atomic_file.hpp"
#include "training/learn/torch_file.hpp"

namespace nbd {
namespace {

struct ExportArguments {
    std::string tree, torch, flat;
    bool is_flat = false;
};

void write_torch(const std::string& path, const TreeFile& file, Output& out) {
    save_torch(path, file);
    const auto nodes = file.tree.spheres.nodes.size();
    out.text(fmt::format("{}: the networks of {} nodes; training/torch/nbd_tree.py runs them in PyTorch",
                         path, nodes));
    out.result({{"nodes", nodes}});
}

void write_flat(const std::string& path, const CollisionTree& tree, Output& out) {
    const std::vector<std::byte> bytes = write_flat_tree(tree);
    h5::AtomicFile file(path);
    file.out().write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    file.commit();
    out.text(
        fmt::format("{}: the collision tree of {} faces, {} bytes; collision/flat/flat_tree.hpp loads it",
                    path, tree.faces.rows(), bytes.size()));
    out.result({{"faces", tree.faces.rows()}, {"bytes", bytes.size()}});
}

void run(const ExportArguments& arguments, Output& out) {
    const std::string& output = arguments.is_flat ? arguments.flat : arguments.torch;
    check_output(output, {arguments.tree});
    out.work("exporting");
    const TreeFile file = load_tree(arguments.tree);
    if (arguments.is_flat)
        write_flat(output, file.tree, out);
    else
        write_torch(output, file, out);
}

}  // namespace

void add_export(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<ExportArguments>();
    CLI::App* command = app.add_subcommand("export", "Writes a tree for other programs");
    command->add_option("TREE", arguments->tree, "Tree file")->required();
    CLI::Option_group* form = command->add_option_group("form");
    form->add_option("--torch", arguments->torch,
                     "File of plain arrays to write, for PyTorch (see training/torch)");
    CLI::Option* flat = form->add_flag("--flat", arguments->is_flat,
                                       "Write the whole tree as one file of plain arrays, for programs "
                                       "that embed nbd::collision (see collision/flat)");
    form->require_option(1);
    flat->needs(
        command->add_option("-o,--output", arguments->flat, "Flat file to write, TREE.nbd")->needs(flat));
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd
