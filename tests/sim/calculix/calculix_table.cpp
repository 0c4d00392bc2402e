// Compares bodies with CalculiX and prints a CSV table. Usage: calculix_table BODY.h5...
// With --static in place of bodies: static increments of boxes.
#include <fmt/core.h>

#include <exception>
#include <string>

#include "tests/sim/calculix/calculix.hpp"

int main(int argc, char** argv) try {
    using namespace nbd;
    fmt::print("body,nodes,quantity,nbdtree,calculix,relative_difference\n");
    const auto tell = [](const std::string& body, Eigen::Index nodes, const test::Comparison& row) {
        fmt::print("{},{},{},{:.7g},{:.7g},{:.1e}\n", body, nodes, row.quantity, row.ours, row.theirs,
                   row.difference);
    };
    if (argc == 2 && std::string(argv[1]) == "--static") {
        for (const auto& row : test::compare_static_increments()) tell("box", row.nodes, row);
        return 0;
    }
    for (int i = 1; i < argc; ++i) {
        const Body body = load_body(argv[i]);
        auto rows = test::compare_frequencies(body);
        const auto deflections = test::compare_deflections(body);
        rows.insert(rows.end(), deflections.begin(), deflections.end());
        for (const MaterialLaw law : {MaterialLaw::corotated, MaterialLaw::st_venant_kirchhoff})
            rows.push_back(test::compare_large_deflection(body, law));
        for (const auto& row : rows) tell(body.name, body.tets.X.rows(), row);
    }
} catch (const std::exception& error) {
    fmt::print(stderr, "calculix_table: {}\n", error.what());
    return 1;
}
