#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "apps/bench/solvers/preconditioner.hpp"

namespace nbd {

std::vector<PreconditionerEntry> rival_preconditioners() {
    std::vector<PreconditionerEntry> rivals{{"incomplete Cholesky", make_incomplete_cholesky}};
#ifdef NBD_WITH_HYPRE
    rivals.push_back({"hypre BoomerAMG", make_boomeramg});
#endif
#ifdef NBD_WITH_ML
    rivals.push_back({"Trilinos ML", make_ml});
#endif
    return rivals;
}

std::vector<std::string> missing_preconditioners() {
    std::vector<std::string> lines;
    const std::vector<PreconditionerEntry> found = rival_preconditioners();
    for (const auto& [name, packages] :
         {std::pair{"hypre BoomerAMG", "libhypre-dev libopenmpi-dev"},
          {"Trilinos ML",
           "libopenmpi-dev libtrilinos-ml-dev libtrilinos-epetraext-dev libtrilinos-epetra-dev "
           "libtrilinos-teuchos-dev "
           "libtrilinos-amesos-dev libtrilinos-ifpack-dev libtrilinos-aztecoo-dev"}})
        if (std::ranges::find(found, name, &PreconditionerEntry::name) == found.end())
            lines.push_back(
                fmt::format("{}: not found when this program was built (Debian: {})", name, packages));
    return lines;
}

}  // namespace nbd
