#include "sim/fem/modes.hpp"

#include <fmt/core.h>

#include <stdexcept>

#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/commands/commands.hpp"
#include "meshing/body/body.hpp"
#include "sim/factor/blas.hpp"

namespace nbd {
namespace {

struct ModesArguments {
    std::string body, csv;
    int count = 128;
};

std::string to_csv(const Eigen::VectorXd& hertz) {
    std::string text = "mode,frequency_hz\n";
    for (int i = 0; i < hertz.size(); ++i) text += fmt::format("{},{:.9g}\n", i, hertz[i]);
    return text;
}

/// Computes the modes. Errors name the body's file.
Modes modes_of(const Body& body, const ModesArguments& arguments) {
    try {
        return vibration_modes(ElasticBody(body), ModeOptions{.count = arguments.count});
    } catch (const std::exception& error) {
        throw std::runtime_error(fmt::format("{}: {}", arguments.body, error.what()));
    }
}

void run(const ModesArguments& arguments, Output& out) {
    hold_blas_to_one_thread();
    if (const BlasInfo blas = blas_info(); !blas.fast) out.warning(blas.warning);
    check_outputs({{"csv", arguments.csv, ".csv"}}, {arguments.body});
    Body body = load_body(arguments.body);
    check_output(arguments.body, {});
    out.work("computing modes");
    const auto [basis, report] = modes_of(body, arguments);
    body.modes = basis;
    save_body(arguments.body, body);
    write_text(arguments.csv, to_csv(basis.frequencies));

    out.text(fmt::format("{} modes from {:.4g} to {:.4g} Hz, six rigid ones below {:.2g} Hz dropped",
                         basis.count(), basis.frequencies[0], basis.frequencies[basis.count() - 1],
                         report.max_rigid_hz));
    out.text(fmt::format("largest residual {:.1e}, orthonormal within {:.1e}", report.max_residual,
                         report.orthonormality));
    out.result({{"modes", basis.count()},
                {"frequencies_hz", std::vector<double>(basis.frequencies.begin(), basis.frequencies.end())},
                {"max_rigid_hz", report.max_rigid_hz},
                {"max_residual", report.max_residual}});
}

}  // namespace

void add_modes(CLI::App& app, Output& out) {
    const auto [command, arguments] = add_command<ModesArguments>(
        app, out, "modes", "Computes the vibration modes of a body and stores them in its file", run);
    command.add_option("BODY", arguments.body, "Body file; rewritten with the modes")->required();
    command.add_option("-m,--modes", arguments.count, "Number of modes, without the six rigid ones")
        ->check(whole_number(1, 2048));
    command.add_option("--csv", arguments.csv, "File for the frequencies (CSV)");
}

}  // namespace nbd
