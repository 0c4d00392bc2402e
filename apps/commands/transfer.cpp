#include <fmt/core.h>

#include "apps/cli/load_body.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/commands/commands.hpp"
#include "meshing/body/body.hpp"
#include "training/learn/transfer_tree.hpp"

namespace nbd {
namespace {

struct TransferArguments {
    std::string tree, body, output;
};

void run(const TransferArguments& arguments, Output& out) {
    check_output(arguments.output, {arguments.tree, arguments.body}, ".h5");
    out.work("transferring");
    const TreeFile trained = load_tree(arguments.tree);
    const SurfaceBody body = surface_body(load_body(arguments.body));
    TreeFile file;
    try {
        file = transfer_tree(trained, body);
    } catch (const std::invalid_argument& e) {
        throw std::runtime_error(fmt::format("{} to {}: {}", arguments.tree, arguments.body, e.what()));
    }
    save_tree(arguments.output, file);
    out.text(
        fmt::format("{}: bounds of {} nodes, trained on {} vertices, transferred to {} vertices and {} faces",
                    arguments.output, file.tree.spheres.nodes.size(), trained.tree.vertex_count,
                    file.tree.vertex_count, file.tree.faces.rows()));
    out.result({{"nodes", file.tree.spheres.nodes.size()},
                {"vertices", file.tree.vertex_count},
                {"faces", file.tree.faces.rows()}});
}

}  // namespace

void add_transfer(CLI::App& app, Output& out) {
    const auto [command, arguments] = add_command<TransferArguments>(
        app, out, "transfer", "Transfers a tree's nbd bounds to another resolution of the surface", run);
    command.add_option("TREE", arguments.tree, "Tree file with nbd bounds")->required();
    command.add_option("BODY", arguments.body, "Body file with the other surface")->required();
    command.add_option("-o,--output", arguments.output, "Tree file to write")->required();
}

}  // namespace nbd
