// Compares bodies with CalculiX and prints a CSV table. Usage: calculix_table BODY.h5...
#include <fmt/core.h>

#include <exception>

#include "tests/sim/calculix/calculix.hpp"

int main(int argc, char** argv) try {
    using namespace nbd;
    fmt::print("body,nodes,quantity,nbdtree,calculix,relative_difference\n");
    for (int i = 1; i < argc; ++i) {
        const Body body = load_body(argv[i]);
        auto rows = test::compare_frequencies(body);
        const auto deflections = test::compare_deflections(body);
        rows.insert(rows.end(), deflections.begin(), deflections.end());
        for (const MaterialLaw law : {MaterialLaw::corotated, MaterialLaw::st_venant_kirchhoff})
            rows.push_back(test::compare_large_deflection(body, law));
        for (const auto& row : rows)
            fmt::print("{},{},{},{:.7g},{:.7g},{:.1e}\n", body.name, body.tets.X.rows(), row.quantity,
                       row.ours, row.theirs, row.difference);
    }
} catch (const std::exception& error) {
    fmt::print(stderr, "calculix_table: {}\n", error.what());
    return 1;
}
