#include <fmt/core.h>

#include <memory>

#include "apps/commands/commands.hpp"
#include "apps/load.hpp"
#include "training/torch_file.hpp"

namespace nbd {
namespace {

struct ExportArguments {
    std::string tree, torch;
};

void run(const ExportArguments& arguments, Output& out) {
    check_output(arguments.torch, {arguments.tree});
    const TreeFile file = load_tree(arguments.tree);
    save_torch(arguments.torch, file);
    const auto nodes = file.tree.spheres.nodes.size();
    out.text(fmt::format("{}: the networks of {} nodes; training/torch/modal_tree.py runs them in PyTorch",
                         arguments.torch, nodes));
    out.result({{"nodes", nodes}});
}

}  // namespace

void add_export(CLI::App& app, Output& out) {
    auto arguments = std::make_shared<ExportArguments>();
    CLI::App* command = app.add_subcommand("export", "Writes a tree's networks for other programs");
    command->add_option("TREE", arguments->tree, "Tree file")->required();
    command
        ->add_option("--torch", arguments->torch,
                     "File of plain arrays to write, for PyTorch (see training/torch)")
        ->required();
    command->final_callback([arguments, &out] { run(*arguments, out); });
}

}  // namespace nbd
