// Compares the library's geometry with exact geometry of small whole numbers, as often as one likes:
//   differential triangles 100000000 [SEED]
// Prints one line; exit status 1 if any case differs.
#include <fmt/core.h>

#include <cstdlib>
#include <map>
#include <string>

#include "tests/differential/compare.hpp"

int main(int argc, char** argv) {
    using Compare = nbd::test::Comparison (*)(std::uint64_t, long);
    const std::map<std::string, Compare> known{{"triangles", nbd::test::compare_triangles},
                                               {"distances", nbd::test::compare_distances},
                                               {"queries", nbd::test::compare_queries}};
    const auto compare = argc > 1 ? known.find(argv[1]) : known.end();
    const long cases = argc > 2 ? std::atol(argv[2]) : 0;
    if (compare == known.end() || cases <= 0) {
        fmt::print(stderr,
                   "usage: differential triangles|distances|queries CASES [SEED]; CASES is 1 or more\n");
        return 2;
    }
    const std::uint64_t seed = argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 1;
    const nbd::test::Comparison result = compare->second(seed, cases);
    fmt::print("{}: {} cases, {} hits, {} degenerate, {} different\n", compare->first, result.cases,
               result.hits, result.degenerate, result.different);
    if (result.different > 0) fmt::print("the first: {}\n", result.first);
    return result.different > 0 ? 1 : 0;
}
