#include "meshing/h5/inspect.hpp"

#include <memory>

#include "apps/commands/commands.hpp"

namespace nbd {

void add_inspect(CLI::App& app, Output& out) {
    auto path = std::make_shared<std::string>();
    CLI::App* command = app.add_subcommand("inspect", "What a file of ours holds, and whether it is whole");
    command->add_option("FILE", *path, "Body, recording or tree file")->required();
    command->final_callback([path, &out] {
        const std::string report = h5::inspect(*path);
        out.text(report);
        out.result({{"file", *path}, {"whole", true}, {"report", report}});
    });
}

}  // namespace nbd
